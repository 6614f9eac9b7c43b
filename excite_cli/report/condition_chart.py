"""Condition numbers by motion, and singular values of their stack, beside those of random ones."""

from collections.abc import Iterable, Sequence

import numpy as np

from excite_cli.criteria.base import condition_number, singular_values
from excite_cli.excitation.motion import Motion
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.random_baseline import RandomMotion
from excite_cli.excitation.result import Result
from excite_cli.report.chart import Colour, in_figures
from excite_cli.report.plot import Curve, Panel, Plot
from excite_cli.robot.model import Array

_HEIGHT = 200  # px
_ROUNDING = 1e-11  # of the largest singular value


def condition_chart(result: Result) -> Plot:
    """Own and stacked condition number of every motion on a logarithmic axis."""
    parts: list[tuple[str, Colour, Sequence[Motion] | Sequence[RandomMotion]]] = [
        ("optimised", "blue", result.motions)
    ]
    if result.random:
        parts.append(("random", "vermilion", result.random))
    indices = sorted({motion.index for _, _, motions in parts for motion in motions})
    at = {index: k for k, index in enumerate(indices)}
    series = []
    for word, colour, motions in parts:
        alone, stacked = np.full((2, len(at)), np.nan)
        for motion in motions:
            alone[at[motion.index]] = motion.condition_number
            stacked[at[motion.index]] = motion.stacked_condition_number
        alone, stacked = (np.where(np.isfinite(each), each, np.nan) for each in (alone, stacked))
        series.append(Curve(f"{word}, alone", alone, colour, "rings"))
        series.append(Curve(f"{word}, stacked", stacked, colour, "joined"))
    said = "; ".join(
        f"{word}: stacked {_listed(m.stacked_condition_number for m in motions)}, alone "
        f"{_listed(m.condition_number for m in motions)}"
        for word, _, motions in parts
    )
    return Plot(
        "Condition number after each motion",
        f"Condition numbers by motion, {said}.",
        "motion [–]",
        np.array(indices, dtype=float),
        (Panel("condition number [–]", tuple(series), height=_HEIGHT, logarithmic=True),),
        caption="Filled: with all motions before stacked. Open: the motion alone.",
        span=(indices[0] - 0.5, indices[-1] + 0.5),
        counted=True,
    )


def _listed(numbers: Iterable[float]) -> str:
    return ", ".join(in_figures(number) for number in numbers)


def spectrum_chart(result: Result, problem: Problem) -> Plot:
    """Singular values of the stack after all motions, largest first, on a logarithmic axis."""
    spectra: list[tuple[str, Colour, Array]] = [
        ("optimised", "blue", singular_values(result.stack.factor))
    ]
    if result.random:
        spectra.append(("random", "vermilion", singular_values(random_stack(result, problem))))
    said = "; ".join(
        f"{word}: from {in_figures(float(sigma[0]))} down to {in_figures(float(sigma[-1]))}, "
        f"ratio {in_figures(condition_number(sigma))}"
        for word, _, sigma in spectra
    )
    count = len(spectra[0][2])
    shown = [np.where(sigma > _ROUNDING * sigma[0], sigma, np.nan) for _, _, sigma in spectra]
    series = tuple(
        Curve(word, sigma, colour, "joined")
        for (word, colour, _), sigma in zip(spectra, shown, strict=True)
    )
    zero = int(np.sum(np.isnan(shown[0])))
    left_out = f" {zero} that are zero but for rounding are not drawn." if zero else ""
    return Plot(
        "Singular values of the stacked regressor",
        f"{count} singular values of the stacked base regressor. {said}.",
        "singular value, from the largest [–]",
        np.arange(1.0, count + 1),
        (Panel(f"size [{spectrum_unit(problem)}]", series, height=_HEIGHT, logarithmic=True),),
        caption="The flatter, the more evenly all parameters show. Largest over smallest is the "
        f"condition number.{left_out}",
        counted=True,
    )


def random_stack(result: Result, problem: Problem) -> Array:
    """Triangular factor (r, r) of the random motions, on the same earlier data."""
    stack = Stack.empty(problem.columns).with_stack(result.prior_stack)
    objective = problem.objective()
    for motion in result.random:
        stack = objective.added_to(stack, motion.coefficients)
    return stack.factor


def row_unit(problem: Problem) -> str:
    """Of what is measured: torques, and forces where something slides or the base can move."""
    robot = problem.robot
    return "N·m (N)" if robot.sliding.any() or len(robot.rows) > robot.n else "N·m"


def spectrum_unit(problem: Problem) -> str:
    """Rows are torques (or shares of them); columns kg, kg·m and kg·m² unless they are scaled."""
    row = row_unit(problem)
    row = row if problem.weighting.row_name == "none" else f"weighted {row}"
    if problem.weighting.column_name == "none":
        return f"{row} per kg, kg·m, kg·m²"
    return f"{row} per scaled parameter"
