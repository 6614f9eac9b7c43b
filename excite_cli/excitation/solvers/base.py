"""The family of solvers: from an admissible start to a better admissible motion."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

from excite_cli.constraints.base import Array
from excite_cli.excitation.motion import Outcome
from excite_cli.excitation.progress import ProgressCallback
from excite_cli.excitation.task import MotionTask


@dataclass(frozen=True)
class Effort:
    """When a solver stops: iterations, seconds, change of the criterion at which it has converged.

    Of the stages of its continuation those from `first` on are run, up to `last` (excluded; None:
    to the end).
    """

    max_iterations: int
    max_seconds: float
    tolerance: float
    first: int = 0
    last: int | None = None


class CutShortError(KeyboardInterrupt):
    """Ctrl-C while a solver runs; `outcome` is the best admissible point so far."""

    def __init__(self, outcome: Outcome) -> None:
        super().__init__()
        self.outcome = outcome


class Solver(ABC):
    """A way to minimise the criterion of a `MotionTask` within its residuals."""

    name: str
    told_apart: tuple[int, ...] = ()
    """After how many stages it shows which starts are worth going on with."""
    polish: int = 0
    """The stage from which to go on with a motion that is nearly optimal."""

    @abstractmethod
    def solve(
        self,
        task: MotionTask,
        x: Array,
        effort: Effort,
        report: ProgressCallback,
        memory: Array | None = None,
    ) -> Outcome:
        """Improve the admissible point `x` (size,); what is returned is admissible too.

        `memory`: that of the outcome that it goes on from.

        Raises
        ------
        CutShortError
            It was interrupted.
        """
