"""Whether a motion keeps every constraint, judged on a grid of its own."""

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


def fine_margins(problem: Problem, coefficients: Array, times: Array) -> list[Array]:
    """Margins (T, m) of every constraint at `times`, in their own units."""
    parts: list[list[Array]] = [[] for _ in problem.constraints]
    for begin in range(0, len(times), _CHUNK):
        basis = problem.trajectory.basis(times[begin : begin + _CHUNK])
        states = problem.states(coefficients, basis)
        for part, constraint in zip(parts, problem.constraints, strict=True):
            part.append(constraint.margins(states))
    return [np.vstack(part) for part in parts]


def worst_margins(
    problem: Problem, coefficients: Array, rate: float = CONTROLLER_RATE
) -> dict[str, Worst]:
    """The worst margin of every constraint at `rate` [Hz], by the constraint's name."""
    times = fine_times(problem, rate)
    return {
        constraint.name: constraint.worst(margins, times)
        for constraint, margins in zip(
            problem.constraints, fine_margins(problem, coefficients, times), strict=True
        )
    }


def proved_constraints(problem: Problem, coefficients: Array) -> dict[str, bool]:
    """Whether each constraint holds at every instant, not only at those sampled.

    Joint bounds of a Fourier series: with M samples of one period, max |p| is at most
    max_i |p(t_i)| / cos(πN/M), p being the deviation from the middle of the bounds.
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
            proved[constraint.name] = bool(np.all(lacking >= 0))
    return proved
