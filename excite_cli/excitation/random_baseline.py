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
from excite_cli.errors import ConfigError, NoAdmissibleMotionError
from excite_cli.excitation.base_motion import base_motion
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.stack import Stack
from excite_cli.excitation.start import Start, random_direction
from excite_cli.excitation.task import MotionTask
from excite_cli.workers.base import News, Tell, Workers
from excite_cli.workers.here import Here

_LARGEST, _GROWTH, _STEPS = 1.5, 0.75, 14
_REFINE = 3
_EXCHANGE_ROUNDS = 10
# Candidates that one task draws: enough that handing them out costs nothing.
_BATCH = 4
# What tells the random numbers of candidates from those of starts.
_STREAM = 16
_MOST_CANDIDATES, _MOST_BYTES = 1_000_000, 8 * 10**9


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
    workers: Workers | None = None,
) -> RandomBaseline:
    """Draw at least `candidates`, and more while `seconds` last; select `count` motions.

    Candidate k depends on (seed, k) only, so with `seconds` 0 the result is the same however many
    `workers` draw (default: all are drawn here). `report(drawn, best)` is called as candidates come
    in, with the best condition number so far.

    Raises
    ------
    ConfigError
        There would be more candidates than fit in memory.
    NoAdmissibleMotionError
        Not one candidate is admissible.
    """
    most = min(_MOST_CANDIDATES, _MOST_BYTES // (8 * problem.columns**2))
    if not 1 <= candidates <= most:
        raise ConfigError(
            f"candidates: {candidates:,} cannot be drawn; allowed: 1 to {most:,} for this robot, "
            "so that all fit in memory."
        )
    began = time.perf_counter()
    place = workers or Here()
    task = MotionTask(problem, stack)
    draw = _Draw(problem, task.stack, base_motion(task, seed), seed)
    kept: list[_Candidate] = []
    drawn, best = 0, float("inf")
    prior = task.stack.factor.T @ task.stack.factor

    def watch(news: News) -> None:
        nonlocal drawn, best
        if news.result is not None:
            found, number = news.result
            drawn += number
            best = min([best, *(each.condition_number for each in found)])
            report(drawn, best)

    wanted = candidates
    while wanted:
        first = drawn
        batches = [
            range(k, min(k + _BATCH, first + wanted)) for k in range(first, first + wanted, _BATCH)
        ]
        for found, _ in place.map(_draw_batch, draw, batches, watch):
            kept += found
        # A budget of time is spent in rounds that give every worker a batch.
        late = time.perf_counter() - began >= seconds
        wanted = 0 if late else _BATCH * place.count
    if not kept:
        raise NoAdmissibleMotionError(f"None of {drawn} random motions is admissible.")
    grams = np.array([each.gram for each in kept])
    chosen = _select(grams, prior, min(count, len(kept)))
    return RandomBaseline(
        _as_motions(task, [kept[i].x for i in chosen]),
        drawn,
        len(kept),
        time.perf_counter() - began,
    )


@dataclass(frozen=True)
class _Draw:
    """What all candidates share."""

    problem: Problem
    stack: Stack
    start: Start
    seed: int


@dataclass(frozen=True)
class _Candidate:
    """An admissible random motion: free variables, CᵀC, and the condition number with C_0."""

    x: Array
    gram: Array
    condition_number: float


def _draw_batch(draw: _Draw, numbers: range, tell: Tell) -> tuple[list[_Candidate], int]:
    """The admissible ones among the candidates of these numbers, and how many were drawn."""
    task = MotionTask(draw.problem, draw.stack)
    prior = task.stack.factor.T @ task.stack.factor
    found = []
    for number in numbers:
        x = _candidate(task, draw.start, np.random.default_rng((draw.seed, _STREAM, number)))
        if x is not None:
            block = task.objective.block(task.coefficients(x))
            gram = block.T @ block
            found.append(_Candidate(x, gram, _condition(prior + gram)))
    return found, len(numbers)


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
