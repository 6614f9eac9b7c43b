"""What a contestant did: its curve over time, its best motion, and what it told."""

from dataclasses import dataclass, field

import numpy as np

from excite_cli.constraints.base import Array


@dataclass(frozen=True)
class States:
    """t (T,) [s] and q, v, a (T, n) of a motion."""

    t: Array
    q: Array
    v: Array
    a: Array


@dataclass(frozen=True)
class Race:
    """One contestant, one seed.

    curve (N, 3): wall and processor time [s] since its clock started and condition number, a row
    for every admissible motion that was better than all before, both programs' by the same matrix.
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

    @property
    def best(self) -> float:
        """Its lowest admissible condition number; infinite where it found no motion."""
        return float(self.curve[:, 2].min()) if len(self.curve) else np.inf

    def reached(self, target: float) -> tuple[float, float]:
        """Wall and processor time [s] at which `target` was reached; infinite where it was not."""
        there = np.flatnonzero(self.curve[:, 2] <= target * (1 + 1e-12))
        if not len(there):
            return np.inf, np.inf
        wall, processor = self.curve[there[0], :2].tolist()
        return wall, processor

    def at(self, processor: float) -> float:
        """Lowest condition number after so much processor time [s]."""
        there = self.curve[self.curve[:, 1] <= processor, 2]
        return float(there.min()) if len(there) else np.inf
