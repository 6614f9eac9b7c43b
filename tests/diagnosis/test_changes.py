"""Robots that are not the same in every run, in MuJoCo: what changed is named, and by how much.

Six short runs of the smoke arm, the last held out; a few kinds are looked for, to be quick.
"""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from excite_cli.config.load import load_spec
from excite_cli.config.spec import Spec
from excite_cli.diagnosis.diagnose import diagnose
from excite_cli.diagnosis.records import Diagnosis, NamedEffect
from excite_cli.diagnosis.words import changes_in_words
from excite_cli.dynamics.base_parameters import BaseParameters, find_base_parameters
from excite_cli.effects.catalogue import EVERYDAY, EVERYDAY_FRICTION, kind_named
from excite_cli.measurement.dataset import Dataset
from excite_cli.robot.model import Robot, build_robot
from tests.cli.program import SMOKE

pytest.importorskip("mujoco")

from excite_cli.simulation.ground_truth import Planted, plant
from excite_cli.simulation.planned_motion import PlannedMotion
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate
from excite_cli.trajectory.fourier import FourierTrajectory

SECONDS, RATE, RUNS = 4.0, 100.0, 6
YAW, PITCH, ELBOW, _, SLIDE = range(5)
KINDS = "[viscous_friction,coulomb_friction,torque_offset,torque_gain,friction_change,payload]"


@pytest.fixture(scope="module")
def spec() -> Spec:
    return load_spec(SMOKE, [f"diagnosis.kinds={KINDS}"])


@pytest.fixture(scope="module")
def robot(spec: Spec) -> Robot:
    return build_robot(spec.robot, SMOKE.parent)


@pytest.fixture(scope="module")
def base(robot: Robot) -> BaseParameters:
    return find_base_parameters(robot)


def motion(robot: Robot, number: int) -> PlannedMotion:
    rng = np.random.default_rng(number)
    trajectory = FourierTrajectory(4, 2 * np.pi / SECONDS)
    lower, upper = robot.limits.ranges()
    coefficients = rng.normal(size=(trajectory.n_coefficients, robot.n)) * 0.04 * (upper - lower)
    coefficients[-1] = (lower + upper) / 2
    return PlannedMotion(f"r{number}", trajectory, coefficients)


def planted(kind: str, joint: int, value: float, *runs: int, **others: float) -> Planted:
    one = plant(kind_named(kind), (joint,), value, others)
    return replace(one, effect=replace(one.effect, runs=tuple(f"r{k}" for k in runs)))


def measured(
    robot: Robot, effects: Sequence[Planted], pause: float = 0.0, runs: int = RUNS
) -> Dataset:
    """With the same dry and viscous friction in all runs, and `effects`."""
    always = [
        planted("coulomb_friction", YAW, 3.0),
        planted("coulomb_friction", PITCH, 4.1),
        planted("viscous_friction", PITCH, 1.0),
        planted("coulomb_friction", ELBOW, 2.0),
    ]
    motions = [motion(robot, number) for number in range(1, runs + 1)]
    settings = SimulationSettings(rate=RATE, lead_in=0.5, pause=pause)
    return simulate(robot, motions, settings, [*always, *effects]).dataset


def what(found: Diagnosis) -> set[tuple[str, str, tuple[str, ...]]]:
    return {(each.effect.kind, each.effect.joints[0], each.effect.runs) for each in found.effects}


def named(found: Diagnosis, kind: str, *runs: str) -> NamedEffect:
    (one,) = [e for e in found.effects if (e.effect.kind, e.effect.runs) == (kind, runs)]
    return one


ALWAYS = {
    ("coulomb_friction", "shoulder_yaw", ()),
    ("coulomb_friction", "shoulder_pitch", ()),
    ("viscous_friction", "shoulder_pitch", ()),
    ("coulomb_friction", "elbow", ()),
}


@pytest.fixture(scope="module")
def changing(robot: Robot, base: BaseParameters, spec: Spec) -> Diagnosis:
    """Warm-up of one joint over an hour, an odd offset of another, an odd friction of a third."""
    span = (RUNS - 1) * 600.0
    warm = {"time_constant": 0.3 * span, "span": span}
    effects = [
        planted("friction_change", PITCH, -0.9, **warm),
        planted("torque_offset", YAW, 1.5, 3),
        planted("coulomb_friction", ELBOW, -0.8, 2),
    ]
    return diagnose(robot, base, measured(robot, effects, pause=600.0), spec)


def test_a_trend_and_two_odd_runs_are_told_apart(changing: Diagnosis) -> None:
    assert what(changing) == ALWAYS | {
        ("friction_change", "shoulder_pitch", ()),
        ("torque_offset", "shoulder_yaw", ("r3",)),
        ("coulomb_friction", "elbow", ("r2",)),
    }
    offset = named(changing, "torque_offset", "r3").parameters["offset"]
    assert offset.value == pytest.approx(1.5, abs=max(3 * offset.std, 0.05))
    friction = named(changing, "coulomb_friction", "r2").parameters["coulomb"]
    assert friction.value == pytest.approx(-0.8, abs=max(3 * friction.std, 0.02))


def test_what_changed_is_told_with_both_values(changing: Diagnosis) -> None:
    told = changes_in_words(changing)
    (trend,) = [text for text in told if "over" in text]
    start, end = (float(word) for word in trend.split("from ")[1].split(" N·m")[0].split(" to "))
    assert trend.startswith("Coulomb friction of shoulder_pitch fell from ")
    assert trend.endswith(" min.")
    assert (start, end) == pytest.approx((4.1, 3.25), abs=0.1)
    assert "Coulomb friction of elbow: 1.2 instead of 2 N·m in r2." in told
    assert len(told) == 2


def test_ends_of_the_odd_runs_are_held_out_and_judged(changing: Diagnosis) -> None:
    """And of no other run: a trend is in all of them."""
    assert [part.runs for part in changing.parts] == [("r2",), ("r3",)]
    assert [[e.kind for e in part.effects] for part in changing.parts] == [
        ["coulomb_friction"], ["torque_offset"],
    ]  # fmt: skip
    for part in changing.parts:
        assert part.after.mean_relative_moving < 0.2 * part.before.mean_relative_moving
    assert {(each.kind, each.joints, each.present) for each in changing.assumed} == {
        ("torque_offset", ("shoulder_yaw",), False),
        ("coulomb_friction", ("elbow",), False),
    }


def test_a_gain_from_some_run_on_is_that_of_these_runs(
    robot: Robot, base: BaseParameters, spec: Spec
) -> None:
    """Of all their torque, friction included; what the held-out run has is not guessed but told."""
    data = measured(robot, [planted("torque_gain", PITCH, 0.08, 4, 5, 6)])
    found = diagnose(robot, base, data, spec)
    assert what(found) == ALWAYS | {("torque_gain", "shoulder_pitch", ("r4", "r5"))}
    gain = named(found, "torque_gain", "r4", "r5").parameters["gain"]
    assert gain.value == pytest.approx(0.08, abs=0.003)
    assert [(each.runs, each.held_out) for each in found.assumed] == [(("r4", "r5"), ("r6",))]
    states = {run: {"torque_gain": "new"} for run in ("r4", "r5", "r6")}
    told = diagnose(robot, base, data, spec.model_copy(update={"runs": states}))
    assert what(told) == ALWAYS | {("torque_gain", "shoulder_pitch", ("r4", "r5", "r6"))}
    assert told.assumed == ()
    assert told.after.mean_relative_moving < 0.7 * found.after.mean_relative_moving


def test_of_a_robot_that_stays_the_same_nothing_changed(
    robot: Robot, base: BaseParameters, spec: Spec
) -> None:
    found = diagnose(robot, base, measured(robot, []), spec)
    assert what(found) == ALWAYS
    assert changes_in_words(found) == []
    assert found.parts == ()


def test_a_push_of_a_third_of_a_second_is_found(
    robot: Robot, base: BaseParameters, spec: Spec
) -> None:
    """No other second knows it, nor does another recording."""
    push = plant(kind_named("contact"), (), 25.0, {"start": 2.1, "end": 2.45})
    push = replace(push, effect=replace(push.effect, runs=("r2",)))
    found = diagnose(robot, base, measured(robot, [push]), with_kinds(spec, "contact"))
    ((contact,), others) = (
        [e.effect for e in found.effects if (e.effect.kind == "contact") == wanted]
        for wanted in (True, False)
    )
    assert contact.runs == ("r2",)
    assert {(e.kind, e.joints[0], e.runs) for e in others} == ALWAYS


def test_a_load_of_two_runs_in_three_stays_in_the_answer(
    robot: Robot, base: BaseParameters, spec: Spec
) -> None:
    """Each run without its own data, no other run says that it has the load."""
    load = planted("payload", SLIDE, 1.5, 1, 2)
    found = diagnose(robot, base, measured(robot, [load], runs=4), spec)
    assert what(found) - ALWAYS == {("payload", "slide", ("r1", "r2"))}
    assert found.after.mean_relative_moving < 0.3 * found.before.mean_relative_moving


def test_what_two_recordings_differ_by_is_not_taken_for_something_else(
    robot: Robot, base: BaseParameters, spec: Spec
) -> None:
    """Both get one value, and no waves and offsets in its place."""
    data = measured(robot, [planted("torque_gain", PITCH, 0.1, 1)], runs=3)
    found = diagnose(robot, base, data, with_kinds(spec, "ripple", "spring", "position_friction"))
    beyond = {kind for kind, _, _ in what(found)} - {*EVERYDAY, *EVERYDAY_FRICTION}
    assert beyond == {"torque_gain"}
    (told,) = [each.text for each in found.findings if each.kind == "runs_differ"]
    assert re.search(r"torque_gain of shoulder_pitch by [+-]0\.(09|1)", told)


def with_kinds(spec: Spec, *kinds: str) -> Spec:
    """The same, and these kinds are looked for, too."""
    wider = spec.diagnosis.model_copy(update={"kinds": [*spec.diagnosis.kinds, *kinds]})
    return spec.model_copy(update={"diagnosis": wider})
