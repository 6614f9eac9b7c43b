"""Errors per joint as dumbbells: two errors of each joint on one line, and what noise leaves."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from excite_cli.identification.errors_of_torque import Errors
from excite_cli.report.rows_chart import Axis, Bar, Mark, Row, RowsChart, rows_chart

DECLARED_AND_FOUND = ("declared", "with effects")
NOTHING_MOVES = "No joint moves in the held-out data: there is no error while moving."


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


def dumbbell_chart(title: str, axis: str, values: Dumbbells, alternative: str) -> RowsChart:
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


def error_charts(
    words: tuple[str, str],
    errors: tuple[Errors, Errors],
    units: Mapping[str, str],
    floor: Mapping[str, float] | None,
) -> tuple[RowsChart, ...]:
    """Two errors of every joint beside each other; `words` name them, `units` those of torque.

    `floor` is the RMS that repeated periods differ by.
    """
    first, second = errors
    moving = any(map(math.isfinite, second.relative_moving.values()))
    charts = [_relative(words, first, second)] if moving else []
    each_unit = dict.fromkeys(units.values())
    return (*charts, *(_rms(words, first, second, unit, units, floor) for unit in each_unit))


def _relative(words: tuple[str, str], first: Errors, second: Errors) -> RowsChart:
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
) -> RowsChart:
    joints = [joint for joint in second.rms if units[joint] == unit]
    values = Dumbbells(
        words,
        {joint: first.rms[joint] for joint in joints},
        {joint: second.rms[joint] for joint in joints},
        floor,
    )
    known = [j for j in joints if math.isfinite(second.rms[j])]
    told = ", ".join(f"{j} {first.rms[j]:.3g} → {second.rms[j]:.3g}" for j in known)
    what = "force" if unit == "N" else "torque"
    return dumbbell_chart(
        f"RMS error of the {what}, all samples",
        f"RMS error [{unit}]",
        values,
        f"RMS errors in {unit}, {words[0]} → {words[1]}: {told}.",
    )
