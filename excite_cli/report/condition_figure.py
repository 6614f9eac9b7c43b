"""Figures of how well the parameters can be seen: condition numbers and singular values."""

from typing import TYPE_CHECKING

import numpy as np

from excite_cli.criteria.base import singular_values
from excite_cli.excitation.motion import Motion
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.random_baseline import RandomMotion
from excite_cli.excitation.result import Result
from excite_cli.report.spectrum_chart import random_stack, spectrum_unit
from excite_cli.report.style import (
    BLUE,
    VERMILION,
    logarithmic,
    matplotlib_part,
    new_figure,
    styled,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# More motions than this and the numbers beside the points would overlap.
_MOST_LABELLED = 12


@styled
def draw_condition_numbers(result: Result) -> "Figure":
    """Condition numbers of every motion, own and stacked: the paper's Table I, and II beside it.

    Values that are not finite (a motion that alone does not show all parameters) are left out of
    the lines and counted in the title.
    """
    figure = new_figure(4.2)
    axes = figure.add_subplot()
    parts: list[tuple[str, str, tuple[Motion, ...] | tuple[RandomMotion, ...]]] = [
        ("optimised", BLUE, result.motions)
    ]
    if result.random:
        parts.append(("random", VERMILION, result.random))
    numbers = [
        number
        for _, _, motions in parts
        for motion in motions
        for number in (motion.condition_number, motion.stacked_condition_number)
    ]
    finite = [number for number in numbers if np.isfinite(number)]
    logarithmic(axes, finite)
    for side, (word, colour, motions) in enumerate(parts):
        _draw_sequence(axes, word, colour, motions, below=side == 0)
    count = max(len(motions) for _, _, motions in parts)
    axes.set_xlim(0.5, count + 0.5)
    every = -(-count // 20)
    axes.set_xticks(range(1, count + 1, every))
    axes.grid(axis="x", visible=False)
    axes.set_xlabel("motion [–]")
    axes.set_ylabel("condition number of the base regressor [–]")
    axes.set_title(_title(result, len(numbers) - len(finite)))
    figure.legend(loc="outside lower center", ncols=4)
    return figure


def _draw_sequence(
    axes: "Axes",
    word: str,
    colour: str,
    motions: tuple[Motion, ...] | tuple[RandomMotion, ...],
    below: bool,
) -> None:
    indices = [motion.index for motion in motions]
    stacked = np.array([motion.stacked_condition_number for motion in motions])
    own = np.array([motion.condition_number for motion in motions])
    stacked, own = (np.where(np.isfinite(part), part, np.nan) for part in (stacked, own))
    axes.plot(indices, stacked, "o-", color=colour, label=f"{word}, stacked")
    axes.plot(
        indices, own, "o", color=colour, markerfacecolor="white", markersize=10, zorder=1.9,
        label=f"{word}, motion alone",
    )  # fmt: skip
    if len(motions) > _MOST_LABELLED:
        return
    for index, alone, together in zip(indices, own, stacked, strict=True):
        if np.isclose(alone, together):
            _label(axes, index, together, colour, below)
            continue
        _label(axes, index, alone, colour, below=bool(alone < together))
        _label(axes, index, together, colour, below=not alone < together)


def _label(axes: "Axes", index: int, number: float, colour: str, below: bool) -> None:
    if not np.isfinite(number):
        return
    axes.annotate(
        f"{number:.1f}" if number < 1000 else f"{number:.0f}",
        (index, number),
        xytext=(0, -9 if below else 9),
        textcoords="offset points",
        ha="center",
        va="top" if below else "bottom",
        color=colour,
        fontsize=8.5,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6},
    )


def _title(result: Result, infinite: int) -> str:
    drawn, admissible = result.random_candidates
    title = "Condition numbers"
    if result.priors:
        earlier = len(result.priors)
        title += f", stacked on {earlier} earlier result{'s' if earlier > 1 else ''}"
    if result.random:
        title += f"; random: the best of {admissible} admissible out of {drawn} drawn"
    if infinite:
        title += f"; {infinite} not finite, not shown"
    return title


@styled
def draw_spectrum(result: Result, problem: Problem) -> "Figure":
    """Singular values of the stack after all motions, and of the random baseline's stack."""
    figure = new_figure(4.2)
    axes = figure.add_subplot()
    spectra = [("optimised", BLUE, "o", singular_values(result.stack.factor))]
    if result.random:
        spectra.append(("random", VERMILION, "s", singular_values(random_stack(result, problem))))
    shown = [value for *_, sigma in spectra for value in sigma if value > 0]
    logarithmic(axes, shown)
    for word, colour, marker, sigma in spectra:
        with np.errstate(divide="ignore"):
            condition = sigma[0] / sigma[-1] if len(sigma) else np.nan
        axes.plot(
            np.arange(1, len(sigma) + 1),
            np.where(sigma > 0, sigma, np.nan),
            color=colour,
            marker=marker,
            markersize=3.5,
            label=f"{word}: largest / smallest = {condition:.1f}",
        )
    axes.xaxis.set_major_locator(matplotlib_part("ticker").MaxNLocator(integer=True))
    axes.set_xlabel("singular value, from the largest [–]")
    axes.set_ylabel(f"size of the singular value [{spectrum_unit(problem)}]")
    axes.set_title(_spectrum_title(result))
    axes.legend(loc="upper right")
    return figure


def _spectrum_title(result: Result) -> str:
    count = len(result.motions)
    motions = "motion" if count == 1 else "motions"
    earlier = " and the earlier data" if result.priors else ""
    return f"Singular values of the base regressor, {count} {motions}{earlier} stacked"
