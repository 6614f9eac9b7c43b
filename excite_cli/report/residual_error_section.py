"""Errors of the torque per joint, as dumbbells and as a table."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from excite_cli.identification.errors_of_torque import Errors
from excite_cli.identification.fit_words import above_the_floor
from excite_cli.report.chart import Chart
from excite_cli.report.page import Block, Charts, TableBlock, Text
from excite_cli.report.rows_chart import Axis, Bar, Mark, Row, rows_chart

# Errors per joint as dumbbells: two errors of each joint on one line, and what noise leaves.


@dataclass(frozen=True)
class Dumbbells:
    """Two values by joint, with the words for each; `floor` what no model can go below.

    `means` are drawn on a line of their own.
    """

    words: tuple[str, str]
    first: Mapping[str, float]
    second: Mapping[str, float]
    floor: Mapping[str, float] | None = None
    means: tuple[float, float] | None = None


def dumbbell_chart(title: str, axis: str, values: Dumbbells, alternative: str) -> Chart:
    """The chart, on a logarithmic axis; joints without a value are left out."""
    rows = []
    for joint, second in values.second.items():
        first, floor = values.first.get(joint, math.nan), (values.floor or {}).get(joint, math.nan)
        if _shown(first) and _shown(second):
            rows.append(_pair(joint, first, second, values.words, floor))
    if values.means is not None and all(map(_shown, values.means)):
        rows.append(_pair("mean", *values.means, values.words, math.nan))
    shown = [mark.x for row in rows for mark in row.marks] or [1.0]
    return rows_chart(title, alternative, Axis.logarithmic_about(axis, shown), rows)


def _shown(value: float) -> bool:
    return math.isfinite(value) and value > 0


def _pair(name: str, first: float, second: float, words: tuple[str, str], floor: float) -> Row:
    marks = [Mark(first, words[0], "muted", "ring"), Mark(second, words[1], "blue")]
    if _shown(floor):
        marks.append(Mark(floor, "noise floor", "green", "tick"))
    return Row(name, tuple(marks), (Bar(min(first, second), max(first, second), "muted"),))


def error_blocks(
    words: tuple[str, str],
    first: Errors,
    second: Errors,
    units: Mapping[str, str],
    floor: Mapping[str, float] | None,
    note: str,
) -> tuple[Block, ...]:
    """Two errors of every joint beside each other; `words` name them, `units` those of torque.

    `floor` is the RMS that repeated periods differ by.
    """
    moving = any(map(math.isfinite, second.relative_moving.values()))
    charts = [_relative(words, first, second)] if moving else []
    charts += [
        _rms(words, first, second, unit, units, floor) for unit in dict.fromkeys(units.values())
    ]
    blocks: list[Block] = [Charts(tuple(charts))]
    if not moving:
        blocks.append(Text("No joint moves in the held-out data: there is no error while moving."))
    above = above_the_floor(second, floor)
    if above:
        blocks.append(Text(above))
    blocks.append(_table(words, first, second, units, floor, note))
    return tuple(blocks)


def _relative(words: tuple[str, str], first: Errors, second: Errors) -> Chart:
    values = Dumbbells(
        words,
        _percent(first.relative_moving),
        _percent(second.relative_moving),
        means=(100 * first.mean_relative_moving, 100 * second.mean_relative_moving),
    )
    known = [x for x in second.relative_moving.values() if math.isfinite(x)]
    span = f"; joints from {min(known):.1%} to {max(known):.1%} {words[1]}" if known else ""
    return dumbbell_chart(
        "Relative error where the joint moves",
        "RMS error / RMS torque [%]",
        values,
        f"Mean relative error {first.mean_relative_moving:.1%} {words[0]}, "
        f"{second.mean_relative_moving:.1%} {words[1]}{span}.",
    )


def _percent(shares: Mapping[str, float]) -> dict[str, float]:
    return {joint: 100 * share for joint, share in shares.items()}


def _rms(
    words: tuple[str, str],
    first: Errors,
    second: Errors,
    unit: str,
    units: Mapping[str, str],
    floor: Mapping[str, float] | None,
) -> Chart:
    joints = [joint for joint in second.rms if units.get(joint, "N·m") == unit]
    values = Dumbbells(
        words,
        {joint: first.rms[joint] for joint in joints},
        {joint: second.rms[joint] for joint in joints},
        floor,
    )
    known = [j for j in joints if math.isfinite(second.rms[j])]
    told = ", ".join(f"{j} {first.rms[j]:.3g} → {second.rms[j]:.3g}" for j in known)
    what = "torque" if unit == "N·m" else "force"
    return dumbbell_chart(
        f"RMS error of the {what}, all samples",
        f"RMS error [{unit}]",
        values,
        f"RMS errors in {unit}, {words[0]} → {words[1]}: {told}.",
    )


def _table(
    words: tuple[str, str],
    first: Errors,
    second: Errors,
    units: Mapping[str, str],
    floor: Mapping[str, float] | None,
    note: str,
) -> TableBlock:
    one, two = words
    columns = (
        "joint", f"moving, {one}", f"moving, {two}", f"all, {one}", f"all, {two}",
        f"RMS, {one}", f"RMS, {two}", *(["noise floor"] if floor else []), "raw RMS", "unit",
    )  # fmt: skip
    rows: list[tuple[str, ...]] = []
    for joint in second.relative:
        level = [f"{floor[joint]:.4g}" if joint in floor else "–"] if floor else []
        rows.append(
            (
                joint,
                *(_share(e.relative_moving[joint]) for e in (first, second)),
                *(_share(e.relative[joint]) for e in (first, second)),
                *(_figure(e.rms[joint]) for e in (first, second)),
                *level,
                _figure(second.rms_raw[joint]),
                units.get(joint, "N·m"),
            )
        )
    means = [_share(x) for x in (first.mean_relative_moving, second.mean_relative_moving,
                                 first.mean_relative, second.mean_relative)]  # fmt: skip
    rows.append(("mean", *means, *[""] * (len(columns) - 5)))
    return TableBlock(
        columns,
        tuple(rows),
        title="Errors in figures",
        right=frozenset(range(1, len(columns) - 1)),
        note=note,
        folded=True,
        strong=frozenset({len(rows) - 1}),
    )


def _share(x: float) -> str:
    return f"{x:.2%}" if math.isfinite(x) else "–"


def _figure(x: float) -> str:
    return f"{x:.4g}" if math.isfinite(x) else "–"


def by_joint(joints: Sequence[str], units: Sequence[str]) -> dict[str, str]:
    """Units of the torque by joint; N·m where a file of an earlier version has none."""
    return dict(zip(joints, units or ["N·m"] * len(joints), strict=True))
