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

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


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
    kinds = list(dict.fromkeys(units.values()))
    joints = {unit: [name for name in units if units[name] == unit] for unit in kinds}
    figure = new_figure(1.3 + 0.24 * (len(units) + 1))
    panels = figure.subplots(1, 1 + len(kinds), squeeze=False)[0]
    relative = [
        {name: 100 * each.relative_moving[name] for name in units}
        | {"mean": 100 * each.mean_relative_moving}
        for each in errors
    ]
    _draw(panels[0], words, (relative[0], relative[1]), {})
    panels[0].set_xlabel("RMS error / RMS torque, where the joint moves [%]")
    for axes, unit in zip(panels[1:], kinds, strict=True):
        first_rms, second_rms = ({n: each.rms[n] for n in joints[unit]} for each in errors)
        _draw(axes, words, (first_rms, second_rms), floor or {})
        axes.set_xlabel(f"RMS error, all samples [{unit}]")
    figure.suptitle(title, x=0.12 / WIDTH, ha="left")
    named = {label: handle for axes in panels
             for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}  # fmt: skip
    figure.legend(named.values(), named, loc="outside lower center", ncols=len(named))
    return figure


def _draw(
    axes: "Axes",
    words: tuple[str, str],
    values: tuple[Mapping[str, float], Mapping[str, float]],
    floor: Mapping[str, float],
) -> None:
    """A line per joint from the one value to the other; what is not known or zero is left out."""
    first, second = (_positive(each) for each in values)
    rows = range(len(values[1]))
    level = _positive({name: floor.get(name, np.nan) for name in values[1]})
    axes.hlines(rows, np.fmin(first, second), np.fmax(first, second), color=GREY, linewidth=1.0)
    axes.plot(first, rows, "o", color=GREY, markerfacecolor="white", label=words[0])
    axes.plot(second, rows, "o", color=BLUE, label=words[1])
    if np.isfinite(level).any():
        axes.plot(level, rows, "|", color=GREEN, markersize=9, markeredgewidth=2,
                  label="noise floor")  # fmt: skip
    axes.set_yticks(rows, list(values[1]))
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xscale("log")
    ticker = matplotlib_part("ticker")
    known = np.concatenate([first, second, level])
    known = known[np.isfinite(known)]
    if len(known):
        low, high = known.min() / 1.2, known.max() * 1.2
        wide = np.log10(high / low)
        axes.set_xlim(low, high)
        subs = (1.0, 2.0, 5.0) if wide < 2.5 else (1.0,)
        axes.xaxis.set_major_locator(ticker.LogLocator(subs=subs, numticks=50))
    axes.xaxis.set_minor_locator(ticker.NullLocator())
    axes.xaxis.set_major_formatter(ticker.FuncFormatter(lambda value, _: f"{value:g}"))


def _positive(values: Mapping[str, float]) -> np.ndarray:
    known = np.array(list(values.values()), dtype=float)
    return np.where(np.isfinite(known) & (known > 0), known, np.nan)
