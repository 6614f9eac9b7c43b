"""Mass and centre of every link before and after a fit; data from MuJoCo."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.config.load import load_spec
from excite_cli.config.spec import Spec
from excite_cli.dynamics.base_parameters import BaseParameters, find_base_parameters
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.catalogue import declared_effects, kind_named
from excite_cli.identification.identify import Identification, identify
from excite_cli.identification.link_changes import LinkChange, inertial_covariance, link_changes
from excite_cli.identification.prior import InertialPrior, inertial_prior
from excite_cli.robot.model import Array, Robot, build_robot
from excite_cli.summary.identification import (
    identification_answer,
    identification_parts,
    link_data,
    link_parts,
)
from tests.cli.program import SMOKE

pytest.importorskip("mujoco")

from excite_cli.simulation.ground_truth import Planted, plant
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate
from tests.diagnosis.test_changes import motion

DECLARED = "effects=[{kind: viscous_friction}, {kind: coulomb_friction}]"
TOOL = 1.8  # kg


@pytest.fixture(scope="module")
def spec() -> Spec:
    return load_spec(SMOKE, [DECLARED])


@pytest.fixture(scope="module")
def robot(spec: Spec) -> Robot:
    return build_robot(spec.robot, SMOKE.parent)


@pytest.fixture(scope="module")
def base(robot: Robot) -> BaseParameters:
    return find_base_parameters(robot)


def recorded(
    robot: Robot, base: BaseParameters, spec: Spec, error: float, extra: tuple[Planted, ...] = ()
) -> tuple[Identification, Array]:
    """What four motions tell, and the robot's own φ."""
    settings = SimulationSettings(
        rate=200.0, lead_in=0.5, inertia_error=error, torque_noise=0.03, noise_correlation=0.9
    )
    motions = [motion(robot, number) for number in range(1, 5)]
    effects = declared_effects(spec.effects, robot)
    played = simulate(robot, motions, settings, extra, declared=effects)
    return identify(robot, base, played.dataset, spec), played.truth.phi


@pytest.fixture(scope="module")
def changed(robot: Robot, base: BaseParameters, spec: Spec) -> tuple[Identification, Array]:
    return recorded(robot, base, spec, 0.3)


@pytest.fixture(scope="module")
def with_tool(robot: Robot, base: BaseParameters, spec: Spec) -> Identification:
    """A tool that neither the URDF nor the config knows."""
    centre = {"cx": 0.0, "cy": 0.0, "cz": 0.06}
    tool = plant(kind_named("payload"), (robot.n - 1,), TOOL, centre)
    return recorded(robot, base, spec, 0.0, (tool,))[0]


def centers(phi: Array) -> Array:
    bodies = phi.reshape(-1, 10)
    return bodies[:, 1:4] / bodies[:, :1]


def test_every_link_before_and_after(robot: Robot, changed: tuple[Identification, Array]) -> None:
    found, truth = changed
    links, cad = found.fit.links, standard_parameters(robot)
    assert [link.link for link in links] == ["column", "upper_arm", "forearm", "wrist", "tool"]
    assert [link.joint for link in links] == list(robot.joint_names)
    phi = found.fit.best_phi()
    for body, link in enumerate(links):
        assert link.mass.before == pytest.approx(cad[10 * body])
        assert link.mass.after == pytest.approx(phi[10 * body])
        for axis, change in enumerate(link.center):
            assert change.before == pytest.approx(centers(cad)[body, axis])
            assert change.after == pytest.approx(centers(phi)[body, axis])
        assert abs(link.mass.after - truth[10 * body]) < 3 * link.mass.std
        for change, true in zip(link.center, centers(truth)[body], strict=True):
            assert abs(change.after - true) < 3 * change.std
        assert link.marks == ()
    assert not [f for f in found.findings if f.kind == "implausible_link"]


def test_what_the_data_determine_is_told_from_what_they_do_not(
    changed: tuple[Identification, Array],
) -> None:
    """The column turns about the vertical: its weight shows in no torque; the tool's does."""
    links = {link.link: link for link in changed[0].fit.links}
    column, tool = links["column"], links["tool"]
    assert column.mass.left > 0.99
    assert not column.mass.determined
    # Of the prior, which is as wide as the others are off.
    assert 0.3 * column.mass.before < column.mass.std < 0.6 * column.mass.before
    assert tool.mass.determined
    assert tool.mass.std < 0.3 * tool.mass.before


def test_deviations_are_those_of_the_gaussian(robot: Robot, base: BaseParameters) -> None:
    """Against draws: mass and centre of φ drawn from the covariance have them."""
    cad = standard_parameters(robot)
    prior = inertial_prior(robot, cad, 0.05)
    rng = np.random.default_rng(0)
    factor = np.linalg.qr(rng.normal(size=(200, base.rank + 1)), mode="r")
    covariance = inertial_covariance(100.0 * factor, base, prior)
    drawn = rng.multivariate_normal(cad, covariance, size=20000)
    mass = drawn[:, ::10]
    center = drawn.reshape(len(drawn), -1, 10)[:, :, 1:4] / mass[:, :, None]
    for body, link in enumerate(link_changes(robot, cad, covariance, prior)):
        assert link.mass.std == pytest.approx(mass[:, body].std(), rel=0.05)
        stds = [change.std for change in link.center]
        assert stds == pytest.approx(list(center[:, body].std(axis=0)), rel=0.05)


def test_the_covariance_is_that_of_information_and_prior(
    robot: Robot, base: BaseParameters
) -> None:
    prior = inertial_prior(robot, standard_parameters(robot), 0.5)
    rng = np.random.default_rng(1)
    factor = np.linalg.qr(rng.normal(size=(90, base.rank + 2)), mode="r")  # one effect
    columns = np.zeros((len(factor) - 1, len(prior.mean) + 1))
    columns[:, :-1] = factor[:-1, : base.rank] @ base.mapping
    columns[:, -1] = factor[:-1, base.rank]
    information = columns.T @ columns + np.diag(np.append(1.0 / prior.std**2, 0.0))
    expected = np.linalg.inv(information)[:-1, :-1]
    found = inertial_covariance(factor, base, prior)
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


def test_the_table_shows_what_changed_and_counts_the_rest(with_tool: Identification) -> None:
    table, counted = link_parts(with_tool.fit.links)
    assert not isinstance(table, str)
    assert "tool" in {row[0] for row in table.rows}
    assert len(table.rows) < 5
    assert str(counted).startswith(f"{5 - len(table.rows)} other links of 5")
    assert table in identification_parts(with_tool)
    quiet = [replace(link, marks=(), mass=same(link), center=still(link)) for link in
             with_tool.fit.links]  # fmt: skip
    assert link_parts(quiet) == [
        "5 links of 5: mass and centre within two standard deviations of the URDF's."
    ]
    assert link_parts(()) == []


def same(link: LinkChange):  # type: ignore[no-untyped-def]
    return replace(link.mass, after=link.mass.before)


def still(link: LinkChange):  # type: ignore[no-untyped-def]
    return tuple(replace(change, after=change.before) for change in link.center)


def test_all_links_in_the_data(with_tool: Identification) -> None:
    answer = identification_answer(with_tool, {}).data
    assert answer["links"] == link_data(with_tool.fit.links)
    assert len(answer["links"]) == 5
    tool = answer["links"][-1]
    assert (tool["link"], tool["mass"]["before"]) == ("tool", pytest.approx(0.4))
    assert tool["mass"]["determined"] is True
    assert set(tool["center"]) == {"x", "y", "z"}
    assert len(tool["marks"]) == 1


def test_without_a_consistent_set_there_are_no_links(
    robot: Robot, base: BaseParameters, spec: Spec
) -> None:
    settings = SimulationSettings(rate=100.0, lead_in=0.5)
    data = simulate(robot, [motion(robot, 1), motion(robot, 2)], settings).dataset
    free = load_spec(SMOKE, [DECLARED, "identification.consistent=false"])
    assert identify(robot, base, data, free).fit.links == ()


def test_a_link_without_mass_has_its_centre_at_the_frame(robot: Robot) -> None:
    cad = standard_parameters(robot).copy()
    cad[10:20] = 0.0
    prior = InertialPrior(cad, np.full(len(cad), 0.1))
    link = link_changes(robot, cad, 0.01 * np.eye(len(cad)), prior)[1]
    assert (link.mass.before, [c.before for c in link.center]) == (0.0, [0.0, 0.0, 0.0])
    assert np.isfinite([c.std for c in link.center]).all()
