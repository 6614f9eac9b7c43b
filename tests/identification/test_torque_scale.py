"""Gains of the drives, told by a payload of known mass; data from MuJoCo."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from excite_cli.config.data_spec import (
    IdentificationSpec,
    KnownPayloadSpec,
    MeasurementSpec,
    TotalMassSpec,
)
from excite_cli.config.load import load_spec, parse_spec
from excite_cli.config.spec import Spec
from excite_cli.diagnosis.diagnose import diagnose
from excite_cli.diagnosis.verdict import HeldOutVerdict
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import kind_named, scales
from excite_cli.errors import ConfigError
from excite_cli.identification.identify import Identification, identify
from excite_cli.identification.torque_scale import (
    assumed_scale,
    knowledge_of,
    known_body,
    weighed,
)
from excite_cli.measurement.dataset import Dataset
from excite_cli.robot.link_frame import link_frame
from excite_cli.robot.model import Robot, build_robot
from tests.cli.program import SMOKE

pytest.importorskip("mujoco")

from excite_cli.simulation.ground_truth import plant
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate
from tests.diagnosis.test_changes import motion

GAINS = (0.08, -0.07, 0.05, -0.09, 0.06)
MASS, WEIGHED, CENTRE = 1.7, 2.4, (0.02, -0.01, 0.07)
LOADED = """
effects:
  - {kind: viscous_friction}
  - {kind: coulomb_friction}
  - {kind: payload, joints: [slide], runs: [r3]}
"""
KNOWN = f"known_payload: {{runs: [r2], mass: {WEIGHED}, center: {list(CENTRE)}}}"


@pytest.fixture(scope="module")
def robot() -> Robot:
    return build_robot(load_spec(SMOKE).robot, SMOKE.parent)


@pytest.fixture(scope="module")
def data(robot: Robot) -> Dataset:
    """Unloaded, with the known payload, with an unknown one, unloaded."""
    effects = [
        *(plant(kind_named("torque_gain"), (j,), gain) for j, gain in enumerate(GAINS)),
        *(plant(kind_named("coulomb_friction"), (j,), 1.0) for j in range(robot.n)),
    ]
    for run, mass, (x, y, z) in (("r2", WEIGHED, CENTRE), ("r3", MASS, (0.0, 0.03, 0.05))):
        one = plant(kind_named("payload"), (robot.n - 1,), mass, {"cx": x, "cy": y, "cz": z})
        effects.append(replace(one, effect=replace(one.effect, runs=(run,))))
    motions = [motion(robot, number) for number in range(1, 5)]
    settings = SimulationSettings(rate=200.0, lead_in=0.5)
    return simulate(robot, motions, settings, effects).dataset


def spec_with(identification: str) -> Spec:
    return parse_spec(f"{SMOKE.read_text()}\n{LOADED}\nidentification: {{{identification}}}\n")


def identified(robot: Robot, data: Dataset, identification: str) -> Identification:
    return identify(robot, find_base_parameters(robot), data, spec_with(identification))


def index_of(found: Identification, kind: str, runs: tuple[str, ...] = ()) -> int:
    effects = list(found.fit.effects)
    return next(i for i, e in enumerate(effects) if e.kind == kind and e.runs == runs)


def test_a_known_payload_tells_every_gain(robot: Robot, data: Dataset) -> None:
    found = identified(robot, data, KNOWN)
    first = index_of(found, "torque_gain")
    for j, gain in enumerate(GAINS):
        assert found.fit.effects[first + j].joints == (j,)
        told = found.fit.effect_report(first + j)["gain"]
        assert told.value == pytest.approx(gain, abs=0.01)
        assert abs(told.value - gain) < 4.0 * told.std
    mass = found.fit.effect_report(index_of(found, "payload", ("r3",)))["mass"]
    assert mass.value == pytest.approx(MASS, rel=0.01)
    assert abs(mass.value - MASS) < 4.0 * mass.std < 0.05 * MASS
    assert found.fit.consistent is not None
    assert found.fit.consistent.solved
    consistent = found.fit.consistent_effect_values(index_of(found, "payload", ("r3",)))
    assert consistent[0] == pytest.approx(MASS, rel=0.02)


def test_without_one_every_deviation_holds_that_of_the_gains(robot: Robot, data: Dataset) -> None:
    found = identified(
        robot, replace(data, runs=tuple(r for r in data.runs if r.name != "r2")), "gain_std: 0.1"
    )
    mass = found.fit.effect_report(index_of(found, "payload", ("r3",)))["mass"]
    assert 0.1 * MASS < mass.std < 0.15 * MASS
    assert abs(mass.value - MASS) < 2.0 * mass.std
    free = identified(
        robot, replace(data, runs=tuple(r for r in data.runs if r.name != "r2")), "method: wls"
    )
    sure = free.fit.effect_report(index_of(free, "payload", ("r3",)))["mass"]
    assert abs(sure.value - MASS) > 4.0 * sure.std  # gains taken to be one: wrong, and sure of it


def test_a_diagnosis_finds_every_gain_by_it(robot: Robot, data: Dataset) -> None:
    """Each alone is at odds with the inertias: only all of them explain what the payload shows."""
    kinds = "diagnosis: {kinds: [torque_gain, torque_offset, payload]}\n"
    spec = parse_spec(f"{SMOKE.read_text()}\n{LOADED}\nidentification: {{{KNOWN}}}\n{kinds}")
    found = diagnose(robot, find_base_parameters(robot), data, spec)
    assert ("payload", ("r2",)) in {(e.kind, e.runs) for e in found.declared}
    told = {each.effect.joints: each for each in found.effects}
    assert [each.effect.kind for each in found.effects] == ["torque_gain"] * robot.n
    for name, gain in zip(robot.joint_names, GAINS, strict=True):
        value = told[(name,)].parameters["gain"]
        assert value.value == pytest.approx(gain, abs=0.01)
        assert abs(value.value - gain) < 4.0 * value.std
    assert {each.verdict for each in found.effects} == {HeldOutVerdict.WEIGHED}
    assert found.after.mean_relative < 0.4 * found.before.mean_relative


def test_ten_parameters_of_a_body_that_hangs_on_a_link(robot: Robot) -> None:
    """Against Pinocchio's inertias, moved from the link to the joint."""
    inertia = (0.02, 0.001, 0.03, -0.002, 0.003, 0.04)
    spec = KnownPayloadSpec(
        runs=("r2",), mass=2.0, center=(0.1, 0.2, -0.1), inertia=inertia, link="forearm"
    )
    effect, mean, covariance = known_body(spec, robot)
    frame = link_frame(robot, "forearm", "")
    assert effect.joints == (frame.joint,)
    xx, xy, yy, xz, yz, zz = inertia
    body = pin.Inertia(
        2.0, np.array(spec.center), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    )
    moved = pin.SE3(frame.rotation, frame.translation).act(body)
    assert mean == pytest.approx(moved.toDynamicParameters(), abs=1e-9)
    assert np.linalg.eigvalsh(covariance).min() > 0.0
    assert covariance[0, 0] == pytest.approx(4e-8, rel=1e-3)  # the least that is believed
    assert covariance[1, 1] == pytest.approx((2.0 * 0.003) ** 2, rel=0.01)


def test_gains_are_uncertain_together_and_each(robot: Robot) -> None:
    base = find_base_parameters(robot)
    known = knowledge_of(IdentificationSpec(gain_std=0.1), (), robot, base)
    assert [e.kind for e in known.effects] == ["torque_gain"] * robot.n
    assert not known.rows[:, : base.rank].any()
    rows = known.rows[:, base.rank :]
    assert np.linalg.inv(rows.T @ rows) == pytest.approx(0.01 * (np.eye(robot.n) + 1.0))
    assert not known.target.any()
    own: tuple[Effect, ...] = (kind_named("torque_gain")((2,)),)
    assert len(knowledge_of(IdentificationSpec(gain_std=0.1), own, robot, base).effects) == robot.n
    assert knowledge_of(IdentificationSpec(), own, robot, base).rows.shape == (0, base.rank + 1)


def test_what_is_known_is_of_the_parameters_of_their_effects(robot: Robot) -> None:
    """Deviations from the payload's ten are whitened, the other effects' and inertias are free."""
    spec = IdentificationSpec(known_payload=KnownPayloadSpec(runs=("r2",), mass=2.0, center=CENTRE))
    declared = (kind_named("spring")((0,)),)
    base = find_base_parameters(robot)
    found, more = (each(spec, declared, robot, base) for each in (weighed, knowledge_of))
    body, mean, covariance = known_body(spec.known_payload, robot)  # type: ignore[arg-type]
    assert found.effects == (*declared, body)
    assert more.effects == (*declared, body, *scales(robot))
    first = base.rank + 2
    assert not found.rows[:, :first].any()
    off = np.random.default_rng(1).normal(size=10) * np.sqrt(np.diag(covariance))
    missed = found.rows[:, first:] @ (mean + off) - found.target
    assert missed @ missed == pytest.approx(off @ np.linalg.solve(covariance, off), rel=1e-6)
    assert np.array_equal(more.rows[:10, : first + 10], found.rows)
    assert not more.rows[:10, first + 10 :].any()
    assert not more.rows[10:, : first + 10].any()
    same = weighed(spec, (body,), robot, base)  # declared already
    assert same.effects == (body,)
    assert same.rows[:, base.rank :] == pytest.approx(found.rows[:, first:])


def test_what_is_assumed_is_told() -> None:
    current, link = MeasurementSpec(torque="current"), MeasurementSpec()
    (note,) = assumed_scale(current, IdentificationSpec())
    assert "torque_constant and gear_ratio" in note.text
    assert "known_payload" in note.text
    assert note.severity == "note"
    assert not assumed_scale(link, IdentificationSpec())
    assert not assumed_scale(current, IdentificationSpec(gain_std=0.05))
    assert not assumed_scale(current, IdentificationSpec(total_mass=TotalMassSpec(mass=30.0)))


def test_the_run_with_the_known_payload_is_fitted_not_held_out(robot: Robot, data: Dataset) -> None:
    last = replace(data, runs=tuple(data.runs[k] for k in (2, 0, 3, 1)))
    found = identified(robot, last, KNOWN)
    assert found.held_out_run == "r4"
    gain = found.fit.effect_values(index_of(found, "torque_gain"))
    assert gain == pytest.approx(GAINS[:1], abs=0.02)
    spec, base = spec_with(KNOWN), find_base_parameters(robot)
    with pytest.raises(ConfigError, match=r"known_payload\.runs: 'r2' is held out.*-out 'r4'"):
        identify(robot, base, last, spec, held_out="r2")


def test_errors(robot: Robot, data: Dataset) -> None:
    with pytest.raises(ConfigError, match=r"known_payload.runs: there is no run 'r9'.*r1, r2"):
        identified(robot, data, "known_payload: {runs: [r9], mass: 2, center: [0, 0, 0]}")
    with pytest.raises(ConfigError, match=r"known_payload.link: the robot has no link 'tol'.*tool"):
        identified(
            robot, data, "known_payload: {runs: [r2], mass: 2, center: [0, 0, 0], link: tol}"
        )
    for inertia in ("[-1, 0, 1, 0, 0, 1]", "[0.01, 0.02, 0.01, 0, 0, 0.01]", "[1, 0, 1, 0, 0, 9]"):
        with pytest.raises(ConfigError, match=r"known_payload.inertia: no body has it"):
            identified(
                robot,
                data,
                f"known_payload: {{runs: [r2], mass: 2, center: [0, 0, 0], inertia: {inertia}}}",
            )
    with pytest.raises(ConfigError, match=r"known_payload.mass.*greater than 0"):
        spec_with("known_payload: {runs: [r2], mass: -2, center: [0, 0, 0]}")
