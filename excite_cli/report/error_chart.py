"""Errors per joint as dumbbells, and parameters with their intervals."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from excite_cli.identification.errors_of_torque import Errors
from excite_cli.identification.fit import Fit
from excite_cli.identification.fit_words import Identifiable, fixed_by_data, relative_in_words
from excite_cli.report.chart import Chart, Colour
from excite_cli.report.rows_chart import Axis, Bar, Form, Mark, Row, RowsChart, rows_chart

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
        marks.append(Mark(floor, "repeatability", "green", "tick"))
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


_MOST_ROWS = 16
_FORMS: dict[Identifiable, tuple[str, Form, Colour]] = {
    Identifiable.YES: ("identifiable", "dot", "blue"),
    Identifiable.ZERO: ("identifiable, zero within error", "ring", "blue"),
    Identifiable.NO: ("not identifiable", "cross", "vermilion"),
}


def parameter_charts(fit: Fit) -> tuple[Chart, ...]:
    """A chart for every unit; long ones are cut in several."""
    charts: list[Chart] = []
    for unit in dict.fromkeys(fit.units):
        rows = [i for i, own in enumerate(fit.units) if own == unit]
        axis = _axis(fit, unit, rows)
        parts = np.array_split(np.array(rows), -(-len(rows) // _MOST_ROWS))
        for number, part in enumerate(parts, start=1):
            of = f", {number} of {len(parts)}" if len(parts) > 1 else ""
            charts.append(_chart(fit, unit, [int(i) for i in part], axis, of))
    return tuple(charts)


def _chart(fit: Fit, unit: str, rows: Sequence[int], axis: Axis, of: str) -> Chart:
    loose = [fit.names[i] for i in rows if not fit.identifiable[i]]
    words = f"{len(rows)} parameters in {unit} with one standard deviation to either side; " + (
        f"not identifiable: {', '.join(loose)}." if loose else "all of them identifiable."
    )
    drawn = [_row(fit, i, axis) for i in rows]
    return rows_chart(f"Parameters [{unit}]{of}", words, axis, drawn, noted="rel. std")


def _row(fit: Fit, i: int, axis: Axis) -> Row:
    word, form, colour = _FORMS[fixed_by_data(fit, i)]
    value, std = float(fit.values[i]), float(fit.std[i])
    ends = (value - std, value + std) if np.isfinite(std) else (axis.low, axis.high)
    bar = Bar(*ends, colour, dashed=not fit.identifiable[i])
    note = relative_in_words(float(fit.relative_std[i]))
    return Row(fit.names[i], (Mark(value, word, colour, form),), (bar,), note)


def _axis(fit: Fit, unit: str, rows: Sequence[int]) -> Axis:
    """Room for all values, and the intervals of those that the data fix.

    Logarithmic to both sides of zero if values differ by more than a decade or two.
    """
    shown = [0.0]
    for i in rows:
        value, std = float(fit.values[i]), float(fit.std[i])
        shown.append(value)
        if fit.identifiable[i] and np.isfinite(std):
            shown += [value - std, value + std]
    label = f"value ± standard deviation [{unit}]"
    if not any(shown):
        return Axis.about(label, (-1.0, 1.0))
    sizes = np.abs([float(fit.values[i]) for i in rows])
    least = max(float(np.quantile(sizes, 0.25)), 1e-4 * float(np.abs(shown).max()), 1e-12)
    linear = 10.0 ** np.floor(np.log10(least))
    return Axis.about(label, shown, float(linear))
