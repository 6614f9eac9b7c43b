"""Records that travel from the optimiser to the file and the terminal."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

from excite_cli.constraints.base import Array
from excite_cli.proof.worst_margin import Worst

Status = Literal["converged", "iteration limit", "time limit", "stalled"]


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
    """What a solver tells while it runs; `worst` is the smallest margin, in its own unit.

    `figure` is what is improved, in words: `cond 5.48`. `starts`: where there is more than one.
    """

    iteration: int
    figure: str
    worst_name: str
    worst_margin: float
    worst_unit: str
    seconds: float
    stage: str
    starts: Starts | None = None


ProgressCallback = Callable[[Progress], None]


@dataclass(frozen=True)
class Outcome:
    """What a solver returns: the best admissible point it saw, as free variables x."""

    x: Array
    status: Status
    iterations: int
    evaluations: int


@dataclass(frozen=True)
class Motion:
    """One generated motion that keeps all constraints.

    `condition_number` is that of the motion alone, `stacked_condition_number` that of the motion
    with all earlier data; `improved` tells whether the stack became better by it; `note` says what
    else one should know; `certified` which constraints are proved at every instant.
    """

    index: int
    coefficients: Array
    condition_number: float
    stacked_condition_number: float
    improved: bool
    status: str
    seconds: float
    iterations: int
    evaluations: int
    margins: dict[str, Worst]
    note: str = ""
    certified: dict[str, bool] = field(default_factory=dict)
