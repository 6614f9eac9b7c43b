"""A diagnosis in words, the same ones wherever it is reported."""

from collections.abc import Iterable, Iterator, Sequence

from excite_cli.diagnosis.covariate import Covariate, Source
from excite_cli.diagnosis.records import (
    Approximation,
    Assumption,
    Diagnosis,
    EffectRecord,
    ExcessResidual,
    HeldOutEnds,
    NamedEffect,
)
from excite_cli.diagnosis.verdict import HeldOutVerdict
from excite_cli.effects.base import Value
from excite_cli.effects.catalogue import catalogue
from excite_cli.effects.parameter import unit_of_slider
from excite_cli.identification.fit_words import with_deviation
from excite_cli.identification.torque_scale import KNOWN_LOAD, KNOWN_MASS
from excite_cli.robot.base_joints import BASE_JOINTS

# What changed, in words: the value before and after, not only their difference.

_SURE = 2.0  # standard deviations from which a change is told
_LONG = ((3600.0, "h"), (60.0, "min"), (1.0, "s"))


def changes_in_words(found: Diagnosis) -> list[str]:
    """A sentence for all that changed over the campaign, with a column, or in some runs."""
    return [text for named in found.named for text in _told(found, named)]


def _told(found: Diagnosis, named: NamedEffect) -> Iterator[str]:
    record = named.effect
    kind = catalogue().get(record.kind)
    if kind is None or not (kind.changes_of or (kind.changes_between_runs and record.runs)):
        return
    changed = kind.changes_of or (record.kind,)
    for parameter, of in zip(kind.parameters, changed, strict=False):
        change, start = named.parameters[parameter.name], _shared(found, of, record.joints)
        if abs(change.value) <= _SURE * change.std:
            continue
        what = f"{catalogue()[of].title} of {', '.join(record.joints)}"
        if record.covariate:
            yield what + _by_column(change, start, record.shape.get("reference"))
            continue
        if start is None:
            continue
        unit = catalogue()[of].parameters[0].unit
        unit = unit if change.unit == parameter.unit else unit_of_slider(unit)
        end = Value(start + change.value, change.std, unit)
        if kind.of_campaign:
            how = "fell" if abs(end.value) < abs(start) else "rose"
            over = _duration(record.shape["span"])
            yield f"{what} {how} from {start:.3g} to {end.value:.3g} {end.unit} over {over}."
        else:
            runs = ", ".join(record.runs)
            yield f"{what}: {end.value:.3g} instead of {start:.3g} {end.unit} in {runs}."


def _by_column(slope: Value, there: float | None, reference: float | None) -> str:
    """` falls by 0.021 N·m per unit of temp_j1; it is 1.3 at 35.2.`"""
    how = "falls" if slope.value < 0.0 else "rises"
    told = f" {how} by {abs(slope.value):.3g} {slope.unit}"
    known = there is not None and reference is not None
    return told + (f"; it is {there:.3g} at {reference:.4g}." if known else ".")


def _shared(found: Diagnosis, kind: str, joints: tuple[str, ...]) -> float | None:
    """What all runs have of a kind, found or declared."""
    for record in (*(each.effect for each in found.effects), *found.information.model):
        if (record.kind, record.joints, record.runs) == (kind, joints, ()) and record.values:
            return record.values[0]
    return None


def _duration(seconds: float) -> str:
    size, unit = next((each for each in _LONG if seconds >= 2.0 * each[0]), _LONG[-1])
    return f"{seconds / size:.3g} {unit}"


# Effects that take off less than this part of the fall of the error are told with few words.
SMALL_PART = 0.01
# A smaller predictable share of what is left is not worth a word.
_TELLING = 0.2
# What may be left, and why that is not sure: noise known, unknown, around reversals.
_PERHAPS = (
    (
        "Residual that may be noise",
        "above white noise, but coloured noise could be as large",
    ),
    (
        "Residual beside unknown noise",
        "the torque was filtered, or recorded below 50 Hz",
    ),
    ("Residual at velocity reversals", "samples at reversals are excluded from the fit (stiction)"),
)
_QUANTITIES: dict[Source, str] = {
    "time": "time",
    "run": "the run",
    "position": "angle",
    "speed": "speed",
    "acceleration": "acceleration",
    "load": "rigid-body torque",
    "covariate": "column",
}


def by_worth(
    effects: Iterable[NamedEffect], found: Diagnosis
) -> tuple[list[NamedEffect], list[NamedEffect]]:
    """Those that carry at least `SMALL_PART` of the fall of the error, and the small ones.

    In each list what takes most off first; of what that is not known, what explains most. What is
    harmful, of unknown part, or based on the known mass, is never small.
    """
    ranked = sorted(
        effects,
        key=lambda each: (-each.error_reduction if each.parts else 0.0, -each.share_of_residual),
    )
    least = SMALL_PART * max(found.fall, 0.0)

    def is_small(named: NamedEffect) -> bool:
        told = named.verdict in (HeldOutVerdict.HARMFUL, HeldOutVerdict.WEIGHED)
        return not told and abs(named.error_reduction) < least

    return [each for each in ranked if not is_small(each)], list(filter(is_small, ranked))


def title_of(kind: str) -> str:
    """What a kind of effect is, or its name if this program does not have it."""
    known = catalogue().get(kind)
    return known.title if known is not None else kind


def other_name_of(kind: str) -> tuple[str, ...]:
    """Kinds that together are the same torque as this one."""
    known = catalogue().get(kind)
    return known.same_as if known is not None else ()


def joints_in_words(joints: Sequence[str], count: int) -> str:
    """Names of joints, of `count` that there are."""
    if tuple(joints) == BASE_JOINTS:
        return "the base"
    return "all joints" if len(joints) == count > 2 else ", ".join(joints)


def place_in_words(record: EffectRecord, joints: int) -> str:
    """Where an effect is, on a robot with so many joints; with its column and runs, if any."""
    where = joints_in_words(record.joints, joints)
    if record.link:
        where = f"{where}, frame of {record.link}"
    if record.covariate:
        where = f"{where}, by {record.covariate}"
    return f"{where} ({', '.join(record.runs)})" if record.runs else where


def p_in_words(p: float, least: float) -> str:
    """A p-value; the `least` that placebos back is no more than a bound."""
    if p <= max(least, 1e-16):
        return f"< {max(least, 1e-16):.1g}"
    return f"{p:.1e}" if p < 1e-3 else f"{p:.2g}"


def value_in_words(name: str, value: Value) -> str:
    """A parameter with one standard deviation; those chosen from a grid have none."""
    unit = "" if value.unit == "1" else f" {value.unit}"
    return f"{name} {with_deviation(value.value, value.std)}{unit}"


def covariate_in_words(covariate: Covariate) -> str:
    """What a residual depends on: `angle of elbow`."""
    words = _QUANTITIES[covariate.quantity]
    if covariate.own:
        words = f"own {words}"
    elif covariate.quantity == "covariate":
        words = covariate.joint
    elif covariate.joint:
        words = f"{words} of {covariate.joint}"
    return f"history of {words}" if covariate.history else words


def approximation_in_words(found: Approximation) -> str:
    """What an effect only comes near."""
    if found.covariates:
        return f"a function of {', '.join(each.code for each in found.covariates)}"
    if not found.kind:
        return "explained only in part"
    return f"resembles {title_of(found.kind)}"


def rests_in_words(found: Diagnosis) -> tuple[list[str], list[str]]:
    """What is left beside the noise: sentences on what surely is more, and on what may be."""
    units = dict(zip(found.joint_names, found.torque_units, strict=True))
    more: list[str] = []
    perhaps: dict[tuple[str, str], list[str]] = {each: [] for each in _PERHAPS}
    for rest in found.excess_residuals:
        left = (
            f"{rest.joint} {rest.rms:.3g}{_unit(units[rest.joint])} RMS "
            f"({rest.share_of_torque:.1%} of its torque in the training data)"
        )
        if rest.certain:
            noise = (
                "" if rest.noise is None else f", noise {rest.noise:.3g}{_unit(units[rest.joint])}"
            )
            more.append(f"Residual above noise: {left}{noise}; {_predicted(rest)}.")
        else:
            why = 2 if rest.at_reversals else int(rest.noise is None)
            perhaps[_PERHAPS[why]].append(left)
    said = [f"{what}: {', '.join(left)}; {why}." for (what, why), left in perhaps.items() if left]
    return more, said


def _unit(unit: str) -> str:
    return f" {unit}" if unit else ""


def _predicted(rest: ExcessResidual) -> str:
    share = f"{rest.predictable:.0%} of its variance is predictable"
    if rest.depends_on:
        best = " and ".join(each.code for each in rest.depends_on)
        return f"{share}, best from {best}; no effect that was tried has this form"
    if rest.predictable > _TELLING:
        return f"{share}, but not from one or two quantities"
    return "no tested quantity predicts the residual"


def assumption_in_words(assumed: Assumption) -> str:
    """What was assumed of an effect of single runs, and what to do if it is wrong."""
    there = "present" if assumed.present else "absent"
    at = f" of {assumed.joints[0]}" if len(assumed.joints) == 1 else ""
    held_out = ", ".join(assumed.held_out)
    some = assumed.runs if len(assumed.runs) < 4 else (assumed.runs[0], "…")
    told = ", ".join(
        run if run == "…" else f"{run}: {{{assumed.kind}: a}}" for run in (*some, *assumed.held_out)
    )
    return (
        f"{assumed.kind}{at} in {', '.join(assumed.runs)}: taken to be {there} in the "
        f"held-out {held_out}. If it is there, declare one state for all of them: runs: {{{told}}}."
    )


def ends_in_words(part: HeldOutEnds) -> str:
    """The errors on the held-out ends of runs that carry effects of their own."""
    kinds = ", ".join(dict.fromkeys(effect.kind for effect in part.effects))
    return (
        f"The ends of {', '.join(part.runs)}{f' (with {kinds})' if kinds else ''} are held out "
        f"too: mean error there {part.before.mean_relative_moving:.2%} → "
        f"{part.after.mean_relative_moving:.2%} where joints move."
    )


def held_out_in_words(named: NamedEffect) -> str:
    """`confirmed, +4.78 pp`: the verdict on held-out data, and how the error changes without it.

    Percentage points of the relative error where the joint moves, of the joint where it changes
    most; that joint is named where the effect is not on it alone.
    """
    if named.verdict is None:
        return ""
    moved = {joint: each.relative_moving for joint, each in named.removes.items()}
    moved = {joint: each for joint, each in moved.items() if each == each}
    if not moved:
        return named.verdict
    joint = max(moved, key=lambda name: abs(moved[name]))
    where = "" if named.effect.joints == (joint,) else f" on {joint}"
    return f"{named.verdict}, {100 * moved[joint]:+.2f} pp{where}"


def settled_in_words(found: Diagnosis) -> list[str]:
    """What a person may declare that tells sizes which inertias take up."""
    if weighed_in_words(found):
        return []  # and beside it, no other gain is told
    kinds = dict.fromkeys(each.kind for each in found.absorbed)
    known = [catalogue()[kind] for kind in kinds if kind in catalogue()]
    return [
        f"{capitalised(each.title)} becomes identifiable if {each.identified_by}."
        for each in known
        if each.identified_by
    ]


def capitalised(text: str) -> str:
    """A sentence that begins with this text; names within it stay as they are."""
    return text[:1].upper() + text[1:]


def weighed_in_words(found: Diagnosis) -> list[str]:
    """That held-out data are no test of what is based on the known mass."""
    return [
        f"{capitalised(title_of(each.effect.kind))} on "
        f"{place_in_words(each.effect, len(found.joint_names))} is based "
        f"on the known mass ({KNOWN_MASS}, {KNOWN_LOAD}): other inertias would predict as well "
        "without it, so held-out data cannot test this effect."
        for each in found.effects
        if each.verdict is HeldOutVerdict.WEIGHED
    ]


def no_gain_in_words(found: Diagnosis) -> str:
    """That the error on held-out data did not fall with what was found, and by what; empty if it
    did.

    To be said before anything else.
    """
    if found.good:
        return ""
    if found.fell:
        return _textbook_is_better(found)
    text = (
        f"The held-out error did not fall: {found.before.mean_relative:.2%} before, "
        f"{found.after.mean_relative:.2%} after (mean over joints, all samples of "
        f"{found.held_out_run})."
    )
    verdict = HeldOutVerdict.HARMFUL if found.harmful else HeldOutVerdict.NOT_CONFIRMED
    what = "Harmful" if found.harmful else "No effect is significantly harmful; not confirmed"
    guilty = [each.effect for each in found.effects if each.verdict is verdict]
    if guilty:
        joints = len(found.joint_names)
        listed = (f"{each.kind} on {place_in_words(each, joints)}" for each in guilty)
        text += f" {what}: {', '.join(listed)}."
    return f"{text} {_textbook_is_better(found)}" if found.worse_than_textbook else text


def _textbook_is_better(found: Diagnosis) -> str:
    """By how much, and what is in it."""
    assert found.textbook is not None
    kinds = dict.fromkeys(each.kind for each in found.textbook.effects)
    return (
        f"The textbook model predicts {found.held_out_run} better than the effects found: the "
        f"residual is {found.textbook.error.mean_relative_moving:.2%} of the torque with "
        f"{', '.join(kinds) or 'nothing added'} on every joint, "
        f"{found.after.mean_relative_moving:.2%} with the effects found (mean over joints, where "
        "they move)."
    )


def counted(count: int, what: str) -> str:
    """`1 effect`, `2 effects`."""
    return f"{count} {what}{'' if count == 1 else 's'}"
