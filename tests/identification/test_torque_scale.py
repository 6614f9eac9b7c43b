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
from excite_cli.config.load_spec import parse_spec
from excite_cli.config.spec import Spec
from excite_cli.diagnosis.diagnose import diagnose
from excite_cli.diagnosis.verdict import HeldOutVerdict
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
from tests.cli.program import SMOKE

pytest.importorskip("mujoco")

from tests.diagnosis.simulated_arm import BASE, ROBOT, SLIDE, planted, played

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
def data() -> Dataset:
    """Unloaded, with the known payload, with an unknown one, unloaded."""
    effects = [
        *(planted("torque_gain", j, gain) for j, gain in enumerate(GAINS)),
        *(planted("coulomb_friction", j, 1.0) for j in range(ROBOT.n)),
    ]
    for run, mass, centre in ((2, WEIGHED, CENTRE), (3, MASS, (0.0, 0.03, 0.05))):
        named = dict(zip(("cx", "cy", "cz"), centre, strict=True))
        effects.append(planted("payload", SLIDE, mass, run, **named))
    return played(effects, (1, 2, 3, 4), 4.0)


def spec_with(identification: str) -> Spec:
    return parse_spec(f"{SMOKE.read_text()}\n{LOADED}\nidentification: {{{identification}}}\n")


def identified(data: Dataset, identification: str) -> Identification:
    return identify(ROBOT, BASE, data, spec_with(identification))


def index_of(found: Identification, kind: str, runs: tuple[str, ...] = ()) -> int:
    effects = list(found.fit.effects)
    return next(i for i, e in enumerate(effects) if e.kind == kind and e.runs == runs)


def test_a_known_payload_tells_every_gain(data: Dataset) -> None:
    found = identified(data, KNOWN)
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


def test_without_one_every_deviation_holds_that_of_the_gains(data: Dataset) -> None:
    unweighed = replace(data, runs=tuple(r for r in data.runs if r.name != "r2"))
    found = identified(unweighed, "gain_std: 0.1")
    mass = found.fit.effect_report(index_of(found, "payload", ("r3",)))["mass"]
    assert 0.1 * MASS < mass.std < 0.15 * MASS
    assert abs(mass.value - MASS) < 2.0 * mass.std
    free = identified(unweighed, "method: wls")
    sure = free.fit.effect_report(index_of(free, "payload", ("r3",)))["mass"]
    assert abs(sure.value - MASS) > 4.0 * sure.std  # gains taken to be one: wrong, and sure of it


@pytest.mark.long
def test_a_diagnosis_finds_every_gain_by_it(data: Dataset) -> None:
    """Each alone is at odds with the inertias: only all of them explain what the payload shows."""
    kinds = "diagnosis: {kinds: [torque_gain, torque_offset, payload]}\n"
    spec = parse_spec(f"{SMOKE.read_text()}\n{LOADED}\nidentification: {{{KNOWN}}}\n{kinds}")
    found = diagnose(ROBOT, BASE, data, spec)
    assert ("payload", ("r2",)) in {(e.kind, e.runs) for e in found.declared}
    told = {each.effect.joints: each for each in found.effects}
    assert [each.effect.kind for each in found.effects] == ["torque_gain"] * ROBOT.n
    for name, gain in zip(ROBOT.joint_names, GAINS, strict=True):
        value = told[(name,)].parameters["gain"]
        assert value.value == pytest.approx(gain, abs=0.01)
        assert abs(value.value - gain) < 4.0 * value.std
    assert {each.verdict for each in found.effects} == {HeldOutVerdict.WEIGHED}
    assert found.after.mean_relative < 0.4 * found.before.mean_relative


def test_ten_parameters_of_a_body_that_hangs_on_a_link() -> None:
    """Against Pinocchio's inertias, moved from the link to the joint."""
    inertia = (0.02, 0.001, 0.03, -0.002, 0.003, 0.04)
    spec = KnownPayloadSpec(
        runs=("r2",), mass=2.0, center=(0.1, 0.2, -0.1), inertia=inertia, link="forearm"
    )
    effect, mean, covariance = known_body(spec, ROBOT)
    frame = link_frame(ROBOT, "forearm", "")
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


def test_gains_are_uncertain_together_and_each() -> None:
    known = knowledge_of(IdentificationSpec(gain_std=0.1), (), ROBOT, BASE)
    assert [e.kind for e in known.effects] == ["torque_gain"] * ROBOT.n
    assert not known.rows[:, : BASE.rank].any()
    rows = known.rows[:, BASE.rank :]
    assert np.linalg.inv(rows.T @ rows) == pytest.approx(0.01 * (np.eye(ROBOT.n) + 1.0))
    assert not known.target.any()
    own: tuple[Effect, ...] = (kind_named("torque_gain")((2,)),)
    assert len(knowledge_of(IdentificationSpec(gain_std=0.1), own, ROBOT, BASE).effects) == ROBOT.n
    assert knowledge_of(IdentificationSpec(), own, ROBOT, BASE).rows.shape == (0, BASE.rank + 1)
    # What is assumed is told.
    current, link = MeasurementSpec(torque="current"), MeasurementSpec()
    (note,) = assumed_scale(current, IdentificationSpec())
    assert "torque_constant and gear_ratio" in note.text
    assert "known_payload" in note.text
    assert note.severity == "note"
    assert not assumed_scale(link, IdentificationSpec())
    assert not assumed_scale(current, IdentificationSpec(gain_std=0.05))
    assert not assumed_scale(current, IdentificationSpec(total_mass=TotalMassSpec(mass=30.0)))


def test_what_is_known_is_of_the_parameters_of_their_effects() -> None:
    """Deviations from the payload's ten are whitened, the other effects' and inertias are free."""
    spec = IdentificationSpec(known_payload=KnownPayloadSpec(runs=("r2",), mass=2.0, center=CENTRE))
    declared = (kind_named("spring")((0,)),)
    found, more = (each(spec, declared, ROBOT, BASE) for each in (weighed, knowledge_of))
    body, mean, covariance = known_body(spec.known_payload, ROBOT)  # type: ignore[arg-type]
    assert found.effects == (*declared, body)
    assert more.effects == (*declared, body, *scales(ROBOT))
    first = BASE.rank + 2
    assert not found.rows[:, :first].any()
    off = np.random.default_rng(1).normal(size=10) * np.sqrt(np.diag(covariance))
    missed = found.rows[:, first:] @ (mean + off) - found.target
    assert missed @ missed == pytest.approx(off @ np.linalg.solve(covariance, off), rel=1e-6)
    assert np.array_equal(more.rows[:10, : first + 10], found.rows)
    assert not more.rows[:10, first + 10 :].any()
    assert not more.rows[10:, : first + 10].any()
    same = weighed(spec, (body,), ROBOT, BASE)  # declared already
    assert same.effects == (body,)
    assert same.rows[:, BASE.rank :] == pytest.approx(found.rows[:, first:])


def test_the_run_with_the_known_payload_is_fitted_not_held_out(data: Dataset) -> None:
    last = replace(data, runs=tuple(data.runs[k] for k in (2, 0, 3, 1)))
    found = identified(last, KNOWN)
    assert found.held_out_run == "r4"
    gain = found.fit.effect_values(index_of(found, "torque_gain"))
    assert gain == pytest.approx(GAINS[:1], abs=0.02)
    with pytest.raises(ConfigError, match=r"known_payload\.runs: 'r2' is held out.*-out 'r4'"):
        identify(ROBOT, BASE, last, spec_with(KNOWN), held_out="r2")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("runs: [r9]", r"runs: there is no run 'r9'.*r1, r2"),
        ("link: tol", r"link: the robot has no link 'tol'.*tool"),
        ("inertia: [-1, 0, 1, 0, 0, 1]", "inertia: no body has it"),
        ("inertia: [0.01, 0.02, 0.01, 0, 0, 0.01]", "inertia: no body has it"),
        ("inertia: [1, 0, 1, 0, 0, 9]", "inertia: no body has it"),
        ("mass: -2", "mass.*greater than 0"),
    ],
)
def test_errors(data: Dataset, change: str, words: str) -> None:
    given = {"runs": "[r2]", "mass": "2", "center": "[0, 0, 0]"}
    given |= dict([change.split(": ")])
    keys = ", ".join(f"{name}: {value}" for name, value in given.items())
    with pytest.raises(ConfigError, match=rf"known_payload\.{words}"):
        identified(data, f"known_payload: {{{keys}}}")
