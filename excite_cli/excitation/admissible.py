"""Whether a motion keeps every constraint, judged on a grid of its own."""

from collections.abc import Iterator

import numpy as np

from excite_cli.constraints.base import Array
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.excitation.problem import Problem
from excite_cli.proof.certificate import Path, ProofVerdict, Worst, certify
from excite_cli.trajectory.base import Trajectory

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
            worst = Worst.of(constraint, margin, times)
            before = found.get(constraint.name)
            found[constraint.name] = worst if before is None else before.with_later(worst)
    return found


def verdicts(problem: Problem, coefficients: Array) -> tuple[ProofVerdict, ...]:
    """What is known of every constraint of the problem between the instants of any grid."""
    return certify(path_of(problem, problem.trajectory, coefficients), problem.constraints)


def path_of(problem: Problem, trajectory: Trajectory, coefficients: Array) -> Path:
    """A motion of the problem's robot, to be judged; `trajectory` need not be the problem's."""

    def states_at(times: Array) -> States:
        return States.along(problem.kinematics, trajectory, coefficients, times)

    return Path(problem.robot, trajectory, coefficients, states_at)


def lacking_margins(problem: Problem, coefficients: Array) -> list[Array]:
    """By how much (m,) the columns of every constraint fall short somewhere; zero where they hold.

    Between all instants where constraints are certified, at controller rate where they are not, or
    where no bound between instants is known.
    """
    if not problem.spec.optimizer.certify:
        return _lacking_at_rate(problem, coefficients)
    found = verdicts(problem, coefficients)
    if all(verdict.bounded for verdict in found):
        return [verdict.lacking for verdict in found]
    sampled = _lacking_at_rate(problem, coefficients)
    return [
        verdict.lacking if verdict.bounded else lack
        for verdict, lack in zip(found, sampled, strict=True)
    ]


def _lacking_at_rate(problem: Problem, coefficients: Array) -> list[Array]:
    smallest = smallest_margins(problem, coefficients, fine_times(problem))
    return [np.maximum(-margin, 0.0) for margin in smallest]
