"""How a robot is set up, its columns and its mount; and the instants that checks look at."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import make_interp_spline

from excite_cli.arrays import Indices, Mask
from excite_cli.effects.dahl_friction import recursion
from excite_cli.identification.prepare import PreparedRun
from excite_cli.robot.model import Array, Robot

# What checks look at: some instants of all runs, filtered as every fit filters them.

LAGS = np.linspace(-0.1, 0.1, 21)  # s
FEWEST = 50  # instants in motion from which a joint can be judged
# Ways [rad] over which friction follows a change of direction (bearings to harmonic drives), and
# [m] where joints slide. Without them friction that follows late passes for torques that are late:
# of nine simulated arms seven had none, and were told of 24 to 60 ms.
_FOLLOWS, _SLIDES = np.array([0.002, 0.01, 0.04]), 0.1


@dataclass(frozen=True)
class Samples:
    """q, v, a, tau (T, n) [rad (m), N·m (N), s]; which torques are `known`, which joints `move`.

    `bristles` (T, n, 3): directions z of friction that follows motion over some way,
    dz/dq = (sgn v − z) / way (Dahl 1968). `known` and `moves` (T, n). `later` (K, T, n): torques
    that much later, at `LAGS` (K,) [s]. `clocked`: speeds were recorded, too, which would show a
    clock that is off. `turns` (n,): joints that turn.
    """

    q: Array
    v: Array
    a: Array
    tau: Array
    bristles: Array
    later: Array
    known: Mask
    moves: Mask
    clocked: bool = False
    turns: Mask | bool = True

    def thinned(self, most: int) -> "Samples":
        """At most `most` of them, evenly spread."""
        stride = max(1, -(-len(self.q) // most))
        every = (self.q, self.v, self.a, self.tau, self.bristles)
        q, v, a, tau, bristles = (x[::stride] for x in every)
        known, moves = self.known[::stride], self.moves[::stride]
        later, rest = self.later[:, ::stride], (self.clocked, self.turns)
        return Samples(q, v, a, tau, bristles, later, known, moves, *rest)

    def torque(self, lag: float) -> Array:
        """τ (T, n) that much later [s], between the nearest `LAGS`."""
        at = float(np.interp(lag, LAGS, np.arange(len(LAGS))))
        first = min(int(at), len(LAGS) - 2)
        share = at - first
        return np.asarray((1.0 - share) * self.later[first] + share * self.later[first + 1])


def samples_of(
    runs: Sequence[PreparedRun], most: int, clocked: bool = False, sliding: Mask | bool = False
) -> Samples:
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
        bristles = np.stack([picks @ each for each in _bristles(run.q, sliding)], axis=-1)
        own = [*motion, run.tau[some], bristles, np.swapaxes(later, 0, 1)]
        parts.append([*own, run.valid[some], moves[some]])
    q, v, a, tau, bristles, shifted, known, moving = (
        np.concatenate(x) for x in zip(*parts, strict=True)
    )
    later = np.swapaxes(shifted, 0, 1)
    turns = np.broadcast_to(~np.asarray(sliding), q.shape[1])
    whole = Samples(q, v, a, tau, bristles, later, known, moving, clocked, turns)
    judged = whole.moves.sum(axis=0) >= FEWEST
    return replace(whole, moves=whole.moves & judged).thinned(most)


def _bristles(q: Array, sliding: Mask | bool) -> Iterator[Array]:
    """z (T, n) for each of the ways, along positions (T, n)."""
    steps = np.diff(q, axis=0)
    for way in _FOLLOWS:
        kept = np.exp(-np.abs(steps) / (way * np.where(sliding, _SLIDES, 1.0)))
        added = (1.0 - kept) * np.sign(steps)
        own = [recursion(kept[:, j], np.append(0.0, added[:, j])) for j in range(q.shape[1])]
        yield np.stack(own, axis=1)


Order = Indices


@dataclass(frozen=True)
class Coupling:
    """The motor of joint `own` turns with v_own + `way` · v_other."""

    other: int
    own: int
    way: float


@dataclass(frozen=True)
class Setup:
    """Column `order[j]` of the file, times `sign[j]`, is that of joint j; all (n,).

    `gravity` (3,) [m/s²] in the frame in which the config has it, `zero` [rad] added to positions,
    `unit`: N·m in one of the file, `turn`: rad in what the config takes for one, where joints turn.
    `clock`: true seconds in one of the stamps. `lag` [s] of the torque behind the positions.
    `weightless`: a controller took the weight off the torque. `loaded`: last bodies with a tool or
    a load on them. `coupled`: torques are those of motors that are coupled so.
    """

    gravity: Array
    zero: Array
    q_order: Order
    q_sign: Array
    tau_order: Order
    tau_sign: Array
    unit: Array
    turn: Array
    clock: float = 1.0
    lag: float = 0.0
    weightless: bool = False
    loaded: tuple[int, ...] = ()
    coupled: Coupling | None = None

    @classmethod
    def as_declared(cls, robot: Robot) -> "Setup":
        """As the config has it."""
        n, ones = robot.n, np.ones(robot.n)
        gravity = np.array(robot.model.gravity.linear)
        return cls(gravity, np.zeros(n), np.arange(n), ones, np.arange(n), ones, ones, ones)

    def motion(self, samples: Samples) -> tuple[Array, Array, Array]:
        """q, v, a (T, n) of the joints."""
        q, v, a = (x[:, self.q_order] * self.q_sign for x in (samples.q, samples.v, samples.a))
        unit = np.where(samples.turns, self.turn, 1.0)
        return unit * q + self.zero, unit * v / self.clock, unit * a / self.clock**2

    def of_motors(self, torque: Array) -> Array:
        """Torques (T, n, …) of the motors, from those of the joints: τ_other − way · τ_own.

        τ_m · (v_own + way · v_other) has the power of τ_own.
        """
        if self.coupled is None:
            return torque
        found = torque.copy()
        found[:, self.coupled.other] -= self.coupled.way * torque[:, self.coupled.own]
        return found

    def turned_by(self, rates: Array) -> Array:
        """Speeds or accelerations (T, n) of the motors, from those of the joints."""
        if self.coupled is None:
            return rates
        found = rates.copy()
        found[:, self.coupled.own] += self.coupled.way * rates[:, self.coupled.other]
        return found

    def bristles(self, samples: Samples) -> Array:
        """z (T, n, 3) of the joints."""
        return np.asarray(samples.bristles[:, self.q_order] * self.q_sign[:, None])

    def torque(self, samples: Samples) -> Array:
        """τ (T, n) [N·m] of the joints."""
        tau = samples.torque(self.lag) if self.lag else samples.tau
        return np.asarray(tau[:, self.tau_order] * self.tau_sign * self.unit)

    def exchanged(self, positions: Order | None = None, torques: Order | None = None) -> "Setup":
        """With columns exchanged once more; zeros stay with their joints."""
        found = self
        if positions is not None:
            own = {"q_order": self.q_order[positions], "q_sign": self.q_sign[positions]}
            found = replace(found, turn=self.turn[positions], **own)  # type: ignore[arg-type]
        if torques is not None:
            own = {"tau_order": self.tau_order[torques], "tau_sign": self.tau_sign[torques]}
            found = replace(found, unit=self.unit[torques], **own)  # type: ignore[arg-type]
        return found

    def turned(self, name: str, j: int) -> "Setup":
        """With the other sign of `q_sign` or `tau_sign` of joint j."""
        sign = getattr(self, name).copy()
        sign[j] = -sign[j]
        return replace(self, **{name: sign})

    def from_zero(self, j: int, zero: float) -> "Setup":
        """With another zero of joint j [rad]."""
        zeros = self.zero.copy()
        zeros[j] = zero
        return replace(self, zero=zeros)
