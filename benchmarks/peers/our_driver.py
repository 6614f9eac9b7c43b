"""This program on the problem of a config, with a note of every point whose cost it computes.

    python -m benchmarks.peers.our_driver request.json answer.npz

A process of its own, as FIGAROH's driver is. The clock starts when the problem is built; what was
spent until then (Python, imports, the robot, capsules from the cache) is told beside it. Searching
the start and proving the result are on the clock.
"""

import json
import sys
import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from excite_cli import load_problem
from excite_cli.constraints.base import Array
from excite_cli.criteria.base import Criterion
from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.regressor import Regressor
from excite_cli.errors import NoAdmissibleMotionError
from excite_cli.excitation.objective import Evaluation, Objective, Stack
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.sequence import generate_motion
from excite_cli.excitation.solvers.interior_point import InteriorPoint

# The step of the paper, and of FIGAROH.
STEP = 1e-6


class Clock:
    """Notes (wall, processor [s], condition number, coefficients) since the clock was started."""

    def __init__(self) -> None:
        self.notes: list[tuple[float, float, float, Array]] = []
        self.before = time.process_time()
        self._wall = time.perf_counter()

    def read(self) -> tuple[float, float]:
        """Wall and processor time since the start [s]."""
        return time.perf_counter() - self._wall, time.process_time() - self.before

    def note(self, condition_number: float, coefficients: Array) -> None:
        self.notes.append((*self.read(), condition_number, np.array(coefficients)))


class TimedObjective(Objective):
    """The program's objective, with a note of every point."""

    clock: Clock

    def evaluation(self, coefficients: Array, criterion: Criterion) -> Evaluation:
        found = super().evaluation(coefficients, criterion)
        self.clock.note(found.spectrum.condition_number, coefficients)
        return found


class DifferencedObjective(TimedObjective):
    """The same cost with forward differences for its gradient, one for every free variable.

    free (K, K'): directions in which the boundary lets the coefficients of a joint change.
    """

    free: Array

    def evaluation(self, coefficients: Array, criterion: Criterion) -> Evaluation:
        spectrum = self.spectrum(self.block(coefficients))
        value = criterion.value(spectrum.sigma)
        self.clock.note(spectrum.condition_number, coefficients)

        def differences() -> Array:
            slopes = np.empty((self.free.shape[1], coefficients.shape[1]))
            for direction, joint in np.ndindex(*slopes.shape):
                moved = coefficients.copy()
                moved[:, joint] += STEP * self.free[:, direction]
                slopes[direction, joint] = (self.value(moved, criterion) - value) / STEP
            return np.asarray(np.linalg.pinv(self.free).T @ slopes)

        return Evaluation(value, spectrum, differences)


@dataclass(frozen=True, repr=False)
class TimedProblem(Problem):
    """A problem whose objectives write notes."""

    clock: Clock = field(default_factory=Clock)
    kind: type[TimedObjective] = TimedObjective

    def objective(self, stack: Stack | None = None) -> Objective:
        found = self.kind(
            self.robot, self.base, self.weighting, self.cost_basis, stack, self.extension
        )
        found.clock = self.clock
        if isinstance(found, DifferencedObjective):
            found.free = self.boundary.free
        return found


def with_columns(problem: Problem, selection: list[int]) -> Problem:
    """The problem with other columns of Y for its base parameters, so that two programs judge the
    same matrix."""
    random = np.random.default_rng(0)
    q, v, a = random.uniform(-np.pi, np.pi, (3, 200, problem.robot.n))
    y = Regressor(problem.robot).evaluate(q, v, a)
    y = y.reshape(-1, y.shape[2])
    mapping, _, rank, _ = np.linalg.lstsq(y[:, selection], y, rcond=None)
    if rank < problem.base.rank:
        raise ValueError("these columns do not span all base parameters")
    base = problem.base
    return replace(
        problem,
        base=BaseParameters(
            np.array(selection), np.array(mapping, float), base.names, base.residual, base.gap
        ),
    )


def timed(problem: Problem, gradient: str, clock: Clock) -> TimedProblem:
    fields = {name: getattr(problem, name) for name in Problem.__dataclass_fields__}
    kind = DifferencedObjective if gradient == "differences" else TimedObjective
    return TimedProblem(**fields, clock=clock, kind=kind)


def solve(request: dict[str, Any]) -> dict[str, Any]:
    """One motion from one seed, and how it came about."""
    problem = load_problem(request["config"], request["overrides"])
    if request["columns"] is not None:
        problem = with_columns(problem, request["columns"])
    clock = Clock()
    run = timed(problem, request["gradient"], clock)
    status, proved, final = "", False, None
    try:
        motion = generate_motion(
            run, InteriorPoint(), Stack.empty(run.columns), 1,
            request["seed"], lambda progress: None,
        )  # fmt: skip
        status, final = motion.status, motion.coefficients
        proved = all(motion.certified.values())
    except NoAdmissibleMotionError as error:
        status = str(error)
    wall, processor = clock.read()
    answer: dict[str, Any] = {
        "notes": np.array([note[:3] for note in clock.notes]).reshape(-1, 3),
        "coefficients": np.array([note[3] for note in clock.notes]),
        "status": np.array(status),
        "proved": np.array(proved),
        "wall": np.array(wall),
        "processor": np.array(processor),
        "processor_before": np.array(clock.before),
    }
    return answer if final is None else answer | {"final": final}


def main() -> None:
    request = json.loads(Path(sys.argv[1]).read_text())
    with threadpool_limits(1):
        np.savez(sys.argv[2], **solve(request))


if __name__ == "__main__":
    main()
