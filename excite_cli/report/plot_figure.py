"""The charts of a page as still pictures: what its script draws on a screen, for paper."""

import functools
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import numpy as np

from excite_cli.errors import optional_module
from excite_cli.report.chart import Colour
from excite_cli.report.plot import Curve, Look, Panel, Plot
from excite_cli.report.rows_chart import Form, Mark, RowsChart
from excite_cli.robot.model import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# How figures look and how they are saved: palette, sizes, formats.
#
# matplotlib is optional and is imported only when something is drawn. Figures are made without
# pyplot, so drawing leaves no global state behind.

# Okabe and Ito: told apart with every common form of colour blindness, and in grey print.
BLUE, VERMILION, GREEN, GREY, PURPLE = "#0072B2", "#D55E00", "#009E73", "#767676", "#8A3F82"
FORBIDDEN, HELD_OUT = "#F3DCCB", "#EAEFF4"

WIDTH = 9.0  # [in]; shown 900 px wide, 9 pt text is 12 px high
_DOTS_PER_INCH = 180
_SETTINGS: dict[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.titlesize": 9.0,
    "axes.titlelocation": "left",
    "axes.labelsize": 8.5,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#E4E4E4",
    "grid.linewidth": 0.6,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "lines.linewidth": 1.4,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "figure.titlesize": 11.0,
    "svg.hashsalt": "excite",
    "pdf.fonttype": 42,
}
# Nothing that changes from one run to the next, so that equal results give equal files.
_METADATA: dict[str, dict[str, Any]] = {
    "png": {},
    "svg": {"Date": None},
    "pdf": {"CreationDate": None},
}

P = ParamSpec("P")
T = TypeVar("T")


def matplotlib_part(name: str) -> Any:
    """The module `matplotlib.<name>`, or matplotlib itself for an empty name.

    Raises
    ------
    MissingExtraError
        matplotlib is not installed.
    """
    return optional_module(
        f"matplotlib.{name}" if name else "matplotlib",
        "Figures need matplotlib, which is not installed. Run: pip install 'excite-cli[plot]'",
    )


def styled(draw: Callable[P, T]) -> Callable[P, T]:
    """Run `draw` under the settings of this file, whatever the user's own are."""

    @functools.wraps(draw)
    def inner(*args: P.args, **kwargs: P.kwargs) -> T:
        library = matplotlib_part("")
        defaults = {k: v for k, v in library.rcParamsDefault.items() if "backend" not in k}
        with library.rc_context({**defaults, **_SETTINGS}):
            return draw(*args, **kwargs)

    return inner


def new_figure(height: float, constrained: bool = True) -> "Figure":
    """An empty figure as wide as a page and `height` [in] high."""
    figure: Figure = matplotlib_part("figure").Figure(
        figsize=(WIDTH, height), layout="constrained" if constrained else None
    )
    matplotlib_part("backends.backend_agg").FigureCanvasAgg(figure)
    return figure


def logarithmic(axes: "Axes", values: Iterable[float]) -> None:
    """Make the vertical axis logarithmic about `values`, with ticks that read as numbers."""
    ticker = matplotlib_part("ticker")
    shown = list(values)
    low, high = (min(shown), max(shown)) if shown else (1.0, 10.0)
    pad = max((high / low) ** 0.14, 1.5)
    axes.set_yscale("log")
    axes.set_ylim(low / pad, high * pad)
    subs = (1.0, 2.0, 5.0) if high / low < 1e3 else (1.0,)
    axes.yaxis.set_major_locator(ticker.LogLocator(subs=subs, numticks=50))
    axes.yaxis.set_minor_locator(ticker.NullLocator())
    axes.yaxis.set_major_formatter(ticker.FuncFormatter(lambda value, _: f"{value:g}"))


@styled
def save_figure(figure: "Figure", path: Path, kind: str) -> None:
    """Write `figure` as png, svg or pdf, whatever the suffix of `path`."""
    figure.savefig(path, format=kind, dpi=_DOTS_PER_INCH, metadata=_METADATA[kind])


@styled
def save_pages(figures: Iterable["Figure"], path: Path) -> None:
    """Write all `figures` as the pages of one PDF."""
    pages = matplotlib_part("backends.backend_pdf").PdfPages
    with pages(path, metadata=_METADATA["pdf"]) as file:
        for figure in figures:
            figure.savefig(file, format="pdf")


_COLOURS: dict[Colour, str] = {
    "ink": "black", "muted": GREY, "blue": BLUE, "vermilion": VERMILION, "green": GREEN,
    "purple": PURPLE,
}  # fmt: skip
_LOOKS: dict[Look, dict[str, Any]] = {
    "line": {"linewidth": 1.1},
    "band": {"linewidth": 4.0, "alpha": 0.4},
    "dashed": {"linewidth": 0.9, "linestyle": (0, (3, 1.5))},
    "dotted": {"linewidth": 0.9, "linestyle": (0, (1, 1))},
    "joined": {"linewidth": 1.1, "marker": "o", "markersize": 2.0},
    "steps": {"linewidth": 1.1, "drawstyle": "steps-post"},
    "dots": {"linestyle": "none", "marker": "o", "markersize": 2.0, "alpha": 0.45},
    "marks": {"linestyle": "none", "marker": "o", "markersize": 3.2},
    "rings": {"linestyle": "none", "marker": "o", "markersize": 4.0, "markerfacecolor": "white"},
}
_FORMS: dict[Form, dict[str, Any]] = {
    "dot": {"marker": "o"},
    "ring": {"marker": "o", "markerfacecolor": "white"},
    "cross": {"marker": "x"},
    "tick": {"marker": "|", "markersize": 9, "markeredgewidth": 2},
}
_INCH = 1 / 100.0  # of a pixel of a panel's height
_ALONE = 1.7  # times as high where there is one chart on a line
_LABELLED = 12  # points of one chart at most, beside which their values stand
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
    tall *= _ALONE if columns == 1 else 1.0
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
        _plot_figure_draw(figure, grid, plot, titles[number])
    figure.suptitle(title, x=0.12 / WIDTH, y=1 - 0.08 / height, ha="left", va="top")
    _one_legend(
        figure, loc="upper left", columnspacing=1.4, handlelength=1.8,
        bbox_to_anchor=(0.02 / WIDTH, 1 - 0.28 / height),
    )  # fmt: skip
    return figure


def _plot_figure_draw(figure: "Figure", grid: Any, plot: Plot, title: str) -> None:
    """One plot: its panels under each other over one x."""
    first: Axes | None = None
    for number, panel in enumerate(plot.panels):
        axes = figure.add_subplot(grid[number], sharex=first)
        first = first or axes
        axes.tick_params(pad=2, labelbottom=number == len(plot.panels) - 1)
        for low, high in plot.shaded:
            axes.axvspan(low, high, color=HELD_OUT, linewidth=0, label="_")
        draw_panel(axes, plot.x, panel)
        if plot.counted and len(plot.x) <= _LABELLED:
            _label(axes, plot.x, panel)
        axes.set_ylabel(panel.axis, labelpad=2)
    assert first is not None
    first.set_title(title)
    first.set_xlim(*(plot.span or (float(np.min(plot.x)), float(np.max(plot.x)))))
    axes.set_xlabel(plot.axis, labelpad=2)
    axes.xaxis.set_major_locator(
        matplotlib_part("ticker").MaxNLocator(6, integer=plot.counted, steps=(1, 2, 5, 10))
    )


def draw_panel(axes: "Axes", x: Array, panel: Panel) -> None:
    """All series of a panel over x (T,), and its axis."""
    if panel.noise:
        axes.axhspan(-panel.noise, panel.noise, color=HELD_OUT, linewidth=0, label="_")
    for series in panel.series:
        _draw_series(axes, x, series)
    if panel.corner:
        axes.set_title(panel.corner, loc="right", fontsize=8.0, pad=2)
    if panel.logarithmic:
        values = np.concatenate([series.y for series in panel.series])
        logarithmic(axes, values[np.isfinite(values)])
    else:
        axes.yaxis.set_major_locator(matplotlib_part("ticker").MaxNLocator(4, steps=(1, 2, 5, 10)))
    shown = axes.get_ylim() if panel.span is None else panel.span
    low, high = panel.limits
    for one, two in _forbidden(shown, low, high):
        axes.axhspan(one, two, color=FORBIDDEN, linewidth=0, label="_")
    axes.set_ylim(*shown)


def _label(axes: "Axes", x: Array, panel: Panel) -> None:
    """The values beside the points, once where points of two series are one."""
    told = {
        (at, y): series.colour
        for series in panel.series
        for at, y in zip(x, series.y, strict=True)
        if np.isfinite(y)
    }
    for (at, y), colour in told.items():
        axes.annotate(f"{y:.3g}", (at, y), xytext=(0, 5), textcoords="offset points", ha="center",
                      color=_COLOURS[colour], fontsize=8.5)  # fmt: skip


def _forbidden(
    shown: tuple[float, float], low: float, high: float
) -> Iterator[tuple[float, float]]:
    if low > shown[0]:
        yield shown[0], low
    if high < shown[1]:
        yield high, shown[1]


def _draw_series(axes: "Axes", x: Array, series: Curve) -> None:
    there = ~np.isinf(series.y)
    colour = _COLOURS[series.colour]
    axes.plot(x[there], series.y[there], color=colour, label=series.label, **_LOOKS[series.look])
    if series.low is not None and series.high is not None:
        ends = np.stack([series.low, series.high])[:, there & np.isfinite(series.low)]
        axes.vlines(x[there & np.isfinite(series.low)], *ends, color=colour, linewidth=0.8)


@styled
def draw_rows(title: str, charts: Sequence[RowsChart]) -> "Figure":
    """Charts of rows side by side, under one title and one legend; those without rows left out."""
    charts = [chart for chart in charts if chart.rows]
    figure = new_figure(1.3 + 0.24 * max((len(chart.rows) for chart in charts), default=1))
    drawn = figure.subplots(1, max(len(charts), 1), squeeze=False)[0]
    for axes, chart in zip(drawn, charts, strict=False):
        _draw_rows(axes, chart)
    figure.suptitle(title, x=0.12 / WIDTH, ha="left")
    _one_legend(figure, loc="outside lower center")
    return figure


def _draw_rows(axes: "Axes", chart: RowsChart) -> None:
    named: dict[str, list[tuple[int, Mark]]] = {}
    for number, row in enumerate(chart.rows):
        for bar in row.bars:
            axes.hlines(number, bar.low, bar.high, color=_COLOURS[bar.colour], linewidth=1.0)
        for mark in row.marks:
            named.setdefault(mark.word, []).append((number, mark))
    for word, marks in named.items():
        first = marks[0][1]
        axes.plot(
            [mark.x for _, mark in marks],
            [number for number, _ in marks],
            color=_COLOURS[first.colour],
            label=word,
            linestyle="none",
            clip_on=False,
            **_FORMS[first.form],
        )
    axes.set_yticks(range(len(chart.rows)), [row.name for row in chart.rows])
    axes.set_ylim(len(chart.rows) - 0.5, -0.5)
    axes.set_xscale("log" if chart.axis.logarithmic else "linear")
    axes.set_xlim(chart.axis.low, chart.axis.high)
    axes.set_xticks(chart.axis.ticks, [f"{tick:g}" for tick in chart.axis.ticks])
    axes.xaxis.set_minor_locator(matplotlib_part("ticker").NullLocator())
    axes.set_xlabel(chart.axis.label)


def _one_legend(figure: "Figure", **where: Any) -> None:
    named: dict[str, Any] = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            named.setdefault(label, handle)
    figure.legend(named.values(), named, ncols=max(len(named), 1), **where)
