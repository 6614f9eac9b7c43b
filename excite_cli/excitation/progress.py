"""What solvers and searches tell while they run: numbers and kinds; words are made where shown."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum


class Status(StrEnum):
    """How a search for a motion ended, as files and JSON call it."""

    CONVERGED = "converged"
    ITERATION_LIMIT = "iteration limit"
    TIME_LIMIT = "time limit"
    STALLED = "stalled"
    INTERRUPTED = "interrupted"

    def __repr__(self) -> str:
        """As a text: lists of them are read by people."""
        return repr(self.value)

    @property
    def is_limit(self) -> bool:
        """Whether the search was cut short."""
        return self in (Status.ITERATION_LIMIT, Status.TIME_LIMIT)


class ProgressMeasure(StrEnum):
    """What is improved."""

    CONDITION_NUMBER = "condition_number"
    DIVERGENCE = "divergence"
    TORQUE_DEVIATION = "torque_deviation"


@dataclass(frozen=True)
class Figure:
    """What is improved, and where it is."""

    measure: ProgressMeasure
    value: float


@dataclass(frozen=True)
class Stage:
    """The stage of a solver's continuation, from 1; stage 0 is a start that has ended."""

    number: int = 0
    total: int = 0


@dataclass(frozen=True)
class Starts:
    """How far the starts of a motion are: done, running, and how many there are.

    `iterations` are those of all of them; a start that has ended counts with the most it may take.
    """

    done: int
    running: int
    total: int
    iterations: int


@dataclass(frozen=True)
class Progress:
    """What a solver tells while it runs; `worst_margin` is the smallest, in its own unit.

    `starts`: where there is more than one.
    """

    iteration: int
    figure: Figure
    worst_margin: float
    seconds: float
    stage: Stage
    starts: Starts | None = None


ProgressCallback = Callable[[Progress], None]


# What a search tells, in words.


def figure_in_words(figure: Figure) -> str:
    """What is improved, briefly: `cond 5.48`."""
    if figure.measure is ProgressMeasure.CONDITION_NUMBER:
        return f"cond {figure.value:.2f}"
    if figure.measure is ProgressMeasure.TORQUE_DEVIATION:
        return f"torque to {figure.value:.3g} of a sample's noise"
    return f"divergence {figure.value:.3g}"
