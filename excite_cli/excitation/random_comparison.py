"""Optimised motions beside the best of many random ones."""

from dataclasses import dataclass

from excite_cli.excitation.random_baseline import RandomBaseline
from excite_cli.excitation.result import Result
from excite_cli.shown.record import Shown


@dataclass(frozen=True, repr=False)
class Comparison(Shown):
    """The `result` with the random motions in it, and how these were drawn."""

    result: Result
    baseline: RandomBaseline

    @property
    def seconds(self) -> float:
        """What the optimiser took [s]."""
        return sum(motion.seconds for motion in self.result.motions)
