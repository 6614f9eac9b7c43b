"""Samples that no fit may use, since the columns of some effect are wrong there."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excite_cli.effects.base import Effect
from excite_cli.robot.model import Array

_MOST = 1.0 / 3.0  # of the whole way of a run that is given up
_BELOW = 0.95  # of a level that cuts the torque: readings nearer to it, with their noise, are cut


@dataclass(frozen=True)
class LeftOut:
    """What a joint's columns depend on beside its own speed.

    `coupled` (j, k, s): the gears of joints j and k rub on v_j + s v_k, which may stick as well.
    `ways` (j, x): joint j must have gone x [rad] since the run began.
    `cuts` (j, L): torque of joint j is cut off at L [N·m], and says nothing of the robot there.
    """

    coupled: tuple[tuple[int, int, float], ...] = ()
    ways: tuple[tuple[int, float], ...] = ()
    cuts: tuple[tuple[int, float], ...] = ()

    @classmethod
    def by(cls, effects: Sequence[Effect], cutting: Sequence[Effect] = ()) -> "LeftOut":
        """What the columns of `effects` ask for, without what those that are `cutting` cut off."""
        return cls(
            tuple(sorted(shaft for effect in effects for shaft in effect.coupled_speeds())),
            tuple(sorted(way for effect in effects for way in effect.forgets_over())),
            tuple(sorted(cut for effect in cutting for cut in effect.cuts_at())),
        )

    def below_cuts(self, tau: Array) -> NDArray[np.bool_]:
        """Samples (T, n) of torques that no cut touches."""
        below = np.ones(tau.shape, dtype=bool)
        for j, level in self.cuts:
            below[:, j] &= np.abs(tau[:, j]) < _BELOW * level
        return below

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
