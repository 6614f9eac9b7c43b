"""The errors of every joint before and after, as a figure: two errors on one line each."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from excite_cli.identification.errors_of_torque import Errors
from excite_cli.report.style import (
    BLUE,
    GREEN,
    GREY,
    WIDTH,
    matplotlib_part,
    new_figure,
    styled,
)
from excite_cli.robot.model import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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
