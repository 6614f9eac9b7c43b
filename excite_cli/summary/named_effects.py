"""What a diagnosis found: effects, what each is indistinguishable from, and what is absorbed."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import nan
from types import MappingProxyType

import numpy as np

from excite_cli.arrays import Array
from excite_cli.diagnosis.answer_words import FRICTION, beside_straight
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
    capitalised,
    changes_in_words,
    held_out_in_words,
    joints_in_words,
    other_name_of,
    p_in_words,
    place_in_words,
    settled_in_words,
    title_of,
    value_in_words,
    weighed_in_words,
)
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.identification.fit_words import with_deviation
from excite_cli.identification.link_changes import body_names
from excite_cli.robot.model import Robot
from excite_cli.shown.answer import Detail, Parts, Section, Table
from excite_cli.summary.cells import percent, points

# Viscous and Coulomb friction of every joint as data sheets give it: a table.


def friction_rows(found: Diagnosis) -> tuple[list[NamedEffect], set[tuple[str, str]]]:
    """Friction of several kinds on one joint as one effect; and kind and joint of what it is of.

    Terms of one curve are nearly collinear: what each is alone, nobody needs to know.
    """
    rows, own = [], set()
    for line in found.friction_lines:
        if line.verdict is not None:
            record = EffectRecord(FRICTION, (line.joint,), {}, ())
            like = "-equivalent" if line.curved else ""
            sizes = {f"Coulomb{like}": line.coulomb, f"viscous{like}": line.viscous}
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


_LACKING = (
    "What the declared model lacks (share: part of the fall of the mean error of all joints; "
    "the last column: verdict on held-out data, error of the most affected joint without it)"
)
_MOST_ABSORBED = 6  # rows that a page shows without being opened
_MOST_SURROGATES = 4
_MOST_BODIES = 8
_SAME_MASS, _SAME_CENTRE = 0.01, 1.0  # of the mass; mm: less is no change worth a row
_SURROGATES = "Surrogate terms (they approximate an effect that has no name)"


def found_section(found: Diagnosis, detail: Detail, robot: Robot | None = None) -> Section:
    """What was found, absorbed and approximated, and the sentences about them.

    With the `robot` also the bodies that are not as in its URDF.
    """
    parts: Parts = effect_parts(found, detail) if found.effects else []
    parts += approximation_parts(found, detail)
    curved = any(line.curved for line in found.friction_lines)
    parts += [friction_table(found.friction_lines)] if detail and curved else []
    parts += [*changes_in_words(found), *absorbed_parts(found)]
    parts += [] if robot is None else body_parts(robot, found.phi)
    declared = ", ".join(dict.fromkeys(title_of(record.kind) for record in found.declared))
    lead = f"Declared: {declared or 'no effect beside the rigid bodies'}."
    return Section("diagnosis-found", "What was found", tuple(parts), lead)


def body_parts(robot: Robot, phi: Array) -> Parts:
    """Bodies whose mass or centre of mass in φ (P,) is not the URDF's, before and after."""
    given, rows = standard_parameters(robot).reshape(-1, 10), []
    for body, (before, after) in enumerate(zip(given, phi.reshape(-1, 10), strict=True)):
        centres = [
            1e3 * each[1:4] / each[0] if each[0] else 1e3 * each[1:4] for each in (before, after)
        ]
        moved = float(np.abs(centres[1] - centres[0]).max())
        if abs(after[0] - before[0]) > _SAME_MASS * before[0] or moved > _SAME_CENTRE:
            was, now = (", ".join(f"{round(x)}" for x in each) for each in centres)
            row = {"link": body_names(robot, body)[0], "mass, URDF [kg]": f"{before[0]:.4g}"}
            row |= {"mass, model [kg]": f"{after[0]:.4g}", "centre x, y, z, URDF [mm]": was}
            rows.append(row | {"centre, model [mm]": now})
    if not rows:
        return ["Bodies: masses and centres of mass are those of the URDF."]
    note = (
        "Data determine sums over bodies; how these divide is the URDF's as far as possible. The "
        "standard deviations are in the answer of `excite identify` with the config of --apply."
    )
    title = f"Bodies of the model that are not as in the URDF ({len(rows)} of {len(given)})"
    return [Table.of(title, rows, left=("link",), note=note, folded=len(rows) > _MOST_BODIES)]


def effect_parts(found: Diagnosis, detail: Detail) -> Parts:
    """The named effects, small ones apart, and what each is indistinguishable from."""
    everything = len(found.joint_names)
    curves, own = ([], set()) if detail else friction_rows(found)
    named = [each for each in found.named if not _is_part(each, own)]
    shown, small = by_worth([*curves, *named], found)
    alone = detail == Detail.PAGE and not shown
    if detail == Detail.VERBOSE or alone or len(small) < 2:  # a line about one is as long
        shown, small = [*shown, *small], []
    kinds = {line.joint: line.kinds for line in found.friction_lines}
    parts: Parts = [effect_table(shown, everything, detail, kinds=kinds)] if shown else []
    title = f"{len(small)} small effects (each below {SMALL_PART:.0%} of the error reduction)"
    if small and detail:
        parts.append(replace(effect_table(small, everything, detail), title=title, folded=True))
    elif small:
        listed = "; ".join(
            what_and_where(each.effect, everything)
            + f" ({each.verdict})" * (each.verdict is HeldOutVerdict.NOT_CONFIRMED)
            for each in small
        )
        parts.append(f"and {title}: {listed} (--verbose: sizes)")
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
    return [*parts, *(joint_alias_in_words(each, everything) for each in told)]


def _is_part(named: NamedEffect, own: set[tuple[str, str]]) -> bool:
    """Whether it is a part of some joint's friction; `own`: kinds and joints of these."""
    record = named.effect
    return not record.runs and len(record.joints) == 1 and (record.kind, record.joints[0]) in own


def effect_table(
    shown: Sequence[NamedEffect],
    everything: int,
    detail: Detail,
    title: str = _LACKING,
    kinds: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> Table:
    """Effects with their sizes and evidence; `everything`: how many joints the robot has.

    Of what is only approximated, also what it may be. `kinds` of friction on each joint.
    """
    rows = []
    for named in shown:
        sizes = [value_in_words(name, value) for name, value in named.parameters.items()]
        if named.effect.kind == FRICTION:
            more = beside_straight(kinds[named.effect.joints[0]])
            sizes += [f"with {title_of(kind)}" for kind in more]
        row = {
            "effect": title_of(named.effect.kind),
            "where": place_in_words(named.effect, everything),
            "size ± std": "\n".join(sizes),
        }
        if detail:
            row["p"] = p_in_words(named.p_value, named.least_p)
            row["gain"] = percent(named.gain)
        row["share"] = points(named.error_reduction)
        row["held-out, without it"] = held_out_in_words(named)
        if named.approximates:
            row["true form"] = approximation_in_words(named.approximates)
        rows.append(row)
    words = ("where", "size ± std", "held-out, without it", "true form")
    return Table.of(title, rows, left=("effect",), words=words)


def other_names(named: NamedEffect, everything: int) -> list[str]:
    """What it is indistinguishable from: by these data, and by any."""
    what, found = what_and_where(named.effect, everything), []
    if named.aliases:
        others = ", ".join(what_and_where(alias, everything) for alias in named.aliases)
        found.append(f"{capitalised(what)} is indistinguishable from: {others}")
    if same := [title_of(kind) for kind in other_name_of(named.effect.kind)]:
        found.append(f"{capitalised(what)} produces the same torque as {' and '.join(same)}")
    return found


def joint_alias_in_words(alias: JointAlias, everything: int) -> str:
    """What a pair, or one beside a pair, is indistinguishable from."""
    named, others = (
        " + ".join(what_and_where(one, everything) for one in side)
        for side in (alias.named, alias.others)
    )
    single = len(alias.named) == 1
    if alias.same_torque:
        produce = "produces" if single else "produce"
        told = f"{produce} the same torque as {others}: no motion distinguishes them"
        return f"{capitalised(named)} {told}"
    return f"{capitalised(named)} {'is' if single else 'are'} indistinguishable from: {others}"


def what_and_where(record: EffectRecord, everything: int) -> str:
    """`spring on axis_2`."""
    return f"{title_of(record.kind)} on {place_in_words(record, everything)}"


def approximation_parts(found: Diagnosis, detail: Detail) -> Parts:
    """Effects that lower the error but only come near what is there, and what that may be.

    Not those of friction that is told as one; what is not confirmed in one line.
    """
    own, everything = set() if detail else friction_rows(found)[1], len(found.joint_names)
    every = [each for each in found.approximations if not _is_part(each, own)]
    shown = [each for each in every if detail or each.verdict is HeldOutVerdict.CONFIRMED]
    parts: Parts = []
    if shown:
        table = effect_table(shown, everything, detail, _SURROGATES)
        parts.append(replace(table, folded=len(shown) > _MOST_SURROGATES))
    if others := [each for each in every if each not in shown]:
        listed = "; ".join(
            what_and_where(each.effect, everything)
            + f" ({each.verdict})" * (each.verdict is HeldOutVerdict.HARMFUL)
            for each in others
        )
        parts.append(f"Surrogate terms that are not confirmed: {listed} (--verbose: sizes)")
    return parts


def absorbed_parts(found: Diagnosis) -> Parts:
    """Candidates that would show as other values of parameters: a table, if there are any."""
    if not found.absorbed:
        return []
    rows = (
        {
            "effect": title_of(each.kind),
            "where": joints_in_words(each.joints, len(found.joint_names)),
            "confounded with": ", ".join(each.by),
        }
        for each in found.absorbed
    )
    table = Table.of(
        "Not identifiable: confounded with parameters of the model",
        rows,
        left=("effect", "where"),
        words=("confounded with",),
        folded=len(found.absorbed) > _MOST_ABSORBED,
    )
    return [table, *settled_in_words(found)]
