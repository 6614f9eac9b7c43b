"""Errors per joint as dumbbells: two errors of each joint on one line, and what noise leaves."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from excite_cli.report.chart import (
    BLUE,
    GREEN,
    INK,
    MUTED,
    Chart,
    draw_chart,
    legend_below,
)
from excite_cli.report.style import matplotlib_part

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Dumbbells:
    """Two values by joint, with the words for each; `floor` what no model can go below.

    `interval` belongs to `mean`, which is drawn on a line of its own.
    """

    words: tuple[str, str]
    first: Mapping[str, float]
    second: Mapping[str, float]
    floor: Mapping[str, float] | None = None
    means: tuple[float, float] | None = None
    interval: tuple[float, float] | None = None


def draw_dumbbells(
    title: str, axis: str, values: Dumbbells, alternative: str, caption: str = ""
) -> Chart:
    """The chart, on a logarithmic axis; joints without a value are left out."""
    rows = [
        joint
        for joint in values.second
        if _shown(values.first.get(joint, math.nan)) and _shown(values.second[joint])
    ]
    height = 0.95 + 0.24 * (len(rows) + (values.means is not None))
    draw = partial(_draw, axis, values, rows)
    return draw_chart(title, alternative, draw, height=height, caption=caption)


def _shown(value: float) -> bool:
    return math.isfinite(value) and value > 0


def _draw(axis: str, values: Dumbbells, rows: Sequence[str], figure: "Figure") -> None:
    axes = figure.add_subplot()
    names = list(rows)
    for y, joint in enumerate(rows):
        _pair(axes, y, values.first[joint], values.second[joint], values.words if not y else None)
        floor = (values.floor or {}).get(joint, math.nan)
        if _shown(floor):
            label = "noise floor" if not y else None
            axes.plot([floor], [y], "|", color=GREEN, ms=9, mew=2, ls="none", label=label)
    if values.means is not None and all(map(_shown, values.means)):
        y = len(names)
        names.append("mean")
        _pair(axes, y, *values.means, None)
        if values.interval is not None and all(map(_shown, values.interval)):
            axes.plot(values.interval, [y, y], color=INK, lw=5, alpha=0.35, zorder=1.5,
                      solid_capstyle="butt", label="95 % interval")  # fmt: skip
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.grid(axis="y", visible=False)
    axes.set_xscale("log")
    axes.set_xlabel(axis, labelpad=2)
    axes.set_xlim(*_room(axes.get_xlim()))
    _plain_ticks(axes)
    legend_below(figure, 4)


def _pair(axes: "Axes", y: int, first: float, second: float, words: tuple[str, str] | None) -> None:
    one, two = words or (None, None)
    axes.plot([first, second], [y, y], color=MUTED, lw=1.2, zorder=1.2)
    axes.plot([first], [y], "o", color=MUTED, ms=5.5, mfc="none", mew=1.4, ls="none", label=one)
    axes.plot([second], [y], "o", color=BLUE, ms=6, ls="none", label=two)


def _room(limits: tuple[float, float]) -> tuple[float, float]:
    low, high = limits
    if high / low < 4.0:  # so that there is a tick on either side
        middle = math.sqrt(low * high)
        low, high = min(low, middle / 2.0), max(high, middle * 2.0)
    return low, high


def _plain_ticks(axes: "Axes") -> None:
    ticker = matplotlib_part("ticker")
    low, high = axes.get_xlim()
    subs = (1.0, 2.0, 5.0) if high / low < 300 else (1.0,)
    axes.xaxis.set_major_locator(ticker.LogLocator(subs=subs, numticks=12))
    axes.xaxis.set_minor_locator(ticker.NullLocator())
    axes.xaxis.set_major_formatter(ticker.FuncFormatter(lambda value, _: f"{value:g}"))
