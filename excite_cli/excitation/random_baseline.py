"""The paper's comparison [16]: the best of many random admissible motions.

Candidates are random motions about random clear postures, each as large as the constraints let
it be. Motions are selected one after the other to lower the condition number of the stack, then
exchanged for better candidates until no exchange helps: a set of limited size, updated by motions
of better quality.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from excite_cli.constraints.base import Array
from excite_cli.criteria.base import condition_number, singular_values
from excite_cli.errors import NoAdmissibleMotionError
from excite_cli.excitation.base_motion import base_motion
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.stack import Stack
from excite_cli.excitation.start import Start, random_direction
from excite_cli.excitation.task import MotionTask

_LARGEST, _GROWTH, _STEPS = 1.5, 0.75, 14
_REFINE = 3
_EXCHANGE_ROUNDS = 10


@dataclass(frozen=True)
class RandomMotion:
    """One selected motion with the condition numbers of Table II."""

    index: int
    coefficients: Array
    condition_number: float
    stacked_condition_number: float


@dataclass(frozen=True)
class RandomBaseline:
    """The selected motions, how many candidates were drawn and how many were admissible."""

    motions: tuple[RandomMotion, ...]
    candidates: int
    admissible: int
    seconds: float


def random_baseline(
    problem: Problem,
    count: int,
    seed: int,
    candidates: int,
    seconds: float,
    report: Callable[[int, float], None],
    stack: Stack | None = None,
) -> RandomBaseline:
    """Draw at least `candidates`, and more while `seconds` last; select `count` motions.

    `report(drawn, best)` is called after every candidate with the best condition number so far.

    Raises
    ------
    NoAdmissibleMotionError
        Not one candidate is admissible.
    """
    began = time.perf_counter()
    task = MotionTask(problem, stack)
    start = base_motion(task, seed)
    rng = np.random.default_rng((seed, 16))
    found: list[Array] = []
    grams: list[Array] = []
    drawn, best = 0, float("inf")
    prior = task.stack.factor.T @ task.stack.factor
    while drawn < candidates or time.perf_counter() - began < seconds:
        drawn += 1
        x = _candidate(task, start, rng)
        if x is None:
            continue
        block = task.objective.block(task.coefficients(x))
        found.append(x)
        grams.append(block.T @ block)
        best = min(best, _condition(prior + grams[-1]))
        report(drawn, best)
    if not found:
        raise NoAdmissibleMotionError(f"None of {drawn} random motions is admissible.")
    chosen = _select(np.array(grams), prior, min(count, len(found)))
    return RandomBaseline(
        _as_motions(task, [found[i] for i in chosen]),
        drawn,
        len(found),
        time.perf_counter() - began,
    )


def _candidate(task: MotionTask, start: Start, rng: np.random.Generator) -> Array | None:
    """A random motion, scaled to the largest amplitude that is admissible."""
    standing = start.base if task.problem.boundary.given else _drawn_posture(task, start, rng)
    direction = random_direction(task, rng, slow=rng.uniform())
    amplitude = _LARGEST
    for _ in range(_STEPS):
        if _admissible(task, standing + amplitude * direction):
            break
        amplitude *= _GROWTH
    else:
        return None
    low, high = amplitude, amplitude / _GROWTH
    for _ in range(_REFINE):
        middle = (low + high) / 2
        low, high = (
            (middle, high) if _admissible(task, standing + middle * direction) else (low, middle)
        )
    return standing + low * direction


def _drawn_posture(task: MotionTask, start: Start, rng: np.random.Generator) -> Array:
    """Standing at a random admissible posture, or at that of the start."""
    posture, limits = start.posture, task.problem.robot.limits
    lower, upper = (
        np.maximum(limits.lower, posture - np.pi),
        np.minimum(limits.upper, posture + np.pi),
    )
    centre = posture + rng.uniform(0.0, 0.5) * (rng.uniform(lower, upper) - posture)
    standing = task.variables(task.problem.still(centre))
    return standing if _admissible(task, standing) else start.base


def _admissible(task: MotionTask, x: Array) -> bool:
    """Whether every residual is kept; constraints after the first broken one are not evaluated."""
    states = task.states(x)
    for constraint, guard in zip(task.problem.constraints, task.guards, strict=True):
        if np.any(constraint.margins(states) < guard):
            return False
    return True


def _condition(gram: Array) -> float:
    squares = np.linalg.eigvalsh(gram)
    return float(np.sqrt(squares[-1] / squares[0])) if squares[0] > 0 else float("inf")


def _best(grams: Array, base: Array) -> tuple[int, float]:
    """The candidate that gives the lowest condition number on top of `base`."""
    squares = np.linalg.eigvalsh(base + grams)
    smallest = np.maximum(squares[:, 0], 1e-300)
    ratios = np.sqrt(squares[:, -1] / smallest)
    index = int(np.argmin(ratios))
    return index, float(ratios[index])


def _select(grams: Array, prior: Array, count: int) -> list[int]:
    """Indices of the selected candidates, in the order of the stack."""
    chosen: list[int] = []
    total = prior
    for _ in range(count):
        index, value = _best(grams, total)
        chosen.append(index)
        total = total + grams[index]
    for _ in range(_EXCHANGE_ROUNDS):
        changed = False
        for slot in range(count):
            rest = total - grams[chosen[slot]]
            index, better = _best(grams, rest)
            if better < value * (1 - 1e-9):
                chosen[slot], total, value, changed = index, rest + grams[index], better, True
        if not changed:
            break
    return _ordered(grams, prior, chosen)


def _ordered(grams: Array, prior: Array, chosen: list[int]) -> list[int]:
    """The chosen motions so that the stack is as good as can be from the first on."""
    left, order, total = list(chosen), [], prior
    while left:
        index, _ = _best(grams[left], total)
        order.append(left.pop(index))
        total = total + grams[order[-1]]
    return order


def _as_motions(task: MotionTask, chosen: list[Array]) -> tuple[RandomMotion, ...]:
    motions, stack = [], task.stack
    for number, x in enumerate(chosen, start=1):
        coefficients = task.coefficients(x)
        block = task.objective.block(coefficients)
        stack = stack.with_rows(block)
        motions.append(
            RandomMotion(
                number,
                coefficients,
                condition_number(singular_values(block)),
                condition_number(singular_values(stack.factor)),
            )
        )
    return tuple(motions)
