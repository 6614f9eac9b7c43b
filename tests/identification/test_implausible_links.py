"""What no such robot can have is marked, and what it may have is not."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.identification import implausible_links
from excite_cli.identification.implausible_links import implausible, marked
from excite_cli.identification.link_changes import LinkChange, link_changes
from excite_cli.identification.prior import inertial_prior
from excite_cli.robot.model import Array, Robot, build_robot
from tests.cli.program import SMOKE

UPPER_ARM = 1  # a box of 80 x 80 x 360 mm, of 3 kg


@pytest.fixture(scope="module")
def robot() -> Robot:
    return build_robot(RobotSpec(urdf=str(SMOKE.parents[1] / "data" / "smoke_arm.urdf")))


def judged(robot: Robot, phi: Array, share: float = 0.01) -> tuple[LinkChange, ...]:
    """Marks of φ, known to `share` of its prior's deviations."""
    prior = inertial_prior(robot, standard_parameters(robot), 1.0)
    covariance = np.diag(np.square(share * prior.std))
    links = link_changes(robot, phi, covariance, prior)
    return marked(robot, links, phi, covariance, prior)


def body(robot: Robot, mass: float = 1.0, shift: tuple[float, ...] = (0, 0, 0)) -> Array:
    """φ with the upper arm's mass multiplied and its centre moved, its gyration kept."""
    phi = standard_parameters(robot).copy()
    ten = phi[10 * UPPER_ARM : 10 * UPPER_ARM + 10]
    ten *= mass
    ten[1:4] += ten[0] * np.array(shift)
    return phi


def marks(links: tuple[LinkChange, ...]) -> tuple[str, ...]:
    assert not any(link.marks for k, link in enumerate(links) if k != UPPER_ARM)
    return links[UPPER_ARM].marks


def test_the_urdf_itself_is_not_marked(robot: Robot) -> None:
    assert marks(judged(robot, standard_parameters(robot))) == ()


@pytest.mark.parametrize(
    ("times", "expected"), [(3.2, True), (2.8, False), (0.3, True), (0.4, False)]
)
def test_mass(robot: Robot, times: float, expected: bool) -> None:
    found = marks(judged(robot, body(robot, mass=times)))
    assert found == ((f"mass {3 * times:.3g} kg where the URDF has 3 kg",) if expected else ())


def test_next_to_no_mass(robot: Robot) -> None:
    assert marks(judged(robot, body(robot, mass=1e-6)))[0].startswith("mass next to none where")


def test_a_centre_outside_of_the_shape(robot: Robot) -> None:
    """z from 0.17 m to 0.45 m, where the box ends at 0.36 m (0.39 m would be in doubt)."""
    (found,) = marks(judged(robot, body(robot, shift=(0, 0, 0.28))))
    assert found.startswith("centre of mass at z = 450 ±")
    assert found.endswith("90 mm outside of the link")


def test_a_centre_that_is_not_known_well_is_not_marked(robot: Robot) -> None:
    assert marks(judged(robot, body(robot, shift=(0, 0, 0.28)), share=1.0)) == ()


def test_a_centre_inside_the_shape_but_off_the_line_of_joints_is_fine(robot: Robot) -> None:
    inside = body(robot, shift=(0.015, 0.02, 0.1))
    assert marks(judged(robot, inside, share=1e-4)) == ()


def test_without_shapes_a_link_is_as_wide_as_its_length(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(implausible_links, "link_shapes", lambda *given: ())
    assert marks(judged(robot, body(robot, shift=(0, 0, 0.28)))) == ()
    assert marks(judged(robot, body(robot, shift=(0, 0, 0.9)))) != ()


def test_shapes_are_read_only_if_a_link_is_in_doubt(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    read = []
    monkeypatch.setattr(implausible_links, "collision_model", lambda robot: read.append(1))
    judged(robot, body(robot, mass=2.0))
    assert read == []


def test_the_inertia_of_a_rotor_in_a_link(robot: Robot) -> None:
    """An armature that is not declared: more than any mass within the link can have."""
    phi = body(robot)
    phi[10 * UPPER_ARM + np.array([4, 6, 9])] += 1.0
    (found,) = marks(judged(robot, phi))
    assert found.startswith("radius of gyration ")
    assert "the link ends after" in found
    assert marks(judged(robot, phi, share=100.0)) == ()


def test_one_warning_for_all_links(robot: Robot) -> None:
    links = judged(robot, body(robot, mass=4.0))
    (finding,) = implausible(links, "free", robot.joint_names)
    assert (finding.kind, finding.severity) == ("implausible_link", "warning")
    assert finding.joints == (robot.joint_names[UPPER_ARM],)
    assert "upper_arm: mass 12 kg where the URDF has 3 kg" in finding.text
    assert "identification.inertias: cad" in finding.text
    (kept,) = implausible(links, "cad", robot.joint_names)
    assert "inertias: cad" not in kept.text
    many = [replace(link, marks=("x",)) for link in links]
    (finding,) = implausible(many, "free", robot.joint_names)
    assert "; and 2 more." in finding.text
    assert len(finding.joints) == 5
    assert implausible(judged(robot, body(robot)), "free", robot.joint_names) == []
