"""What people and scripts see of a diagnosis: names apart from approximations."""

from dataclasses import replace
from typing import Any

import pytest

from excite_cli.diagnosis.covariate import Covariate
from excite_cli.diagnosis.records import (
    Approximation,
    Assumption,
    ConfoundedCandidate,
    Diagnosis,
    EffectRecord,
    ErrorReduction,
    HeldOutEnds,
    JointAlias,
)
from excite_cli.diagnosis.verdict import HeldOutVerdict
from excite_cli.effects.base import Value
from excite_cli.shown.answer import Table
from excite_cli.summary.diagnosis import diagnosis_answer
from tests.diagnosis.synthetic_diagnosis import make_diagnosis

REASON = "a function of v[elbow]"


@pytest.fixture(scope="module")
def doubted() -> Diagnosis:
    """The one effect that was found is only an approximation."""
    found = make_diagnosis(rivals=())
    first = replace(found.effects[0], approximates=Approximation((Covariate("speed", "elbow"),)))
    processing = {
        "samples": 10, "rate": 20.0, "position_cutoff": 8.0, "candidates": 3, "inflation": 1.0,
    }  # fmt: skip
    return replace(found, effects=(first, *found.effects[1:]), processing=processing)


def test_an_approximation_is_no_name_for_scripts(doubted: Diagnosis) -> None:
    answer = diagnosis_answer(doubted, "arm.yaml", {}).data
    assert answer["effects"] == []
    (told,) = answer["approximations"]
    assert (told["kind"], told["stands_for"]) == ("viscous_friction", REASON)


def test_an_approximation_has_a_table_of_its_own(doubted: Diagnosis) -> None:
    text = printed(doubted)
    assert "Surrogate terms (they approximate an effect that has no name)" in text
    assert REASON in text
    assert "What the declared model lacks" not in text
    assert "0 effects, 1 surrogate term" in text


def test_approximations_that_are_not_confirmed_are_one_line(doubted: Diagnosis) -> None:
    first = replace(doubted.effects[0], verdict=HeldOutVerdict.NOT_CONFIRMED)
    found = replace(doubted, effects=(first, *doubted.effects[1:]))
    text = printed(found)
    assert "Surrogate terms that are not confirmed: viscous friction on elbow (--verbose" in text
    assert "Surrogate terms (" not in text  # no table
    harmful = replace(first, verdict=HeldOutVerdict.HARMFUL)
    told = printed(replace(found, effects=(harmful, *found.effects[1:])))
    assert "viscous friction on elbow (harmful) (--verbose" in told
    tables = [p for p in diagnosis_answer(found, "", {}, True).parts if isinstance(p, Table)]
    assert any(table.title.startswith("Surrogate terms") for table in tables)


def printed(found: Diagnosis) -> str:
    """Titles, columns and cells, a line each row, without a terminal."""
    lines: list[str] = []
    for part in diagnosis_answer(found, "arm.yaml", {}).parts:
        if isinstance(part, Table):
            lines += [part.title, " ".join(part.columns), *(" ".join(row) for row in part.rows)]
        else:
            lines.append(part if isinstance(part, str) else part.line)
    return "\n".join(lines)


def test_other_names_of_the_same_torque_are_told() -> None:
    found = make_diagnosis(rivals=())
    (named, *others) = found.effects
    effect = replace(named.effect, kind="asymmetric_friction")
    text = printed(replace(found, effects=(replace(named, effect=effect), *others)))
    assert "produces the same torque as Coulomb friction and offset of the measured torque" in text
    assert "the same torque" not in printed(found)


def test_the_noise_floor_stands_beside_the_errors(doubted: Diagnosis) -> None:
    """All joints are left with 1 N·m; repeated periods show 0.8 N·m, at the elbow 0.25 N·m."""
    floor = {name: 0.25 if name == "elbow" else 0.8 for name in doubted.joint_names[:-1]}
    found = replace(doubted, noise_floor=floor)
    text = printed(found)
    assert "repeatability" in text
    assert "1.2 times the noise of repeated periods (elbow 4.0 times)" in text
    rows = text.partition("Error of the torque")[2].splitlines()
    unknown = next(line for line in rows if line.startswith(doubted.joint_names[-1]))
    assert unknown.split()[-1] == "-"
    assert diagnosis_answer(found, "arm.yaml", {}).data["noise_floor"] == floor


def test_without_repeated_periods_nothing_is_said_of_noise(doubted: Diagnosis) -> None:
    assert "noise" not in printed(replace(doubted, excess_residuals=()))


def test_pairs_that_cannot_be_told_from_one_effect() -> None:
    one, other, pair = (EffectRecord(kind, ("elbow",)) for kind in ("spring", "armature", "ripple"))
    found = replace(make_diagnosis(), joint_aliases=(JointAlias((one,), (other, pair)),))
    told = (
        "Spring at the joint on elbow is indistinguishable from: inertia of the motor (armature) "
        "on elbow + ripple over the angle on elbow"
    )
    assert told in " ".join(printed(found).split())
    data = diagnosis_answer(found, "arm.yaml", {}).data["joint_aliases"]
    assert data == [
        {
            "named": [{"kind": "spring", "joints": ["elbow"]}],
            "others": [{"kind": kind, "joints": ["elbow"]} for kind in ("armature", "ripple")],
            "same_torque": False,
        }
    ]


def test_another_name_of_the_same_torque_is_told_as_such() -> None:
    parts = [EffectRecord(kind, ("elbow",)) for kind in ("torque_offset", "coulomb_friction")]
    other = EffectRecord("asymmetric_friction", ("elbow",))
    alias = JointAlias(tuple(parts), (other,))
    found = replace(make_diagnosis(), joint_aliases=(alias,))
    told = (
        "Coulomb friction on elbow produce the same torque as direction-dependent friction on "
        "elbow: no motion distinguishes them"
    )
    assert told in " ".join(printed(found).split())
    (data,) = diagnosis_answer(found, "arm.yaml", {}).data["joint_aliases"]
    assert data["same_torque"]
    assert JointAlias((other,), tuple(parts)).same_torque
    assert not JointAlias((parts[0],), (other,)).same_torque


def test_nothing_is_missing_only_where_nothing_large_is_left(doubted: Diagnosis) -> None:
    (rest,) = doubted.excess_residuals
    bare = replace(doubted, effects=(), excess_residuals=())
    assert "Nothing is missing" in printed(bare)
    for left, whole in ((rest, False), (replace(rest, certain=False), True)):
        text = printed(replace(bare, excess_residuals=(left,)))
        assert ("Nothing is missing" in text) == whole
        assert "0.8" in text
        assert "elbow" in text
    assert "q[elbow] and load[elbow]" in printed(replace(bare, excess_residuals=(rest,)))
    alone = replace(rest, depends_on=(), predictable=0.0, certain=False, noise=None)
    assert "Residual beside unknown noise: elbow" in printed(
        replace(bare, excess_residuals=(alone,))
    )
    assert "coloured noise could be as large" in printed(
        replace(bare, excess_residuals=(replace(alone, noise=0.1),))
    )
    assert diagnosis_answer(doubted, "arm.yaml", {}).data["noise_floor"] is None


@pytest.fixture(scope="module")
def bad() -> Diagnosis:
    """What was found makes the held-out error larger; its one effect is harmful, and small."""
    found = make_diagnosis(rivals=())
    (named,) = found.effects
    harmful = replace(
        named,
        share_of_residual=1e-5,
        gain=0.01,
        verdict=HeldOutVerdict.HARMFUL,
        removes={
            "elbow": ErrorReduction(-0.3, -0.4, -2.0),
            "slide": ErrorReduction(0.01, 0.02, 0.1),
        },
    )
    other = replace(named, share_of_residual=1e-4, gain=0.01, verdict=HeldOutVerdict.NOT_CONFIRMED)
    after = replace(found.after, mean_relative=0.435, samples=dict.fromkeys(found.joint_names, 80))
    return replace(
        found,
        effects=(harmful, other, other),
        before=replace(found.before, mean_relative=0.092),
        after=after,
        untouched=replace(found.after, mean_relative=0.5, mean_relative_moving=0.61),
    )


def test_a_held_out_error_that_did_not_fall_is_told_first(bad: Diagnosis) -> None:
    answer = diagnosis_answer(bad, "arm.yaml", {})
    assert not answer.good
    assert answer.parts[0] == (
        "The held-out error did not fall: 9.20% before, 43.50% after (mean over joints, all "
        "samples of run_3). Harmful: viscous_friction on elbow."
    )
    assert list(answer.data)[:2] == ["good", "reason"]
    assert (answer.data["good"], answer.data["reason"]) == (False, answer.parts[0])


def test_without_a_harmful_effect_those_not_confirmed_are_told(bad: Diagnosis) -> None:
    (first, *_) = diagnosis_answer(replace(bad, effects=bad.effects[1:2]), "arm.yaml", {}).parts
    assert "No effect is significantly harmful; not confirmed: viscous_friction on elbow." in str(
        first
    )


@pytest.mark.parametrize("change", [{"effects": ()}, {"after": None}])
def test_nothing_missing_or_an_error_that_fell_is_a_good_answer(
    bad: Diagnosis, change: dict[str, Any]
) -> None:
    if "after" in change:
        change = {"after": replace(bad.after, mean_relative=0.0919)}
    answer = diagnosis_answer(replace(bad, **change), "arm.yaml", {})
    assert answer.good
    assert "did not fall" not in str(answer.parts)
    assert (answer.data["good"], answer.data["reason"]) == (True, "")


def test_every_effect_shows_what_it_is_worth_on_held_out_data(
    bad: Diagnosis, doubted: Diagnosis
) -> None:
    """In percentage points where it is most; a harmful effect is never too small to be shown."""
    text = printed(bad)
    assert "harmful, -40.00 pp\n" in text
    assert "small effects" not in text  # of an error that did not fall, nothing is
    tiny = dict.fromkeys(bad.joint_names, 1e-4)
    folded = [*bad.effects[:1], *(replace(each, parts=tiny) for each in bad.effects[1:])]
    fell = replace(bad, before=replace(bad.before, mean_relative_moving=0.5), effects=tuple(folded))
    text = printed(replace(fell, after=replace(fell.after, mean_relative_moving=0.1)))
    assert "2 small effects (each below 1% of the error reduction)" in text
    assert "viscous friction on elbow (not confirmed)" in text
    assert "harmful, -40.00 pp\n" in text  # whatever it takes off
    elsewhere = replace(bad.effects[0], removes={"slide": ErrorReduction(0.01, 0.02, 0.1)})
    assert "harmful, +2.00 pp on slide\n" in printed(replace(bad, effects=(elsewhere,)))
    assert "confirmed, +6.00 pp a function of v[elbow]" in printed(doubted)
    older = replace(bad.effects[0], verdict=None, removes={})
    assert " pp" not in printed(replace(bad, effects=(older,)))


def test_scripts_see_verdicts_and_the_untouched_urdf(bad: Diagnosis) -> None:
    data = diagnosis_answer(bad, "arm.yaml", {}).data
    effect = data["effects"][0]
    assert effect["verdict"] == "harmful"
    assert effect["removes"]["elbow"] == {"relative": -0.3, "relative_moving": -0.4, "rms": -2.0}
    assert data["error"]["untouched"]["mean_relative"] == 0.5
    assert data["error"]["samples"]["elbow"] == 80
    assert "joint URDF declared" in printed(bad)
    assert "61.00%" in printed(bad)
    unknown = replace(bad, untouched=None)
    assert diagnosis_answer(unknown, "arm.yaml", {}).data["error"]["untouched"] is None
    assert "URDF" not in printed(unknown)


def of_single_runs(found: Diagnosis, after: float, end: float) -> Diagnosis:
    """A payload of run_1 alone: held-out error 20 % → `after`, of its held-out end 50 % → `end`."""
    effect = replace(found.effects[0].effect, kind="payload", runs=("run_1",))
    named = replace(found.effects[0], effect=effect, removes={})
    part = HeldOutEnds(
        ("run_1",),
        (effect,),
        replace(found.before, mean_relative=0.5),
        replace(found.after, mean_relative=end),
    )
    return replace(
        found,
        effects=(named,),
        assumed=(Assumption("payload", ("run_1",), ("run_3",), False, effect.joints),),
        parts=(part,),
        after=replace(found.after, mean_relative=after),
    )


@pytest.mark.parametrize(
    ("after", "end", "good"),
    [(0.2, 0.1, True), (0.203, 0.1, True), (0.25, 0.1, False), (0.2, 0.6, False)],
)
def test_what_is_not_in_the_held_out_run_is_judged_where_it_is(
    after: float, end: float, good: bool
) -> None:
    found = make_diagnosis()
    assert of_single_runs(found, after, end).good is good
    there = replace(of_single_runs(found, after, end), assumed=())
    assert not there.good


@pytest.fixture(scope="module")
def weighed() -> Diagnosis:
    """A gain that based on the known mass, beside a small effect that lowers the error."""
    found = make_diagnosis()
    gain = replace(
        found.effects[0],
        effect=EffectRecord("torque_gain", ("elbow",), {}, (0.04,)),
        parameters={"gain": Value(0.04, 0.001, "1")},
        verdict=HeldOutVerdict.WEIGHED,
        parts=dict.fromkeys(found.joint_names, -1e-5),
    )
    return replace(found, effects=(gain,), before=found.after)


def test_what_rests_on_a_weight_is_good_though_the_error_is_what_it_was(weighed: Diagnosis) -> None:
    assert weighed.good
    assert replace(weighed, before=replace(weighed.before, mean_relative=0.099)).good
    assert not replace(weighed, before=replace(weighed.before, mean_relative=0.08)).good
    vain = replace(weighed.effects[0], verdict=HeldOutVerdict.NOT_CONFIRMED)
    for effects in ((vain,), (*weighed.effects, vain)):  # what else is named must lower it
        assert not replace(weighed, effects=effects).good


def test_what_rests_on_a_weight_is_told_so_and_never_small(weighed: Diagnosis) -> None:
    (gain,) = weighed.effects
    small = replace(gain, verdict=HeldOutVerdict.CONFIRMED)
    begin = replace(weighed.before, mean_relative=0.5, mean_relative_moving=0.5)
    text = printed(replace(weighed, effects=(gain, small, small), before=begin))
    assert "2 small effects" in text
    assert "- based on the known mass" not in text.split("small effects")[1]
    assert (
        "Wrong gain of the measured torque on elbow is based on the known mass "
        "(identification.total_mass, identification.known_payload): other inertias would predict "
        "as well without it"
    ) in text
    assert text.count("held-out data cannot test this effect") == 1


def test_what_inertias_take_up_is_told_with_what_settles_it(weighed: Diagnosis) -> None:
    kinds = ("torque_gain", "armature", "torque_gain", "wrench_gain", "kind_of_a_package")
    absorbed = tuple(ConfoundedCandidate(kind, ("elbow",), ("Izz[elbow]",), 0.0) for kind in kinds)
    text = printed(replace(weighed, effects=(), absorbed=absorbed))
    told = [line for line in text.splitlines() if " becomes identifiable if " in line]
    assert [line.split(" of ")[0] for line in told] == ["Wrong gain", "Wrong scale"]
    assert "identification.known_payload" in told[0]
    assert "identification.total_mass" in told[1]
    assert " becomes identifiable if " not in printed(
        replace(weighed, absorbed=absorbed)
    )  # weighed already
