"""Parameters of a fit with their intervals; the marker says how well the data fix each."""

from collections.abc import Sequence

import numpy as np

from excite_cli.identification.fit import Fit
from excite_cli.identification.fit_words import Identifiable, fixed_by_data, relative_in_words
from excite_cli.report.chart import Chart, Colour
from excite_cli.report.rows_chart import Axis, Bar, Form, Mark, Row, rows_chart

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
