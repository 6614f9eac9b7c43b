"""What checks look at: some instants of all runs, filtered as every fit filters them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import make_interp_spline

from excite_cli.identification.prepare import PreparedRun
from excite_cli.measurement.dataset import Mask
from excite_cli.robot.model import Array

LAGS = np.linspace(-0.1, 0.1, 21)  # s
FEWEST = 50  # instants in motion from which a joint can be judged


@dataclass(frozen=True)
class Samples:
    """q, v, a, tau (T, n) [rad (m), N·m (N), s]; which torques are `known`, which joints `move`.

    `known` and `moves` (T, n). `later` (K, T, n): torques that much later, at `LAGS` (K,) [s].
    `clocked`: speeds were recorded, too, which would show a clock that is off. `turns` (n,): joints
    that turn.
    """

    q: Array
    v: Array
    a: Array
    tau: Array
    later: Array
    known: Mask
    moves: Mask
    clocked: bool = False
    turns: Mask | bool = True

    def thinned(self, most: int) -> "Samples":
        """At most `most` of them, evenly spread."""
        stride = max(1, -(-len(self.q) // most))
        q, v, a, tau = (x[::stride] for x in (self.q, self.v, self.a, self.tau))
        known, moves = self.known[::stride], self.moves[::stride]
        later, rest = self.later[:, ::stride], (self.clocked, self.turns)
        return Samples(q, v, a, tau, later, known, moves, *rest)

    def torque(self, lag: float) -> Array:
        """τ (T, n) that much later [s], between the nearest `LAGS`."""
        at = float(np.interp(lag, LAGS, np.arange(len(LAGS))))
        first = min(int(at), len(LAGS) - 2)
        share = at - first
        return np.asarray((1.0 - share) * self.later[first] + share * self.later[first + 1])


def samples_of(runs: Sequence[PreparedRun], most: int, clocked: bool = False) -> Samples:
    """At most about `most` of the filtered samples of all runs in which some joint moves.

    A joint that hardly moves is not judged: none of its instants counts.
    """
    parts = []
    for run in runs:
        moves = run.usable & run.moving
        some = moves.any(axis=1)
        picks = run.averages[some]
        motion = [np.asarray(picks @ x) for x in (run.q, run.v, run.a)]
        at = np.flatnonzero(some) * run.step
        # Averages have nothing beyond what a spline through them follows.
        spline = make_interp_spline(np.arange(len(run.tau)) * run.step, run.tau, k=3)
        end = (len(run.tau) - 1) * run.step
        later = np.array([spline(np.clip(at + lag, 0.0, end)) for lag in LAGS])
        own = [*motion, run.tau[some], np.swapaxes(later, 0, 1), run.valid[some], moves[some]]
        parts.append(own)
    q, v, a, tau, shifted, known, moving = (np.concatenate(x) for x in zip(*parts, strict=True))
    whole = Samples(q, v, a, tau, np.swapaxes(shifted, 0, 1), known, moving, clocked)
    judged = whole.moves.sum(axis=0) >= FEWEST
    return replace(whole, moves=whole.moves & judged).thinned(most)
