"""Whether a motion keeps every constraint, judged on a grid of its own."""

from collections.abc import Iterator

import numpy as np

from excite_cli.constraints.base import Array, Worst
from excite_cli.constraints.joint_bound import JointBound
from excite_cli.excitation.problem import Problem

CONTROLLER_RATE = 1000.0
_CHUNK = 2000


def fine_times(problem: Problem, rate: float = CONTROLLER_RATE) -> Array:
    """Instants from start to end of the trajectory at `rate` [Hz], both ends included."""
    count = int(np.ceil(problem.trajectory.duration * rate)) + 1
    return np.linspace(0.0, problem.trajectory.duration, count)


def _chunks(
    problem: Problem, coefficients: Array, times: Array
) -> Iterator[tuple[Array, list[Array]]]:
    """Times and margins (T, m) of every constraint, a few thousand instants at a time."""
    for begin in range(0, len(times), _CHUNK):
        some = times[begin : begin + _CHUNK]
        states = problem.states(coefficients, problem.trajectory.basis(some))
        yield some, [constraint.margins(states) for constraint in problem.constraints]


def fine_margins(problem: Problem, coefficients: Array, times: Array) -> list[Array]:
    """Margins (T, m) of every constraint at `times`, in their own units."""
    parts = [margins for _, margins in _chunks(problem, coefficients, times)]
    return [np.vstack(column) for column in zip(*parts, strict=True)]


def smallest_margins(problem: Problem, coefficients: Array, times: Array) -> list[Array]:
    """Smallest margin (m,) of every column of every constraint over `times`."""
    parts = [
        [m.min(axis=0) for m in margins] for _, margins in _chunks(problem, coefficients, times)
    ]
    return [np.min(column, axis=0) for column in zip(*parts, strict=True)]


def worst_margins(
    problem: Problem, coefficients: Array, rate: float = CONTROLLER_RATE
) -> dict[str, Worst]:
    """The worst margin of every constraint at `rate` [Hz], by the constraint's name."""
    found: dict[str, Worst] = {}
    for times, margins in _chunks(problem, coefficients, fine_times(problem, rate)):
        for constraint, margin in zip(problem.constraints, margins, strict=True):
            worst = constraint.worst(margin, times)
            before = found.get(constraint.name)
            found[constraint.name] = worst if before is None else before.with_later(worst)
    return found


def proved_constraints(problem: Problem, coefficients: Array) -> dict[str, bool]:
    """Whether each constraint holds at every instant, not only at those sampled.

    Joint bounds of a Fourier series: with M samples of one period, max |p| is at most
    max_i |p(t_i)| / cos(πN/M), p being the deviation from the middle of the bounds; so a joint
    that is bounded on one side only is never proved.
    """
    samples = 64 * max(problem.trajectory.n_coefficients, 1)
    step = problem.trajectory.duration / samples
    factor = problem.trajectory.sampling_factor(samples, step)
    proved = dict.fromkeys((constraint.name for constraint in problem.constraints), False)
    if factor is None:
        return proved
    basis = problem.trajectory.basis(np.arange(samples, dtype=float) * step)
    states = problem.states(coefficients, basis)
    for constraint in problem.constraints:
        if isinstance(constraint, JointBound):
            lacking = constraint.margins(states) - (1.0 - factor) * constraint.scale
            both_sides = bool(np.all(constraint.two_sided))
            proved[constraint.name] = both_sides and bool(np.all(lacking >= 0))
    return proved
