"""Parameters of a fit with their intervals; the marker says how well the data fix each."""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from excite_cli.identification.fit import Fit
from excite_cli.identification.fit_words import fixed_by_data, relative_in_words
from excite_cli.report.chart import (
    BLUE,
    GRID,
    MUTED,
    VERMILION,
    Chart,
    draw_chart,
    legend_below,
    limits_about,
)
from excite_cli.report.style import matplotlib_part

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST_ROWS = 16
_FORMS = {
    "yes": ("o", BLUE, BLUE),
    "yes, small": ("o", "none", BLUE),
    "NO": ("x", VERMILION, VERMILION),
}
_WORDS = {"yes": "fixed", "yes, small": "fixed, small", "NO": "not fixed"}


def parameter_charts(fit: Fit) -> tuple[Chart, ...]:
    """A chart for every unit; long ones are cut in several."""
    charts: list[Chart] = []
    for unit in dict.fromkeys(fit.units):
        rows = [i for i, own in enumerate(fit.units) if own == unit]
        parts = np.array_split(np.array(rows), -(-len(rows) // _MOST_ROWS))
        for number, part in enumerate(parts, start=1):
            of = f", {number} of {len(parts)}" if len(parts) > 1 else ""
            charts.append(_chart(fit, unit, [int(i) for i in part], rows, of))
    return tuple(charts)


def _chart(fit: Fit, unit: str, rows: Sequence[int], scale: Sequence[int], of: str) -> Chart:
    loose = [fit.names[i] for i in rows if not fit.identifiable[i]]
    words = f"{len(rows)} parameters in {unit} with one standard deviation to either side; " + (
        f"not fixed by the data: {', '.join(loose)}." if loose else "the data fix all of them."
    )
    return draw_chart(
        f"Parameters [{unit}]{of}",
        words,
        partial(_draw, fit, unit, rows, scale),
        height=0.9 + 0.2 * len(rows),
    )


def _draw(fit: Fit, unit: str, rows: Sequence[int], scale: Sequence[int], figure: "Figure") -> None:
    axes = figure.add_subplot()
    low, high = _range(fit, scale)
    axes.axvline(0.0, color=MUTED, lw=0.7)
    told: set[str] = set()
    for y, i in enumerate(rows):
        form = fixed_by_data(fit, i)
        marker, face, colour = _FORMS[form]
        value, std = float(fit.values[i]), float(fit.std[i])
        ends = [value - std, value + std] if np.isfinite(std) else [low, high]
        style = "solid" if fit.identifiable[i] else (0, (2, 1.5))
        axes.plot(np.clip(ends, low, high), [y, y], color=colour, lw=1.3, ls=style, zorder=1.8)
        axes.plot([value], [y], marker, color=colour, mfc=face, ms=5, mew=1.3, ls="none",
                  label=None if form in told else _WORDS[form])  # fmt: skip
        told.add(form)
        axes.text(1.01, y, relative_in_words(float(fit.relative_std[i])), va="center", fontsize=7.5,
                  transform=axes.get_yaxis_transform())  # fmt: skip
    axes.text(1.01, -1.0, "rel. std", va="center", fontsize=7.5,
              transform=axes.get_yaxis_transform())  # fmt: skip
    axes.set_yticks(range(len(rows)), [fit.names[i] for i in rows])
    axes.tick_params(axis="y", labelsize=7.5)
    axes.set_ylim(len(rows) - 0.4, -1.4)
    axes.set_xlim(low, high)
    axes.grid(axis="y", color=GRID, lw=0.4)
    _stretch(axes, fit, scale)
    axes.set_xlabel(f"value ± standard deviation [{unit}]", labelpad=2)
    legend_below(figure)


def _stretch(axes: "Axes", fit: Fit, rows: Sequence[int]) -> None:
    """A logarithmic axis to both sides of zero, if values differ by more than a decade or two."""
    ticker = matplotlib_part("ticker")
    low, high = axes.get_xlim()
    sizes = np.abs([float(fit.values[i]) for i in rows])
    largest = max(abs(low), abs(high))
    linear = 10.0 ** np.floor(np.log10(max(np.quantile(sizes, 0.25), 1e-4 * largest)))
    if largest < 30 * linear:
        axes.xaxis.set_major_locator(ticker.MaxNLocator(4))
        return
    axes.set_xscale("symlog", linthresh=linear)
    decades = np.arange(np.log10(linear), np.log10(largest) + 1e-9)
    every = 10.0 ** decades[:: 1 + (len(decades) > 3)]
    ticks = [0.0, *(every[-2:] if low < -linear else []), *every]
    signs = [1.0, *([-1.0] * min(2, len(every)) if low < -linear else []), *np.ones(len(every))]
    axes.set_xticks([t * sign for t, sign in zip(ticks, signs, strict=True)])
    axes.xaxis.set_major_formatter(ticker.FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_locator(ticker.NullLocator())
    axes.set_xlim(low, high)


def _range(fit: Fit, rows: Sequence[int]) -> tuple[float, float]:
    """Ends of the axis: all values, and the intervals of those that the data fix."""
    shown = [0.0]
    for i in rows:
        value, std = float(fit.values[i]), float(fit.std[i])
        shown.append(value)
        if fit.identifiable[i] and np.isfinite(std):
            shown += [value - std, value + std]
    return limits_about(shown)
