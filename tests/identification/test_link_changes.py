"""Mass and centre of every link before and after a fit; data from MuJoCo."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.config.load_spec import load_spec
from excite_cli.dynamics.pseudo_inertia import InertialPrior, inertial_prior
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.identification.identify import Identification, identify
from excite_cli.identification.link_changes import inertial_covariance, link_changes
from excite_cli.robot.model import Array
from excite_cli.summary.identification import (
    identification_answer,
    identification_parts,
    link_data,
    link_parts,
)
from tests.cli.program import SMOKE
from tests.diagnosis.simulated_arm import BASE, ROBOT, SLIDE, PlantedEffect, planted, simulated

DECLARED = "[{kind: viscous_friction}, {kind: coulomb_friction}]"
CAD = standard_parameters(ROBOT)
TOOL = 1.8  # kg


def recorded(error: float, *extra: PlantedEffect) -> tuple[Identification, Array]:
    """What four motions tell, and the robot's own φ."""
    played = simulated(
        extra, (1, 2, 3, 4), 4.0, declared=DECLARED,
        inertia_error=error, torque_noise=0.03, noise_correlation=0.9,
    )  # fmt: skip
    spec = load_spec(SMOKE, [f"effects={DECLARED}"])
    return identify(ROBOT, BASE, played.dataset, spec), played.truth.phi


@pytest.fixture(scope="module")
def changed() -> tuple[Identification, Array]:
    return recorded(0.3)


@pytest.fixture(scope="module")
def with_tool() -> Identification:
    """A tool that neither the URDF nor the config knows."""
    return recorded(0.0, planted("payload", SLIDE, TOOL, cx=0.0, cy=0.0, cz=0.06))[0]


def centers(phi: Array) -> Array:
    bodies = phi.reshape(-1, 10)
    return bodies[:, 1:4] / bodies[:, :1]


def test_every_link_before_and_after(changed: tuple[Identification, Array]) -> None:
    found, truth = changed
    links, phi = found.fit.links, found.fit.best_phi()
    assert [link.link for link in links] == ["column", "upper_arm", "forearm", "wrist", "tool"]
    assert [link.joint for link in links] == list(ROBOT.joint_names)
    for body, link in enumerate(links):
        assert link.mass.before == pytest.approx(CAD[10 * body])
        assert link.mass.after == pytest.approx(phi[10 * body])
        assert [c.before for c in link.center] == pytest.approx(centers(CAD)[body])
        assert [c.after for c in link.center] == pytest.approx(centers(phi)[body])
        assert abs(link.mass.after - truth[10 * body]) < 3 * link.mass.std
        for change, true in zip(link.center, centers(truth)[body], strict=True):
            assert abs(change.after - true) < 3 * change.std
        assert link.marks == ()
    assert not [f for f in found.findings if f.kind == "implausible_link"]
    # What the data determine is told from what they do not. The column turns about the vertical:
    # its weight shows in no torque; the tool's does.
    links = {link.link: link for link in changed[0].fit.links}
    column, tool = links["column"], links["tool"]
    assert column.mass.left > 0.99
    assert not column.mass.determined
    # Of the prior, which is as wide as the others are off.
    assert 0.3 * column.mass.before < column.mass.std < 0.6 * column.mass.before
    assert tool.mass.determined
    assert tool.mass.std < 0.3 * tool.mass.before


def test_deviations_are_those_of_the_gaussian() -> None:
    """Against draws: mass and centre of φ drawn from the covariance have them."""
    prior = inertial_prior(ROBOT, CAD, 0.05)
    rng = np.random.default_rng(0)
    factor = np.linalg.qr(rng.normal(size=(200, BASE.rank + 1)), mode="r")
    covariance = inertial_covariance(100.0 * factor, BASE, prior)
    drawn = rng.multivariate_normal(CAD, covariance, size=20000)
    mass = drawn[:, ::10]
    center = drawn.reshape(len(drawn), -1, 10)[:, :, 1:4] / mass[:, :, None]
    for body, link in enumerate(link_changes(ROBOT, CAD, covariance, prior)):
        assert link.mass.std == pytest.approx(mass[:, body].std(), rel=0.05)
        stds = [change.std for change in link.center]
        assert stds == pytest.approx(list(center[:, body].std(axis=0)), rel=0.05)


def test_the_covariance_is_that_of_information_and_prior() -> None:
    prior = inertial_prior(ROBOT, CAD, 0.5)
    rng = np.random.default_rng(1)
    factor = np.linalg.qr(rng.normal(size=(90, BASE.rank + 2)), mode="r")  # one effect
    columns = np.zeros((len(factor) - 1, len(prior.mean) + 1))
    columns[:, :-1] = factor[:-1, : BASE.rank] @ BASE.mapping
    columns[:, -1] = factor[:-1, BASE.rank]
    information = columns.T @ columns + np.diag(np.append(1.0 / prior.std**2, 0.0))
    expected = np.linalg.inv(information)[:-1, :-1]
    found = inertial_covariance(factor, BASE, prior)
    assert found == pytest.approx(expected, rel=1e-4, abs=1e-6 * np.abs(expected).max())


def test_a_tool_that_is_not_in_the_urdf_is_marked(with_tool: Identification) -> None:
    links = {link.link: link for link in with_tool.fit.links}
    tool = links["tool"]
    assert tool.mass.after == pytest.approx(0.4 + TOOL, rel=0.05)
    assert tool.mass.significant
    assert "where the URDF has 0.4 kg" in tool.marks[0]
    assert all(not link.marks for name, link in links.items() if name != "tool")
    (finding,) = [f for f in with_tool.findings if f.kind == "implausible_link"]
    assert (finding.severity, finding.joints) == ("warning", (tool.joint,))
    for words in ("tool: mass 2.", "robot.payload", "excite diagnose", "identification.inertias"):
        assert words in finding.text
    # The table shows what changed and counts the rest.
    links = with_tool.fit.links
    table, counted = link_parts(links)
    assert not isinstance(table, str)
    assert "tool" in {row[0] for row in table.rows}
    assert len(table.rows) < 5
    assert str(counted).startswith(f"{5 - len(table.rows)} other links of 5")
    assert table in identification_parts(with_tool)
    quiet = [
        replace(
            link,
            marks=(),
            mass=replace(link.mass, after=link.mass.before),
            center=tuple(replace(change, after=change.before) for change in link.center),
        )
        for link in links
    ]
    assert link_parts(quiet) == [
        "5 links of 5: mass and centre within two standard deviations of the URDF's."
    ]
    assert link_parts(()) == []
    answer = identification_answer(with_tool, {}).data
    assert answer["links"] == link_data(links)
    tool = answer["links"][-1]
    assert (tool["link"], tool["mass"]["before"]) == ("tool", pytest.approx(0.4))
    assert tool["mass"]["determined"] is True
    assert (set(tool["center"]), len(tool["marks"])) == ({"x", "y", "z"}, 1)


def test_without_a_consistent_set_there_are_no_links() -> None:
    data = simulated([], (1, 2), 4.0, rate=100.0).dataset
    free = load_spec(SMOKE, [f"effects={DECLARED}", "identification.consistent=false"])
    assert identify(ROBOT, BASE, data, free).fit.links == ()


def test_a_link_without_mass_has_its_centre_at_the_frame() -> None:
    cad = CAD.copy()
    cad[10:20] = 0.0
    prior = InertialPrior(cad, np.full(len(cad), 0.1))
    link = link_changes(ROBOT, cad, 0.01 * np.eye(len(cad)), prior)[1]
    assert (link.mass.before, [c.before for c in link.center]) == (0.0, [0.0, 0.0, 0.0])
    assert np.isfinite([c.std for c in link.center]).all()
