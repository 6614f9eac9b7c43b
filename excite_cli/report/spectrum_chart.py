"""The singular values of the stacked regressor, beside those of random motions."""

from typing import TYPE_CHECKING

import numpy as np

from excite_cli.criteria.base import condition_number, singular_values
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.excitation.stack import Stack
from excite_cli.report.campaign import in_figures
from excite_cli.report.chart import BLUE, VERMILION, Chart, draw_chart, legend_below
from excite_cli.report.style import logarithmic, matplotlib_part
from excite_cli.robot.model import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def spectrum_chart(result: Result, problem: Problem) -> Chart:
    """Singular values of the stack after all motions, largest first, on a logarithmic axis."""
    spectra = [("optimised", BLUE, "o", singular_values(result.stack.factor))]
    if result.random:
        random = singular_values(random_stack(result, problem))
        spectra.append(("random", VERMILION, "s", random))

    def draw(figure: "Figure") -> None:
        axes = figure.add_subplot()
        logarithmic(axes, [value for *_, sigma in spectra for value in sigma if value > 0])
        for word, colour, marker, sigma in spectra:
            axes.plot(
                np.arange(1, len(sigma) + 1), np.where(sigma > 0, sigma, np.nan), color=colour,
                marker=marker, markersize=3, linewidth=1.0, label=word,
            )  # fmt: skip
        axes.xaxis.set_major_locator(matplotlib_part("ticker").MaxNLocator(6, integer=True))
        axes.set_xlabel("singular value, from the largest [–]")
        axes.set_ylabel(f"size [{spectrum_unit(problem)}]", fontsize=7.5)
        legend_below(figure, 2)

    said = "; ".join(
        f"{word}: from {in_figures(float(sigma[0]))} down to {in_figures(float(sigma[-1]))}, "
        f"ratio {in_figures(condition_number(sigma))}"
        for word, *_, sigma in spectra
    )
    return draw_chart(
        "Singular values of the stacked regressor",
        f"{len(spectra[0][3])} singular values of the stacked base regressor. {said}.",
        draw,
        height=2.9,
        caption="The flatter, the more evenly all parameters show. Largest over smallest is the "
        "condition number.",
    )


def random_stack(result: Result, problem: Problem) -> Array:
    """Triangular factor (r, r) of the random motions, on the same earlier data."""
    stack = Stack.empty(problem.columns).with_stack(result.prior_stack)
    objective = problem.objective()
    for motion in result.random:
        stack = stack.with_rows(objective.block(motion.coefficients))
    return stack.factor


def spectrum_unit(problem: Problem) -> str:
    """Rows are torques (or shares of them); columns kg, kg·m and kg·m² unless they are scaled."""
    row = "N·m" if problem.weighting.row_name == "none" else "weighted N·m"
    if problem.weighting.column_name == "none":
        return f"{row} per kg, kg·m, kg·m²"
    return f"{row} per scaled parameter"
