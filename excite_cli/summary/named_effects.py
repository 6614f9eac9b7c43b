"""Tables of the effects that a diagnosis named, and what each is indistinguishable from."""

from collections.abc import Sequence
from math import nan

from excite_cli.diagnosis.answer_words import FRICTION
from excite_cli.diagnosis.records import (
    Diagnosis,
    EffectRecord,
    FrictionLine,
    JointAlias,
    NamedEffect,
)
from excite_cli.diagnosis.verdict import HeldOutVerdict
from excite_cli.diagnosis.words import (
    SMALL_PART,
    approximation_in_words,
    by_worth,
    held_out_in_words,
    other_name_of,
    p_in_words,
    place_in_words,
    value_in_words,
    weighed_in_words,
)
from excite_cli.identification.fit_words import with_deviation
from excite_cli.shown.answer import Parts, Table
from excite_cli.summary.cells import points

# Viscous and Coulomb friction of every joint as data sheets give it: a table.


def friction_rows(found: Diagnosis) -> tuple[list[NamedEffect], set[tuple[str, str]]]:
    """Friction of several kinds on one joint as one effect; and kind and joint of what it is of.

    Terms of one curve are nearly collinear: what each is alone, nobody needs to know.
    """
    rows, own = [], set()
    for line in found.friction_lines:
        if line.verdict is not None:
            record = EffectRecord(FRICTION, (line.joint,), {}, ())
            sizes = {"Coulomb": line.coulomb, "viscous": line.viscous}
            rows.append(
                NamedEffect(
                    record,
                    sizes,
                    nan,
                    nan,
                    nan,
                    verdict=line.verdict,
                    removes=line.removes,
                    parts=line.parts,
                )
            )
            own |= {(kind, line.joint) for kind in line.kinds}
    return rows, own


def friction_table(lines: Sequence[FrictionLine]) -> Table:
    """The straight line through all friction of each joint; not the model's own terms."""
    rows = tuple(
        (
            line.joint,
            with_deviation(line.viscous.value, line.viscous.std),
            line.viscous.unit,
            with_deviation(line.coulomb.value, line.coulomb.std),
            line.coulomb.unit,
        )
        for line in lines
    )
    return Table(
        "Equivalent Coulomb and viscous friction of each joint (straight line, ± std)",
        ("joint", "viscous", "unit", "Coulomb", "unit"),
        rows,
        left=("joint", "unit"),
    )


_SIZE = "size ± std"
_WITHOUT_IT = "held-out, without it"


def effect_parts(found: Diagnosis, verbose: bool) -> Parts:
    """The named effects, small ones in one line, and what each is indistinguishable from."""
    everything = len(found.joint_names)
    curves, own = ([], set()) if verbose else friction_rows(found)
    named = [each for each in found.named if not _is_part(each, own)]
    shown, small = by_worth([*curves, *named], found)
    if verbose or len(small) < 2:  # a line about one is no shorter than the one
        shown, small = [*shown, *small], []
    parts: Parts = [effect_table(shown, everything, verbose)] if shown else []
    if small:
        listed = "; ".join(
            what_and_where(each.effect, everything)
            + f" ({each.verdict})" * (each.verdict is HeldOutVerdict.NOT_CONFIRMED)
            for each in small
        )
        parts.append(
            f"and {len(small)} small effects (each below {SMALL_PART:.0%} of the error reduction): "
            f"{listed} (--verbose: sizes)"
        )
    if found.harmful:
        parts.append(
            "Harmful effects stay in the model: held-out data judge it, and choose nothing in it."
        )
    parts += weighed_in_words(found)
    parts += [text for each in named for text in other_names(each, everything)]
    told = (
        each
        for each in found.joint_aliases
        if not own & {(one.kind, joint) for one in each.named for joint in one.joints}
    )
    return [*parts, *(_joint_alias(each, everything) for each in told)]


def _is_part(named: NamedEffect, own: set[tuple[str, str]]) -> bool:
    """Whether it is a part of some joint's friction; `own`: kinds and joints of these."""
    record = named.effect
    return not record.runs and len(record.joints) == 1 and (record.kind, record.joints[0]) in own


def effect_table(shown: Sequence[NamedEffect], everything: int, verbose: bool) -> Table:
    """Effects with their sizes and evidence; `everything`: how many joints the robot has."""
    rows = tuple(
        (
            named.effect.kind,
            place_in_words(named.effect, everything),
            "\n".join(value_in_words(name, value) for name, value in named.parameters.items()),
            *([p_in_words(named.p_value, named.least_p)] if verbose else []),
            points(named.error_reduction),
            held_out_in_words(named),
        )
        for named in shown
    )
    return Table(
        "What the declared model lacks (share: part of the fall of the mean error of all joints; "
        "the last column: verdict on held-out data, error of the most affected joint without it)",
        ("effect", "where", _SIZE, *(["p"] if verbose else []), "share", _WITHOUT_IT),
        rows,
        left=("effect",),
        words=("where", _SIZE, _WITHOUT_IT),
    )


def other_names(named: NamedEffect, everything: int) -> list[str]:
    """What it is indistinguishable from: by these data, and by any."""
    what, found = what_and_where(named.effect, everything), []
    if named.aliases:
        others = ", ".join(what_and_where(alias, everything) for alias in named.aliases)
        found.append(f"{what} is indistinguishable from: {others}")
    if same := other_name_of(named.effect.kind):
        found.append(f"{what} produces the same torque as {' and '.join(same)}")
    return found


def _joint_alias(alias: JointAlias, everything: int) -> str:
    named, others = (
        " + ".join(what_and_where(one, everything) for one in side)
        for side in (alias.named, alias.others)
    )
    single = len(alias.named) == 1
    if alias.same_torque:
        produce = "produces" if single else "produce"
        return f"{named} {produce} the same torque as {others}: no motion distinguishes them"
    return f"{named} {'is' if single else 'are'} indistinguishable from: {others}"


def what_and_where(record: EffectRecord, everything: int) -> str:
    """`spring on axis_2`."""
    return f"{record.kind} on {place_in_words(record, everything)}"


def approximation_parts(found: Diagnosis, verbose: bool) -> Parts:
    """Effects that lower the error but only come near what is there, and what that may be.

    Not those of friction that is told as one; what is not confirmed in one line.
    """
    own, everything = set() if verbose else friction_rows(found)[1], len(found.joint_names)
    every = [each for each in found.approximations if not _is_part(each, own)]
    shown = [each for each in every if verbose or each.verdict is HeldOutVerdict.CONFIRMED]
    parts: Parts = [_approximation_table(shown, everything)] if shown else []
    if others := [each for each in every if each not in shown]:
        listed = "; ".join(
            what_and_where(each.effect, everything)
            + f" ({each.verdict})" * (each.verdict is HeldOutVerdict.HARMFUL)
            for each in others
        )
        parts.append(f"Surrogate terms that are not confirmed: {listed} (--verbose: sizes)")
    return parts


def _approximation_table(shown: Sequence[NamedEffect], everything: int) -> Table:
    rows = tuple(
        (
            each.effect.kind,
            place_in_words(each.effect, everything),
            "\n".join(value_in_words(name, value) for name, value in each.parameters.items()),
            points(each.error_reduction),
            held_out_in_words(each),
            approximation_in_words(each.approximates) if each.approximates else "",
        )
        for each in shown
    )
    return Table(
        "Surrogate terms (they approximate an effect that has no name)",
        ("effect", "where", _SIZE, "share", _WITHOUT_IT, "true form"),
        rows,
        left=("effect",),
        words=("where", _SIZE, _WITHOUT_IT, "true form"),
    )
