"""What the motions show worst: the direction of the smallest singular value, and each parameter.

With the stack R = U Σ Vᵀ (columns scaled by s), the combination Σ_i v_i φ_i / s_i of the last
column v of V is the one that moves the measured rows least: a change of the parameters by s_i v_i
moves them by σ_min altogether. With independent noise of one unit per row the parameter i is known
to s_i √((RᵀR)⁻¹)_ii.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from excite_cli.config.spec import Spec
from excite_cli.diagnosis.expectation import Expectation
from excite_cli.diagnosis.power import EffectPower
from excite_cli.dynamics.regressor import standard_parameter_unit, standard_parameters
from excite_cli.excitation.prediction import NOISE
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.identification.fit_words import relative_in_words
from excite_cli.report.chart import in_figures
from excite_cli.report.condition_chart import row_unit
from excite_cli.robot.model import Array
from excite_cli.shown.answer import Block, Parts, Section, Table

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


# What planned motions are expected to tell, for people and for `--json`.

_MOST = 10.0  # times the usual torque: no robot has more of an effect


def expectation_parts(problem: Problem, found: Expectation, asked: bool) -> Parts:
    """Predicted deviation after every motion, and the sizes of effects that would be named."""
    after = ", ".join(f"{each:.2g}" for each in found.deviations)
    numbers = f"motion {len(found.deviations)}" if len(found.deviations) == 1 else "each motion"
    beside = "" if found.all_data else ", earlier data aside"
    words = (
        f"Predicted torques deviate by {after} times the noise of one sample after {numbers} "
        f"(RMS, {where_in_words(problem)}{beside})."
    )
    noise = noise_in_words(problem.spec)
    table = _asked_table(found.power, noise) if asked else power_table(found.power, noise)
    return [words, table]


def noise_in_words(spec: Spec) -> str:
    """Which noise of the torques these figures were made with."""
    given, rate = spec.criterion.row_weights, spec.task.rate
    level = "1/criterion.row_weights" if isinstance(given, dict) else f"{NOISE:.0%} of that torque"
    return f"noise: {level} in {rate:g} independent samples a second"


def where_in_words(problem: Problem) -> str:
    """The states whose torques are predicted."""
    task = problem.spec.task
    if task.log or task.plan:
        return f"at the states of {task.log or task.plan}"
    if task.position or task.speed < 1.0 or task.acceleration < 1.0:
        return "at states of the region of `task`"
    return "at states within the limits"


def power_table(power: tuple[EffectPower, ...], noise: str) -> Table:
    """Of every kind the joints on which the smallest and the largest size would be named."""
    rows = []
    for kind in dict.fromkeys(each.kind for each in power):
        of = [each for each in power if each.kind == kind]
        best = min(of, key=lambda each: each.share)
        worst = max(of, key=lambda each: each.share)
        rows.append((kind, _share(best), ", ".join(best.joints), _share(worst), _joints(worst)))
    return Table(
        "Effects that a diagnosis would name with 95%: size as a share of the "
        f"joint's usual torque ({noise})",
        ("effect", "size", "most visible on", "size there", "least visible on"),
        tuple(rows),
        left=("effect", "most visible on", "least visible on"),
    )


def _share(each: EffectPower) -> str:
    return f"{each.share:.2%}" if each.share < _MOST else "not shown"


def _joints(each: EffectPower) -> str:
    return ", ".join(each.joints)


def _asked_table(power: tuple[EffectPower, ...], noise: str) -> Table:
    rows = tuple(
        (each.kind, _joints(each), f"{each.size:.3g}", each.unit, f"{each.power:.0%}")
        for each in power
    )
    return Table(
        f"Probability that a diagnosis names it ({noise})",
        ("effect", "on", "size", "unit", "named"),
        rows,
        left=("effect", "on", "unit"),
    )


def power_data(power: tuple[EffectPower, ...]) -> list[dict[str, Any]]:
    """Effects with the size that is named with the probability `power`; None: no size is."""
    return [
        {
            "kind": each.kind,
            "joints": list(each.joints),
            "parameter": each.parameter,
            "size": each.size if np.isfinite(each.size) else None,
            "unit": each.unit,
            "share_of_torque": each.share if np.isfinite(each.share) else None,
            "power": each.power,
        }
        for each in power
    ]
