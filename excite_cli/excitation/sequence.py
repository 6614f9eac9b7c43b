"""Motions one after the other, each with all earlier ones stacked as C_0 (Eq. 41, section IV.B)."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from excite_cli.excitation.generate import generate_motion
from excite_cli.excitation.motion import Motion
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.progress import ProgressCallback
from excite_cli.excitation.solvers.base import Solver
from excite_cli.excitation.stack import Stack
from excite_cli.trajectory.fade import Segment
from excite_cli.workers.base import Workers


@dataclass(frozen=True)
class Step:
    """A finished motion and the stack that includes it."""

    motion: Motion
    stack: Stack


def generate_sequence(
    problem: Problem,
    solver: Solver,
    stack: Stack,
    indices: range,
    seed: int,
    report: Callable[[int], ProgressCallback],
    starts: Sequence[Segment] = (),
    workers: Workers | None = None,
) -> Iterator[Step]:
    """Yield motions `indices` (counted from 1), starting on top of `stack`.

    Each motion depends on the stack, the seed and its index only, so a sequence that is resumed
    from a stored stack goes on to the same numbers. `report(index)` gives the progress callback.
    Motion k starts its search from the k-th of `starts`, as far as there are any. The starts of a
    motion are spread over `workers` (default: done here).
    """
    objective = problem.objective()
    for index in indices:
        given = starts[index - 1] if index <= len(starts) else None
        told = report(index)
        motion = generate_motion(problem, solver, stack, index, seed, told, given, workers)
        stack = stack.with_rows(objective.block(motion.coefficients))
        yield Step(motion, stack)
