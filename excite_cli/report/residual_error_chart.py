"""Errors per joint as dumbbells: two errors of each joint on one line, and what noise leaves."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from excite_cli.report.chart import Chart
from excite_cli.report.rows_chart import Axis, Bar, Mark, Row, rows_chart


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
