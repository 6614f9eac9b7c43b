"""The answer in sentences is made of the records, and says what is largest first."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pytest

from excite_cli.diagnosis.answer_words import answer_in_words, shares
from excite_cli.diagnosis.covariate import Covariate
from excite_cli.diagnosis.records import (
    HELD_OUT_DIFFERS,
    Diagnosis,
    EffectRecord,
    FrictionLine,
    NamedEffect,
    Textbook,
)
from excite_cli.diagnosis.verdict import HeldOutVerdict
from excite_cli.effects.base import Value
from excite_cli.measurement.dataset import Finding
from tests.diagnosis.synthetic_diagnosis import make_diagnosis

SPRING = {"stiffness": Value(6912.0, 30.0, "N·m/rad"), "preload": Value(10.0, 1.0, "N·m")}
RUBS = {"coulomb": Value(2.0, 0.1, "N·m")}
PLAIN = make_diagnosis()


def effect(
    kind: str, joint: str, values: Mapping[str, Value], parts: Mapping[str, float]
) -> NamedEffect:
    record = EffectRecord(kind, (joint,), {}, tuple(v.value for v in values.values()))
    return NamedEffect(
        record, dict(values), 1e-9, 0.4, 0.2, verdict=HeldOutVerdict.CONFIRMED, parts=dict(parts)
    )


def found(
    *effects: NamedEffect, left: tuple[float, float] = (0.02, 0.1), **changes: Any
) -> Diagnosis:
    """Errors fall from 50 % to those `left` on the elbow and on the slide."""
    names = PLAIN.joint_names
    after = dict.fromkeys(names, left[0]) | {"slide": left[1]}
    mean = sum(after.values()) / len(names)
    before = replace(
        PLAIN.before, mean_relative=0.6, mean_relative_moving=0.5,
        relative_moving=dict.fromkeys(names, 0.5),
    )  # fmt: skip
    end = replace(PLAIN.after, mean_relative=mean, mean_relative_moving=mean, relative_moving=after)
    return replace(PLAIN, effects=effects, before=before, after=end, excess_residuals=(), **changes)


def everywhere(part: float) -> dict[str, float]:
    return dict.fromkeys(PLAIN.joint_names, part)


def test_friction_is_one_share_and_the_rest_is_told_by_place() -> None:
    line = FrictionLine("elbow", Value(3.0, 0.1, "N·m·s/rad"), Value(45.0, 0.1, "N·m"), curved=True)
    answer = found(
        effect("coulomb_friction", "elbow", RUBS, everywhere(0.2)),
        effect("coupled_friction", "elbow", RUBS, everywhere(0.1)),
        effect("spring", "shoulder_pitch", SPRING, everywhere(0.1)),
        effect("armature", "elbow", {"inertia": Value(0.1, 0.01, "kg·m²")}, everywhere(0.0)),
        friction_lines=(line,),
    )
    assert shares(answer) == pytest.approx({"friction": 0.75, "spring": 0.25, "armature": 0.0})
    fall = 0.5 - answer.after.mean_relative_moving
    assert answer_in_words(answer) == (
        "Friction, with friction of coupled gears, accounts for 75% of the error reduction, "
        "largest on elbow (48 N·m at 1 rad/s). "
        f"On shoulder_pitch: spring at the joint (6.9 kN·m/rad, {0.1 / fall:.0%} of the "
        "error reduction). Held-out error 3.6% of torque RMS (mean over joints, where they "
        "move), largest on slide (10%)."
    )


@pytest.mark.parametrize(
    ("fastest", "words"), [(0.15, "5.5 N·m at 0.1 rad/s"), (3.0, "-17 N·m at 1 rad/s")]
)
def test_friction_is_told_at_a_speed_that_the_data_have(fastest: float, words: str) -> None:
    """An arm that crept through its Stribeck curve: beyond, the line is negative."""
    line = FrictionLine(
        "elbow", Value(-25.0, 0.1, "N·m·s/rad"), Value(8.0, 0.1, "N·m"), curved=True
    )
    answer = found(
        effect("coulomb_friction", "elbow", RUBS, everywhere(0.2)),
        effect("viscous_friction", "elbow", RUBS, everywhere(0.1)),
        friction_lines=(replace(line, fastest=fastest),),
    )
    assert f"largest on elbow ({words})" in answer_in_words(answer)


def test_names_that_fit_as_well_are_to_be_told_apart_next() -> None:
    more, less = (
        effect("spring", joint, SPRING, everywhere(part))
        for joint, part in (("elbow", 0.3), ("slide", 0.1))
    )
    armature = EffectRecord("armature", ("elbow",), {}, (1.0,))
    drag = EffectRecord("nonlinear_viscous_friction", ("slide",), {}, (1.0,))
    told = answer_in_words(
        found(replace(less, aliases=(drag,)), replace(more, aliases=(armature,)))
    )
    assert told.endswith(
        " Next: a motion that distinguishes spring at the joint of elbow from inertia of the motor "
        "(armature)."
    )


def test_one_effect_is_told_by_its_name_and_the_rest_by_what_it_depends_on() -> None:
    answer = found(effect("load_dependent_friction", "elbow", RUBS, everywhere(0.4)))
    assert answer_in_words(answer).startswith(
        "Load-dependent friction of elbow (2 N·m) accounts for nearly all of the error reduction. "
    )
    # What stays is told with what it depends on.
    of = (Covariate("position", "elbow", True), Covariate("time"))
    rest = replace(PLAIN.excess_residuals[0], depends_on=of)
    answer = found(effect("coulomb_friction", "elbow", RUBS, everywhere(0.4)),
                   left=(0.1, 0.1))  # fmt: skip
    told = answer_in_words(replace(answer, excess_residuals=(rest,)))
    assert (
        "Held-out error 10% of torque RMS (mean over joints, where they move). The residual of "
        "elbow depends on history of angle of elbow and time."
    ) in told


def test_a_fit_of_kept_inertias_has_its_share() -> None:
    spring = effect("spring", "elbow", SPRING, everywhere(0.3))
    begin = found(spring)
    answer = replace(
        begin, untouched=begin.before, inertia_parts=everywhere(0.1)
    )  # fmt: skip
    assert shares(answer) == pytest.approx({"spring": 0.75, "inertias": 0.25})
    assert "Inertias that differ from the URDF account for 25%." in answer_in_words(answer)


def test_nothing_and_nothing_good() -> None:
    assert answer_in_words(found()).startswith("Nothing is missing: ")
    some = replace(found(), excess_residuals=PLAIN.excess_residuals)
    assert answer_in_words(some).startswith("No effect of the catalogue explains the residual")
    worse = found(effect("spring", "elbow", SPRING, everywhere(-0.1)), left=(0.7, 0.7))
    assert answer_in_words(worse).startswith("The held-out error did not fall: ")
    assert shares(worse) == {}
    # Files of earlier versions know no parts.
    assert shares(PLAIN) == {}
    assert answer_in_words(PLAIN).startswith("Your model lacks 1 small effect.")


def test_what_lowers_nothing_is_told_so_with_the_warnings() -> None:
    spring = effect("spring", "elbow", SPRING, everywhere(-0.01))
    vain = found(spring, left=(0.51, 0.51), findings=())
    assert answer_in_words(vain).startswith(
        "Adding 1 effect does not lower the error where joints move (50% before)."
    )
    assert answer_in_words(vain).endswith("Next: record another motion, or a longer one.")
    warned = replace(vain, findings=(Finding("lag", "warning", "speeds lag"),))
    told = "Next: resolve 1 warning about the data."
    assert answer_in_words(warned).endswith(told)
    carried = replace(spring, effect=replace(spring.effect, runs=("motion_1",)))
    assert "does not lower" not in answer_in_words(found(carried, left=(0.51, 0.51)))


def test_what_rests_on_a_weight_is_told_whatever_the_error_does() -> None:
    """And what no motion tells it from, if there is nothing for a motion to tell."""
    size = {"gain": Value(0.04, 0.001, "1")}
    offset = EffectRecord("torque_offset", ("slide",), {}, (1.0,))
    gain = replace(
        effect("torque_gain", "elbow", size, everywhere(-1e-3)),
        verdict=HeldOutVerdict.WEIGHED,
    )
    whole = found(gain)
    lower = whole.after.mean_relative_moving - 1e-4
    same = replace(whole, before=replace(whole.after, mean_relative_moving=lower))
    assert answer_in_words(same).startswith(
        "On elbow: wrong gain of the measured torque (0.04), given the known mass. Held-out error "
        "3.6% of"
    )
    assert "Next:" not in answer_in_words(same)
    rival = replace(gain, aliases=(offset,))
    told = answer_in_words(replace(same, effects=(rival,)))
    assert told.endswith(
        " Next: a run with a known load (identification.known_payload) distinguishes wrong "
        "gain of the measured torque of elbow from offset of the measured torque of slide; no "
        "motion does."
    )
    spring = replace(effect("spring", "elbow", SPRING, everywhere(0.1)), aliases=(offset,))
    first = replace(rival, parts=everywhere(0.2))
    told = answer_in_words(found(first, spring))
    assert " Next: a motion that distinguishes spring at the joint of elbow from offset" in told
    assert "given the known mass. On elbow: spring at the joint (6.9 kN·m/rad" in told


def test_a_joint_that_is_worse_than_with_textbook_friction_is_named() -> None:
    """A mean hides it; what differs by little, or of little, is none."""
    answer = found(effect("spring", "shoulder_pitch", SPRING, everywhere(0.1)))
    after = answer.after.relative_moving
    joint = next(name for name, each in after.items() if each > 0.01)
    usual = replace(answer.after, relative_moving={**after, joint: 0.5 * after[joint]})
    worse = answer_in_words(replace(answer, textbook=Textbook((), usual)))
    assert f"On {joint} this model is worse than textbook friction (" in worse
    close = replace(answer.after, relative_moving={**after, joint: 0.95 * after[joint]})
    assert "worse than" not in answer_in_words(replace(answer, textbook=Textbook((), close)))


def test_a_held_out_recording_that_differs_is_said_beside_its_error() -> None:
    answer = found(effect("spring", "shoulder_pitch", SPRING, everywhere(0.1)))
    told = replace(answer, findings=(Finding(HELD_OUT_DIFFERS, "warning", "r2 differs …"),))
    assert "differs from the training ones (warning: how)." in answer_in_words(told)
