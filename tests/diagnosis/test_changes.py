"""Robots that are not the same in every run, in MuJoCo: what changed is named, and by how much.

Six short runs of the smoke arm, the last held out; a few kinds are looked for, to be quick.
"""

import re
from typing import Any

import pytest

from excite_cli.diagnosis.records import Diagnosis, NamedEffect
from excite_cli.diagnosis.words import changes_in_words
from excite_cli.effects.catalogue import EVERYDAY, EVERYDAY_FRICTION
from excite_cli.measurement.dataset import Dataset
from tests.diagnosis.simulated_arm import (
    ELBOW,
    PITCH,
    ROBOT,
    SLIDE,
    YAW,
    PlantedEffect,
    planted,
    played,
    told,
)

pytestmark = pytest.mark.long

RUNS = 6
KINDS = "viscous_friction,coulomb_friction,torque_offset,torque_gain,friction_change,payload"


def recorded(*effects: PlantedEffect, runs: int = RUNS, **settings: Any) -> Dataset:
    """With the same dry and viscous friction in all runs, and `effects`."""
    always = [
        planted("coulomb_friction", YAW, 3.0),
        planted("coulomb_friction", PITCH, 4.1),
        planted("viscous_friction", PITCH, 1.0),
        planted("coulomb_friction", ELBOW, 2.0),
    ]
    return played([*always, *effects], range(1, runs + 1), seconds=4.0, rate=100.0, **settings)


@pytest.fixture(scope="module")
def changing() -> Diagnosis:
    """Warm-up of one joint over an hour, an odd offset of another, an odd friction of a third."""
    span = (RUNS - 1) * 600.0
    effects = [
        planted("friction_change", PITCH, -0.9, time_constant=0.3 * span, span=span),
        planted("torque_offset", YAW, 1.5, 3),
        planted("coulomb_friction", ELBOW, -0.8, 2),
    ]
    return told(recorded(*effects, pause=600.0), KINDS)


def what(found: Diagnosis) -> set[tuple[str, str, tuple[str, ...]]]:
    return {(each.effect.kind, each.effect.joints[0], each.effect.runs) for each in found.effects}


ALWAYS = {
    ("coulomb_friction", "shoulder_yaw", ()),
    ("coulomb_friction", "shoulder_pitch", ()),
    ("viscous_friction", "shoulder_pitch", ()),
    ("coulomb_friction", "elbow", ()),
}


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
    # What changed is told with both values.
    told = changes_in_words(changing)
    (trend,) = [text for text in told if "over" in text]
    start, end = (float(word) for word in trend.split("from ")[1].split(" N·m")[0].split(" to "))
    assert trend.startswith("Coulomb friction of shoulder_pitch fell from ")
    assert trend.endswith(" min.")
    assert (start, end) == pytest.approx((4.1, 3.25), abs=0.1)
    assert "Coulomb friction of elbow: 1.2 instead of 2 N·m in r2." in told
    assert len(told) == 2
    # Ends of the odd runs are held out and judged. And of no other run: a trend is in all of them.
    found = [(part.runs, [e.kind for e in part.effects]) for part in changing.parts]
    assert found == [(("r2",), ["coulomb_friction"]), (("r3",), ["torque_offset"])]
    for part in changing.parts:
        assert part.after.mean_relative_moving < 0.2 * part.before.mean_relative_moving
    assert {(each.kind, each.joints, each.present) for each in changing.assumed} == {
        ("torque_offset", ("shoulder_yaw",), False),
        ("coulomb_friction", ("elbow",), False),
    }


def named(found: Diagnosis, kind: str, *runs: str) -> NamedEffect:
    (one,) = [e for e in found.effects if (e.effect.kind, e.effect.runs) == (kind, runs)]
    return one


def test_a_gain_from_some_run_on_is_that_of_these_runs() -> None:
    """Of all their torque, friction included; what the held-out run has is not guessed but told."""
    data = recorded(planted("torque_gain", PITCH, 0.08, 4, 5, 6))
    found = told(data, KINDS)
    assert what(found) == ALWAYS | {("torque_gain", "shoulder_pitch", ("r4", "r5"))}
    gain = named(found, "torque_gain", "r4", "r5").parameters["gain"]
    assert gain.value == pytest.approx(0.08, abs=0.003)
    assert [(each.runs, each.held_out) for each in found.assumed] == [(("r4", "r5"), ("r6",))]
    states = ", ".join(f"{run}: {{torque_gain: new}}" for run in ("r4", "r5", "r6"))
    declared = told(data, KINDS, f"runs={{{states}}}")
    assert what(declared) == ALWAYS | {("torque_gain", "shoulder_pitch", ("r4", "r5", "r6"))}
    assert declared.assumed == ()
    assert declared.after.mean_relative_moving < 0.7 * found.after.mean_relative_moving


def test_a_robot_that_stays_the_same_and_one_with_a_push() -> None:
    """Nothing changed; or a push, which no other second knows, nor does another recording."""
    found = told(recorded(), KINDS)
    assert (what(found), changes_in_words(found), found.parts) == (ALWAYS, [], ())
    # A push of a third of a second is found. No other second knows it, nor does another recording.
    push = planted("contact", tuple(range(ROBOT.n)), 20.0, 2, start=2.1, end=2.45)
    found = told(recorded(push), f"{KINDS},contact")
    pushes = [e.effect.runs for e in found.effects if e.effect.kind == "contact"]
    assert pushes == [("r2",)]
    assert {each for each in what(found) if each[0] != "contact"} == ALWAYS


def test_a_load_of_two_runs_in_three_stays_in_the_answer() -> None:
    """Each run without its own data, no other run says that it has the load."""
    found = told(recorded(planted("payload", SLIDE, 1.5, 1, 2), runs=4), KINDS)
    assert what(found) - ALWAYS == {("payload", "slide", ("r1", "r2"))}
    assert found.after.mean_relative_moving < 0.3 * found.before.mean_relative_moving


def test_what_two_recordings_differ_by_is_not_taken_for_something_else() -> None:
    """Both get one value, and no waves and offsets in its place."""
    data = recorded(planted("torque_gain", PITCH, 0.1, 1), runs=3)
    found = told(data, f"{KINDS},ripple,spring,position_friction")
    beyond = {kind for kind, _, _ in what(found)} - {*EVERYDAY, *EVERYDAY_FRICTION}
    assert beyond == {"torque_gain"}
    (difference,) = [each.text for each in found.findings if each.kind == "runs_differ"]
    assert re.search(r"torque_gain of shoulder_pitch by [+-]0\.(09|1)", difference)
