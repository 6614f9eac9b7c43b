"""Figures of a diagnosis as files: torque before and after, errors, and the evidence."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from excite_cli.diagnosis.records import Diagnosis
from excite_cli.diagnosis.words import by_worth
from excite_cli.identification.errors_of_torque import Errors
from excite_cli.report.chart import Colour
from excite_cli.report.diagnosis_sections import torque_units
from excite_cli.report.effect_section import effect_plots, friction_plots
from excite_cli.report.plot import Curve, Look, Panel, Plot
from excite_cli.report.residual_error_section import by_joint
from excite_cli.report.residual_section import plots_in_time
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
if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
if TYPE_CHECKING:
    from matplotlib.figure import Figure

# The charts of a page as still pictures: what its script draws on a screen, for paper.

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
        _plot_figure_draw(figure, grid, plot, titles[number])
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


def _plot_figure_draw(figure: "Figure", grid: Any, plot: Plot, title: str) -> None:
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


def _draw_series(axes: "Axes", x: Array, series: Curve) -> None:
    there = ~np.isinf(series.y)
    colour = _COLOURS[series.colour]
    axes.plot(x[there], series.y[there], color=colour, label=series.label, **_LOOKS[series.look])
    if series.low is not None and series.high is not None:
        ends = np.stack([series.low, series.high])[:, there & np.isfinite(series.low)]
        axes.vlines(x[there & np.isfinite(series.low)], *ends, color=colour, linewidth=0.8)


# The errors of every joint before and after, as a figure: two errors on one line each.

# A label, the two errors by joint, and the noise floor by joint.
_Panel = tuple[str, list[dict[str, float]], dict[str, float]]


@styled
def draw_errors(
    title: str,
    words: tuple[str, str],
    errors: tuple[Errors, Errors],
    units: Mapping[str, str],
    floor: Mapping[str, float] | None,
) -> "Figure":
    """Relative errors where joints move [%], and RMS errors of each of the `units` of torque.

    `words` name the two errors; `floor` is the RMS that repeated periods differ by.
    """
    moving = [
        {name: 100 * each.relative_moving[name] for name in units}
        | {"mean": 100 * each.mean_relative_moving}
        for each in errors
    ]
    panels: list[_Panel] = [("RMS error / RMS torque, where the joint moves [%]", moving, {})]
    for unit in dict.fromkeys(units.values()):
        rms = [{name: each.rms[name] for name in units if units[name] == unit} for each in errors]
        panels.append((f"RMS error, all samples [{unit}]", rms, dict(floor or {})))
    shown = [
        (label, rows)
        for label, values, level in panels
        if (rows := _known(values[0], values[1], level))
    ]
    figure = new_figure(1.3 + 0.24 * (len(units) + 1))
    drawn = figure.subplots(1, max(len(shown), 1), squeeze=False)[0]
    for axes, (label, rows) in zip(drawn, shown, strict=False):
        _draw(axes, words, rows)
        axes.set_xlabel(label)
    figure.suptitle(title, x=0.12 / WIDTH, ha="left")
    named = {label: handle for axes in drawn
             for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}  # fmt: skip
    figure.legend(named.values(), named, loc="outside lower center", ncols=len(named))
    return figure


def _known(
    first: Mapping[str, float], second: Mapping[str, float], floor: Mapping[str, float]
) -> dict[str, Array]:
    """By joint both errors and the noise floor (3,), NaN where not known, or no logarithm.

    Joints without either error are left out.
    """
    every = {
        name: np.array([first[name], second[name], floor.get(name, np.nan)], dtype=float)
        for name in second
    }
    every = {name: np.where(row > 0, row, np.nan) for name, row in every.items()}
    return {name: row for name, row in every.items() if np.isfinite(row[:2]).any()}


def _draw(axes: "Axes", words: tuple[str, str], known: Mapping[str, Array]) -> None:
    """A line per joint from the one value to the other."""
    first, second, level = np.array(list(known.values())).T
    rows = range(len(known))
    axes.hlines(rows, np.fmin(first, second), np.fmax(first, second), color=GREY, linewidth=1.0)
    axes.plot(first, rows, "o", color=GREY, markerfacecolor="white", label=words[0])
    axes.plot(second, rows, "o", color=BLUE, label=words[1])
    if np.isfinite(level).any():
        axes.plot(level, rows, "|", color=GREEN, markersize=9, markeredgewidth=2,
                  label="noise floor")  # fmt: skip
    axes.set_yticks(rows, list(known))
    axes.set_ylim(len(rows) - 0.5, -0.5)
    values = [first, second, level]
    low, high = np.nanmin(values) / 1.2, np.nanmax(values) * 1.2
    ticker = matplotlib_part("ticker")
    axes.set_xscale("log")
    axes.set_xlim(low, high)
    subs = (1.0, 2.0, 5.0) if high / low < 60 else (1.0,)
    axes.xaxis.set_major_locator(ticker.LogLocator(subs=subs, numticks=50))
    axes.xaxis.set_minor_locator(ticker.NullLocator())
    axes.xaxis.set_major_formatter(ticker.FuncFormatter(lambda value, _: f"{value:g}"))


_CARDS = 9  # of a figure


def figures_of(found: Diagnosis) -> dict[str, Callable[[], "Figure"]]:
    """What draws each figure, by its name, in reading order; without samples the errors alone.

    `before_RUN` and `after_RUN` are of runs that hold held-out data.
    """
    units = torque_units(found)
    figures: dict[str, Callable[[], Figure]] = {}
    training = found.traces.runs if found.traces is not None else ()
    runs = dict.fromkeys(trace.run for trace in found.held_out_traces)
    traces = [each for each in (*found.held_out_traces, *training) if each.run in runs]
    alone = [replace(each, predicted=each.before, before=None)
             for each in traces if each.before is not None]  # fmt: skip
    for name, title, parts in (
        ("before", "the declared model", alone),
        ("after", "the model with the effects found", traces),
    ):
        plots = plots_in_time(parts, found.joint_names, units)
        labels = dict(zip(dict.fromkeys(trace.run for trace in parts), plots, strict=True))
        figures |= {
            f"{name}_{run}": partial(draw_plots, f"{label}: measured, and {title}", plots[label], 2)
            for run, label in labels.items()
        }
    figures["errors"] = partial(
        draw_errors, f"Errors on held-out data: {found.held_out_run}", ("before", "after"),
        (found.before, found.after), by_joint(found.joint_names, units), found.noise_floor,
    )  # fmt: skip
    if found.traces is not None:
        friction = friction_plots(found, found.traces)
        if friction:
            figures["friction"] = partial(
                draw_plots, "All friction of a joint together", friction, 3
            )
        large, _ = by_worth(found.effects, found)
        cards = effect_plots(found, found.traces, large)
        for number, part in enumerate(_parts(cards), 1):
            title = "Partial residuals and the fitted laws"
            figures[f"effects_{number}"] = partial(draw_plots, title, part, 3)
    return figures


def _parts(plots: Sequence[Plot]) -> list[tuple[Plot, ...]]:
    return [tuple(plots[k : k + _CARDS]) for k in range(0, len(plots), _CARDS)]
