"""The family of solvers: from an admissible start to a better admissible motion."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

from excite_cli.constraints.base import Array
from excite_cli.excitation.motion import Outcome, ProgressCallback
from excite_cli.excitation.task import MotionTask


@dataclass(frozen=True)
class Effort:
    """When a solver stops: iterations, seconds, relative change of the criterion."""

    max_iterations: int
    max_seconds: float
    tolerance: float


class Solver(ABC):
    """A way to minimise the criterion of a `MotionTask` within its residuals."""

    name: str

    @abstractmethod
    def solve(
        self, task: MotionTask, x: Array, effort: Effort, report: ProgressCallback
    ) -> Outcome:
        """Improve the admissible point `x` (size,); what is returned is admissible too."""
