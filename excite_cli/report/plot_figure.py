"""The charts of a page as still pictures: what its script draws on a screen, for paper."""

from collections.abc import Iterator, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from excite_cli.report.chart import Colour
from excite_cli.report.plot import Look, Panel, Plot, Series
from excite_cli.report.style import (
    BLUE,
    FORBIDDEN,
    GREEN,
    GREY,
    HELD_OUT,
    PURPLE,
    VERMILION,
    WIDTH,
    matplotlib_part,
    new_figure,
    styled,
)
from excite_cli.robot.model import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLOURS: dict[Colour, str] = {
    "ink": "black", "muted": GREY, "blue": BLUE, "vermilion": VERMILION, "green": GREEN,
    "purple": PURPLE,
}  # fmt: skip
_LOOKS: dict[Look, dict[str, Any]] = {
    "line": {"linewidth": 1.1},
    "dashed": {"linewidth": 0.9, "linestyle": (0, (3, 1.5))},
    "dotted": {"linewidth": 0.9, "linestyle": (0, (1, 1))},
    "joined": {"linewidth": 1.1, "marker": "o", "markersize": 2.0},
    "dots": {"linestyle": "none", "marker": "o", "markersize": 2.0, "alpha": 0.45},
    "marks": {"linestyle": "none", "marker": "o", "markersize": 3.2},
    "rings": {"linestyle": "none", "marker": "o", "markersize": 4.0, "markerfacecolor": "white"},
}
_INCH = 1 / 100.0  # of a pixel of a panel's height
_LETTER = 0.075  # in, of a title
_HEAD, _LINE, _BELOW, _LEFT, _RIGHT = 0.62, 0.18, 0.44, 0.6, 0.08  # in


@styled
def draw_plots(title: str, plots: Sequence[Plot], columns: int) -> "Figure":
    """Plots in reading order, `columns` side by side, under one title and one legend."""
    rows = -(-len(plots) // columns)
    wide = (WIDTH - _RIGHT) / columns
    titles = ["\n".join(wrap(plot.title, int((wide - _LEFT) / _LETTER))) for plot in plots]
    over = _LINE * max(title.count("\n") + 1 for title in titles) + 0.04
    tall = max(sum(panel.height for panel in plot.panels) for plot in plots) * _INCH
    height = _HEAD + rows * (over + tall + _BELOW)
    figure = new_figure(height, constrained=False)
    for number, plot in enumerate(plots):
        row, column = divmod(number, columns)
        left = column * wide + _LEFT
        top = height - _HEAD - row * (over + tall + _BELOW) - over
        grid = figure.add_gridspec(
            len(plot.panels), 1, left=left / WIDTH, right=(column + 1) * wide / WIDTH,
            top=top / height, bottom=(top - tall) / height, hspace=0.12,
            height_ratios=[panel.height for panel in plot.panels],
        )  # fmt: skip
        _draw(figure, grid, plot, titles[number])
    figure.suptitle(title, x=0.12 / WIDTH, y=1 - 0.08 / height, ha="left", va="top")
    named: dict[str, Any] = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            named.setdefault(label, handle)
    figure.legend(
        named.values(), named, loc="upper left", ncols=max(len(named), 1), columnspacing=1.4,
        bbox_to_anchor=(0.02 / WIDTH, 1 - 0.28 / height), handlelength=1.8,
    )  # fmt: skip
    return figure


def _draw(figure: "Figure", grid: Any, plot: Plot, title: str) -> None:
    """One plot: its panels under each other over one x."""
    first: Axes | None = None
    for number, panel in enumerate(plot.panels):
        axes = figure.add_subplot(grid[number], sharex=first)
        first = first or axes
        axes.tick_params(pad=2, labelbottom=number == len(plot.panels) - 1)
        for low, high in plot.shaded:
            axes.axvspan(low, high, color=HELD_OUT, linewidth=0, label="_")
        _draw_panel(axes, plot.x, panel)
        axes.set_ylabel(panel.axis, labelpad=2)
    assert first is not None
    first.set_title(title)
    first.set_xlim(*(plot.span or (float(np.min(plot.x)), float(np.max(plot.x)))))
    axes.set_xlabel(plot.axis, labelpad=2)
    axes.xaxis.set_major_locator(
        matplotlib_part("ticker").MaxNLocator(6, integer=plot.counted, steps=(1, 2, 5, 10))
    )


def _draw_panel(axes: "Axes", x: Array, panel: Panel) -> None:
    for series in panel.series:
        _draw_series(axes, x, series)
    if panel.logarithmic:
        axes.set_yscale("log")
    else:
        axes.yaxis.set_major_locator(matplotlib_part("ticker").MaxNLocator(4, steps=(1, 2, 5, 10)))
    shown = axes.get_ylim() if panel.span is None else panel.span
    low, high = panel.limits
    for one, two in _forbidden(shown, low, high):
        axes.axhspan(one, two, color=FORBIDDEN, linewidth=0, label="_")
    axes.set_ylim(*shown)


def _forbidden(
    shown: tuple[float, float], low: float, high: float
) -> Iterator[tuple[float, float]]:
    if low > shown[0]:
        yield shown[0], low
    if high < shown[1]:
        yield high, shown[1]


def _draw_series(axes: "Axes", x: Array, series: Series) -> None:
    there = ~np.isinf(series.y)
    colour = _COLOURS[series.colour]
    axes.plot(x[there], series.y[there], color=colour, label=series.label, **_LOOKS[series.look])
    if series.low is not None and series.high is not None:
        ends = np.stack([series.low, series.high])[:, there & np.isfinite(series.low)]
        axes.vlines(x[there & np.isfinite(series.low)], *ends, color=colour, linewidth=0.8)
