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

    With `polish` the start is nearly optimal: only the last stage of the continuation is run.
    """

    max_iterations: int
    max_seconds: float
    tolerance: float
    polish: bool = False


class Solver(ABC):
    """A way to minimise the criterion of a `MotionTask` within its residuals."""

    name: str

    @abstractmethod
    def solve(
        self, task: MotionTask, x: Array, effort: Effort, report: ProgressCallback
    ) -> Outcome:
        """Improve the admissible point `x` (size,); what is returned is admissible too."""
