"""What the motions show worst: the direction of the smallest singular value, and each parameter.

With the stack R = U Σ Vᵀ (columns scaled by s), the combination Σ_i v_i φ_i / s_i of the last
column v of V is the one that moves the measured rows least: a change of the parameters by s_i v_i
moves them by σ_min altogether. With independent noise of one unit per row the parameter i is known
to s_i √((RᵀR)⁻¹)_ii.
"""

from dataclasses import dataclass

import numpy as np

from excite_cli.dynamics.regressor import standard_parameter_unit, standard_parameters
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.identification.fit_words import relative_in_words
from excite_cli.report.chart import in_figures
from excite_cli.report.condition_chart import row_unit
from excite_cli.robot.model import Array
from excite_cli.shown.answer import Block, Section, Table

_SHOWN = 6
_SINGULAR = 1e-14


@dataclass(frozen=True)
class _Columns:
    """Short names, units and scales of the columns, with the values the URDF expects (or NaN)."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    words: tuple[str, ...]
    scales: Array
    expected: Array


def weakest_section(result: Result, problem: Problem) -> Section:
    """The weakest direction in words, its composition, and how well each parameter will show."""
    columns = _columns(result, problem)
    _, sigma, turned = np.linalg.svd(result.stack.factor)
    blocks: list[Block] = [_direction_table(columns, turned[-1])]
    if sigma[-1] <= _SINGULAR * sigma[0]:
        words = "A combination of parameters does not show at all: the stack is singular."
    else:
        words = _words(columns, sigma, turned[-1])
        blocks.append(_parameter_table(result, columns, row_unit(problem)))
        if listed := ", ".join(result.effect_names):
            blocks.append(f"Columns of effects stand beside the base parameters: {listed}.")
    return Section("weakest", "What shows least", tuple(blocks), words)


def _words(columns: _Columns, sigma: Array, direction: Array) -> str:
    shares = direction**2
    order = np.argsort(-shares)
    first = [columns.names[i] for i in order[:2] if shares[i] > 0.1] or [columns.names[order[0]]]
    together = float(shares[order[: len(first)]].sum())
    plural = "make" if len(first) > 1 else "makes"
    return (
        "The combination of parameters that moves the measured torques least is mostly "
        f"{' and '.join(first)}, which {plural} up {100 * together:.0f} % of it. Its singular "
        f"value is {in_figures(float(sigma[-1]))}, "
        f"{in_figures(float(sigma[0] / sigma[-1]))} times less than that of the strongest."
    )


def _columns(result: Result, problem: Problem) -> _Columns:
    base = problem.base
    names = tuple(base.names[i] for i in result.base_selection)
    expected = base.mapping @ standard_parameters(problem.robot)
    effects = result.effect_names
    return _Columns(
        names=(*names, *effects),
        units=(*map(standard_parameter_unit, result.base_selection), *("" for _ in effects)),
        words=result.base_words,
        scales=result.column_scales,
        expected=np.concatenate([expected, np.full(len(effects), np.nan)]),
    )


def _direction_table(columns: _Columns, direction: Array) -> Table:
    """The largest parts of the direction: coefficient and share, what the parameter groups."""
    order = np.argsort(-np.abs(direction))[:_SHOWN]
    sign = 1.0 if direction[order[0]] > 0 else -1.0
    rows = (
        {
            "base parameter": columns.names[i],
            "coefficient [–]": f"{sign * direction[i]:+.2f}",
            "share [–]": f"{100 * direction[i] ** 2:.0f} %",
            "represents": _shortened(columns.words[i]),
        }
        for i in order
    )
    left = 1.0 - float((direction[order] ** 2).sum())
    rest = len(direction) - len(order)
    note = f"The other {rest} make up {100 * left:.0f} %." if rest else ""
    return Table.of(
        "The weakest direction",
        rows,
        left=("base parameter",),
        words=("represents",),
        note=note,
    )


def _parameter_table(result: Result, columns: _Columns, unit: str) -> Table:
    """Standard deviations for noise of one unit per row of the stack, the worst known first."""
    inverse = np.linalg.pinv(result.stack.factor)
    std = columns.scales * np.linalg.norm(inverse, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = std / np.abs(columns.expected)
    order = np.argsort(-np.where(np.isfinite(relative), relative, 0.0))
    rows = (
        {
            "base parameter": columns.names[i],
            "unit": columns.units[i] or "–",
            "by the URDF": in_figures(float(columns.expected[i])),
            "std": in_figures(float(std[i])),
            "of the value": relative_in_words(relative[i]) if np.isfinite(relative[i]) else "–",
        }
        for i in order
    )
    plain = bool(np.all(result.row_weights == 1.0))
    noise = f"1 {unit}" if plain else "one weighted unit"
    return Table.of(
        f"How well each base parameter would be known, for noise of {noise} per sample",
        rows,
        left=("base parameter", "unit"),
        note=f"Independent noise of {noise} on each of the {result.stack.rows} rows of the stack "
        "(samples of the cost grid times measured rows); the deviation goes with the noise, and "
        "with one over the root of the number of samples. Worst known first.",
        folded=True,
    )


def _shortened(words: str, longest: int = 120) -> str:
    """A grouping that is too long for a table ends after a whole term."""
    if len(words) <= longest:
        return words
    cut = max(words.rfind(" + ", 0, longest), words.rfind(" - ", 0, longest))
    terms = words.count(" + ", cut) + words.count(" - ", cut)
    return f"{words[:cut]} and {terms} more"
