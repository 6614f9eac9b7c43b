"""What a contestant did: its curve over time, its best motion, and what it told."""

from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np

from excite_cli.constraints.base import Array


@dataclass(frozen=True)
class States:
    """t (T,) [s] and q, v, a (T, n) of a motion."""

    t: Array
    q: Array
    v: Array
    a: Array


class Measure(IntEnum):
    """Whose columns are called base parameters, as columns of a curve."""

    FIGAROH = 2
    EXCITE = 3

    @property
    def words(self) -> str:
        return {Measure.FIGAROH: "FIGAROH's", Measure.EXCITE: "excite's"}[self]


@dataclass(frozen=True)
class Race:
    """One contestant, one seed.

    curve (N, 4): wall and processor time [s] since its clock started and condition number by
    FIGAROH's columns and by excite's, a row for every admissible motion that was better than all
    before in either.
    `wall`, `processor`: of the whole search; `before`: processor time until the clock started.
    fine: its best admissible motion at 1 kHz; None where it has none. samples: the same at the
    instants of the cost. `words`: what else is to be told.
    """

    contestant: str
    seed: int
    curve: Array
    wall: float
    processor: float
    before: float
    fine: States | None = None
    samples: States | None = None
    columns: tuple[int, ...] | None = None
    proved: bool = False
    words: dict[str, float | str] = field(default_factory=dict)

    def best(self, measure: Measure) -> float:
        """Its lowest admissible condition number; infinite where it found no motion."""
        return float(self.curve[:, measure].min()) if len(self.curve) else np.inf

    def reached(self, target: float, measure: Measure) -> tuple[float, float]:
        """Wall and processor time [s] at which `target` was reached; infinite where it was not."""
        there = np.flatnonzero(self.curve[:, measure] <= target * (1 + 1e-12))
        if not len(there):
            return np.inf, np.inf
        wall, processor = self.curve[there[0], :2].tolist()
        return wall, processor

    def at(self, processor: float, measure: Measure) -> float:
        """Lowest condition number after so much processor time [s]."""
        there = self.curve[self.curve[:, 1] <= processor, measure]
        return float(there.min()) if len(there) else np.inf
