"""What no such robot can have is marked, and what it may have is not."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.dynamics.pseudo_inertia import inertial_prior
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.identification import implausible_links
from excite_cli.identification.implausible_links import implausible, marked
from excite_cli.identification.link_changes import LinkChange, link_changes
from excite_cli.robot.model import Array, build_robot
from tests.cli.program import SMOKE

UPPER_ARM = 1  # a box of 80 x 80 x 360 mm, of 3 kg
ROBOT = build_robot(RobotSpec(urdf=str(SMOKE.parents[1] / "data" / "smoke_arm.urdf")))


def judged(phi: Array, share: float = 0.01) -> tuple[LinkChange, ...]:
    """Marks of φ, known to `share` of its prior's deviations."""
    prior = inertial_prior(ROBOT, standard_parameters(ROBOT), 1.0)
    covariance = np.diag(np.square(share * prior.std))
    links = link_changes(ROBOT, phi, covariance, prior)
    return marked(ROBOT, links, phi, covariance, prior)


def body(mass: float = 1.0, shift: tuple[float, ...] = (0, 0, 0)) -> Array:
    """φ with the upper arm's mass multiplied and its centre moved, its gyration kept."""
    phi = standard_parameters(ROBOT).copy()
    ten = phi[10 * UPPER_ARM : 10 * UPPER_ARM + 10]
    ten *= mass
    ten[1:4] += ten[0] * np.array(shift)
    return phi


def marks(links: tuple[LinkChange, ...]) -> tuple[str, ...]:
    assert not any(link.marks for k, link in enumerate(links) if k != UPPER_ARM)
    return links[UPPER_ARM].marks


@pytest.mark.parametrize(
    ("times", "expected"),
    [
        (1.0, ()),
        (3.2, ("mass 9.6 kg where the URDF has 3 kg",)),
        (2.8, ()),
        (0.3, ("mass 0.9 kg where the URDF has 3 kg",)),
        (0.4, ()),
        (1e-6, ("mass next to none where the URDF has 3 kg",)),
    ],
)
def test_mass(times: float, expected: tuple[str, ...]) -> None:
    assert marks(judged(body(mass=times))) == expected


def test_a_centre_outside_of_the_shape() -> None:
    """z from 0.17 m to 0.45 m, where the box ends at 0.36 m (0.39 m would be in doubt)."""
    outside = body(shift=(0, 0, 0.28))
    (found,) = marks(judged(outside))
    assert found.startswith("centre of mass at z = 450 ±")
    assert found.endswith("90 mm outside of the link")
    assert marks(judged(outside, share=1.0)) == (), "it is not known well"
    inside = body(shift=(0.015, 0.02, 0.1))  # off the line of joints
    assert marks(judged(inside, share=1e-4)) == ()


def test_without_shapes_a_link_is_as_wide_as_its_length(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(implausible_links, "link_shapes", lambda *given: ())
    assert marks(judged(body(shift=(0, 0, 0.28)))) == ()
    assert marks(judged(body(shift=(0, 0, 0.9)))) != ()


def test_shapes_are_read_only_if_a_link_is_in_doubt(monkeypatch: pytest.MonkeyPatch) -> None:
    read = []
    monkeypatch.setattr(implausible_links, "collision_model", lambda robot: read.append(1))
    judged(body(mass=2.0))
    assert read == []


def test_the_inertia_of_a_rotor_in_a_link() -> None:
    """An armature that is not declared: more than any mass within the link can have."""
    phi = body()
    phi[10 * UPPER_ARM + np.array([4, 6, 9])] += 1.0
    (found,) = marks(judged(phi))
    assert found.startswith("radius of gyration ")
    assert "the link ends after" in found
    assert marks(judged(phi, share=100.0)) == ()


def test_one_warning_for_all_links() -> None:
    links = judged(body(mass=4.0))
    (finding,) = implausible(links, "free", ROBOT.joint_names)
    assert (finding.kind, finding.severity) == ("implausible_link", "warning")
    assert finding.joints == (ROBOT.joint_names[UPPER_ARM],)
    assert "upper_arm: mass 12 kg where the URDF has 3 kg" in finding.text
    assert "identification.inertias: cad" in finding.text
    (kept,) = implausible(links, "cad", ROBOT.joint_names)
    assert "inertias: cad" not in kept.text
    many = [replace(link, marks=("x",)) for link in links]
    (finding,) = implausible(many, "free", ROBOT.joint_names)
    assert "; and 2 more." in finding.text
    assert len(finding.joints) == 5
    assert implausible(judged(body()), "free", ROBOT.joint_names) == []
