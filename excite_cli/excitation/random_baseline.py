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
from excite_cli.errors import ConfigError, NoAdmissibleMotionError
from excite_cli.excitation.base_motion import base_motion
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.start import Start, random_direction
from excite_cli.excitation.task import MotionTask
from excite_cli.workers.base import Here, News, Tell, Workers

_LARGEST, _GROWTH, _STEPS = 1.5, 0.75, 14
_REFINE = 3
_EXCHANGE_ROUNDS = 10
# Candidates that one task draws: enough that handing them out costs nothing.
_BATCH = 4
# What tells the random numbers of candidates from those of starts.
_STREAM = 16
_MOST_CANDIDATES, _MOST_BYTES = 1_000_000, 8 * 10**9


FiguresOf = Callable[[Array], Array]  # of Gram matrices (N, r, r), the lowest (N,) is the best


@dataclass(frozen=True)
class RandomMotion:
    """One selected motion with the condition numbers of Table II.

    `predicted_deviation`: as that of a `Motion`.
    """

    index: int
    coefficients: Array
    condition_number: float
    stacked_condition_number: float
    predicted_deviation: float | None = None


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
            best = min([best, *(each.figure for each in found)])
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
    chosen = _select(task.objective.figures_of, grams, prior, min(count, len(kept)))
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
    """An admissible random motion: free variables, CᵀC, and its figure with C_0."""

    x: Array
    gram: Array
    figure: float


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
            found.append(
                _Candidate(x, gram, float(task.objective.figures_of((prior + gram)[None])[0]))
            )
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


def _best(figures_of: FiguresOf, grams: Array, base: Array) -> tuple[int, float]:
    """The candidate whose rows are the best on top of `base`."""
    values = figures_of(base + grams)
    index = int(np.argmin(values))
    return index, float(values[index])


def _select(figures_of: FiguresOf, grams: Array, prior: Array, count: int) -> list[int]:
    """Indices of the selected candidates, in the order of the stack."""
    chosen: list[int] = []
    total = prior
    for _ in range(count):
        index, value = _best(figures_of, grams, total)
        chosen.append(index)
        total = total + grams[index]
    for _ in range(_EXCHANGE_ROUNDS):
        changed = False
        for slot in range(count):
            rest = total - grams[chosen[slot]]
            index, better = _best(figures_of, grams, rest)
            if better < value * (1 - 1e-9):
                chosen[slot], total, value, changed = index, rest + grams[index], better, True
        if not changed:
            break
    return _ordered(figures_of, grams, prior, chosen)


def _ordered(figures_of: FiguresOf, grams: Array, prior: Array, chosen: list[int]) -> list[int]:
    """The chosen motions so that the stack is as good as can be from the first on."""
    left, order, total = list(chosen), [], prior
    while left:
        index, _ = _best(figures_of, grams[left], total)
        order.append(left.pop(index))
        total = total + grams[order[-1]]
    return order


def _as_motions(task: MotionTask, chosen: list[Array]) -> tuple[RandomMotion, ...]:
    motions, stack = [], task.stack
    for number, x in enumerate(chosen, start=1):
        coefficients, objective = task.coefficients(x), task.problem.objective(stack)
        stack = objective.added_to(stack, coefficients)
        motions.append(
            RandomMotion(
                number,
                coefficients,
                objective.own_condition_number(coefficients),
                objective.stacked_condition_number(coefficients),
                objective.deviation_with(stack),
            )
        )
    return tuple(motions)
