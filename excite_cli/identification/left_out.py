"""Samples that no fit may use, since the columns of some effect are wrong there."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excite_cli.effects.base import Effect
from excite_cli.robot.model import Array

_MOST = 1.0 / 3.0  # of the whole way of a run that is given up


@dataclass(frozen=True)
class LeftOut:
    """What a joint's columns depend on beside its own speed.

    `coupled` (j, k, s): the gears of joints j and k rub on v_j + s v_k, which may stick as well.
    `ways` (j, x): joint j must have gone x [rad] since the run began.
    """

    coupled: tuple[tuple[int, int, float], ...] = ()
    ways: tuple[tuple[int, float], ...] = ()

    @classmethod
    def by(cls, effects: Sequence[Effect]) -> "LeftOut":
        """What the columns of `effects` ask for."""
        return cls(
            tuple(sorted(shaft for effect in effects for shaft in effect.coupled_speeds())),
            tuple(sorted(way for effect in effects for way in effect.forgets_over())),
        )

    def on_the_way(self, q: Array, past: Array) -> NDArray[np.bool_]:
        """Samples (T, n) of positions in which every joint has gone its way, the `past` (L, n) too.

        Of a run that hardly goes further, a third of its way is enough.
        """
        there = np.ones(q.shape, dtype=bool)
        for j, way in self.ways:
            whole = np.concatenate([past[:, j], q[:, j]])
            gone = np.cumsum(np.abs(np.diff(whole, prepend=whole[:1])))[len(past) :]
            there[:, j] &= gone >= min(way, gone[0] + _MOST * (gone[-1] - gone[0]))
        return there
