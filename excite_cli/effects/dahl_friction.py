"""Dry friction with memory (Dahl, LuGre): after a reversal it builds up over a distance.

With the bristle state z, s the direction of motion, d the `distance` and r the `damping`,

    τ_j = f (z − sgn v_j)(1 − r |v_j|),    dz = (s − z) |dq_j| / d.

r is zero for Dahl's friction. LuGre's (Canudas de Wit et al. 1995) has a bristle of stiffness
σ₀ = f/d that is damped by σ₁ = f r, with the torque σ₁ (s − z) |v|: the faster a reversal, the more
of the memory is gone. r and d are nearly what data show apart; a time constant r d is not.

It deviates from the Coulomb friction beside it, and vanishes in steady sliding: Coulomb friction
stays what data sheets say. Friction that is f z altogether, Dahl's solid friction of exponent one
with the stiffness σ = f/d at a reversal, is Coulomb friction of size f and this of size f. After a
reversal from steady sliding z = s (1 − 2 e^(−x/d)), x the way since. As z itself nearly all of it
would be Coulomb friction for a short d, and what is its own too small a share to be tested.

Along a way Δ without a reversal the solution is exact, however long it is,

    z_{k+1} = s_k + (z_k − s_k) e^(−|Δ_k|/d),

and where the joint reverses between two samples, it turns where evenly changing speed lets it.

s is smoothed as for all friction (`smooth_sign` of Δ over the time step), and |Δ| likewise with a
larger width, lest noise around a standstill wear the memory off: of 10 s with a noise of one in
2^16 counts, 4 % at d = 10 mrad (with the sign's width 28 %; where positions are filtered at 40
instead of 10 Hz, 89 %). A record that begins in motion is taken to have slid before (z = s), one
that begins at rest to be relaxed (z = 0), and fits leave out what comes before either is forgotten.
A block of a record begins with what was before it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from excite_cli.effects.base import (
    Abscissa,
    Cotangents,
    Effect,
    Parameter,
    Signals,
    Value,
)
from excite_cli.effects.mechanism import real
from excite_cli.effects.sign import WIDTH, sign_width, smooth_sign, smooth_sign_slope
from excite_cli.effects.simulated_robot import SimulatedRobot
from excite_cli.robot.model import Array, Robot

_DISTANCES = 5e-4, 0.5  # rad
# Dampings that are tried, in units of one over the speed at which a joint comes through the
# distance after a reversal, and distances with each: one without damping is too short for it by up
# to five, and no step of one of them alone leads out of that.
_DAMPINGS = 0.25, 0.5, 1.0
_LONGER = 1.0, 2.0, 4.0
_RATIOS = 0.5, 0.8, 1.25, 2.0  # of distance and damping at once, where there is one
# χ²: as for other parameters. Without it KR300's split A was left with 6.3 % for 5.8.
_OF_DAMPING = 4.0
_SHARES = np.geomspace(1e-3, 0.25, 7)  # of the range; neighbours overlap by 0.9
_STANDING = 0.01  # rad/s: less may be noise
_SLIDING = 0.02  # rad/s at which a record that begins so fast has slid before
_FORGOTTEN = 4.0  # distances
_DRAWN = 6.0  # distances beyond which nothing is left of a reversal


class DahlFriction(Effect):
    """τ_j = f (z − sgn v_j)(1 − r |v_j|), f ≥ 0, z following the direction over `distance`."""

    kind: ClassVar = "dahl_friction"
    over_time: ClassVar = True
    title: ClassVar = "dry friction with memory (Dahl, LuGre)"
    signature: ClassVar = "after a reversal friction builds up over a distance instead of jumping"
    function_of: ClassVar = ("speed",)
    friction: ClassVar = True
    parameters: ClassVar = (
        Parameter("friction", "N·m", 0.05, 300.0, nonnegative=True, part_of_torque=True),
    )
    shapes: ClassVar = (
        Parameter("distance", "rad", *_DISTANCES),
        Parameter("damping", "s/rad", 0.0, 20.0, nonnegative=True),
    )
    # Where friction stands far above the noise, a few per cent of it are seen.
    finer_ratios: ClassVar = (1.4, 1.25, 1.15, 1.08, 1.03, 1.01)
    defaults: ClassVar = {"distance": 0.03, "damping": 0.0}
    prior_cost: ClassVar = 2.0
    refines: ClassVar = ("coulomb_friction",)
    takes_from: ClassVar = ("coulomb_friction",)

    @property
    def shape_cost(self) -> float:
        """A damping is one more parameter."""
        return _OF_DAMPING if self._damping else 0.0

    @classmethod
    def grid(cls, robot: Robot, joints: tuple[int, ...], signals: Sequence[Signals]) -> list[dict]:
        """Seven distances from 0.1 to 25 % of the travelled range, within 0.5 mrad to 0.5 rad.

        A damping is sought once the friction is found.
        """
        q = [s.q[:, joints[0]] for s in signals if len(s.q)]
        travelled = max(x.max() for x in q) - min(x.min() for x in q) if q else 1.0
        distances = np.unique(np.clip(_SHARES * travelled, *_DISTANCES))
        return [{"distance": float(distance), "damping": 0.0} for distance in distances]

    def shapes_near(self, signals: Sequence[Signals]) -> list[dict]:
        """Without a damping, some with one; with one, none, and both shapes changed at once."""
        widest = _DISTANCES[1]
        near = [each for each in super().shapes_near(signals) if each["distance"] <= widest]
        distance, known = self.shape["distance"], self._damping
        if known:
            both = [(a * distance, b * known) for a in _RATIOS for b in _RATIOS]
            return near + [
                {"distance": d, "damping": r} for d, r in [*both, (distance, 0.0)] if d <= widest
            ]
        reversing = np.sqrt(2.0 * self._acceleration(signals) * distance)
        return near + [
            {"distance": longer * distance, "damping": float(damping / reversing)}
            for longer in _LONGER
            for damping in _DAMPINGS
            if reversing > 0.0 and longer * distance <= widest
        ]

    def _acceleration(self, signals: Sequence[Signals]) -> float:
        """RMS [rad/s²]."""
        every = np.concatenate([s.a[:, self.joints[0]] for s in signals])
        return float(np.sqrt(np.mean(np.square(every)))) if len(every) else 0.0

    def forgets_over(self) -> tuple[tuple[int, float], ...]:
        """Four distances: of what was before a record, 2 % are left then."""
        return tuple((j, _FORGOTTEN * self.shape["distance"]) for j in self.joints)

    def columns(self, signals: Signals) -> Array:
        """(z − sgn v_j)(1 − r |v_j|), (T, 1, 1)."""
        j = self.joints[0]
        v = signals.v[:, j]
        state = _Path.of(signals, j, self.shape["distance"]).state[::2][-len(signals.q) :]
        sign = smooth_sign(v)
        return ((state - sign) * (1.0 - self._damping * sign * v))[:, None, None]

    @property
    def _damping(self) -> float:
        """r [s/rad]; declared without one, none."""
        return self.shape.get("damping", 0.0)

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """f (z − sgn v_j)(1 − r |v_j|)."""
        j = self.joints[0]
        shape = (self.shape["distance"], _SLIDING, max(WIDTH, _STANDING))
        state = f"dahl(memory, {j}, {', '.join(map(real, shape))})"
        left = f" * (R(1.0) - {real(self._damping)} * s[{j}] * v[{j}])" if self._damping else ""
        return f"tau[{j}] += {real(values[0])} * ({state} - s[{j}]){left};"

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """The recursion backwards, λ_k = weight_k + ∂z_{k+1}/∂z_k λ_{k+1}, and the sign's slope.

        Of what was `before`, nothing is asked.
        """
        signals = replace(signals, before=None)
        j = self.joints[0]
        v, w = signals.v[:, j], weights[:, 0, 0]
        path = _Path.of(signals, j, self.shape["distance"])
        sign, slope = smooth_sign(v), smooth_sign_slope(v)
        left = 1.0 - self._damping * sign * v
        by_q, by_v = path.pull_back(w * left)
        change = (path.state[::2] - sign) * self._damping * (slope * v + sign)
        by_v -= w * (slope * left + change)
        return Cotangents(q=signals.only(j, by_q), v=signals.only(j, by_v))

    def abscissa(self, signals: Signals) -> Abscissa:
        """The way since the last reversal, with its sign; beyond six distances there is no more."""
        step = np.diff(signals.q[:, self.joints[0]], prepend=signals.q[:1, self.joints[0]])
        turns = np.flatnonzero(np.signbit(step[1:]) != np.signbit(step[:-1]))
        start = np.zeros(len(step), dtype=int)
        start[turns + 1] = turns
        way = signals.q[:, self.joints[0]]
        way = way - way[np.maximum.accumulate(start)]
        most = _DRAWN * self.shape["distance"]
        return Abscissa("way since the last reversal", "rad", np.clip(way, -most, most))

    def report(self, values: Array, covariance: Array) -> dict[str, Value]:
        """Also `stiffness` σ₀ = f/d, of the joint that has just been turned round.

        And `bristle_damping` σ₁ = f r, where it has one.
        """
        found = super().report(values, covariance)
        friction, distance = found["friction"], self.shape["distance"]
        found["stiffness"] = Value(friction.value / distance, friction.std / distance, "N·m/rad")
        if self._damping:
            damping = self._damping * friction.value, self._damping * friction.std
            found["bristle_damping"] = Value(*damping, "N·m·s/rad")
        return found

    def build_into(
        self, robot: SimulatedRobot, values: Array, numbers: Mapping[str, float]
    ) -> None:
        """A bristle at the joint in place of as much dry friction, which must be there."""
        for j in self.joints:
            bristle = _Bristle(float(values[0]), self.shape["distance"], self._damping)
            robot.remember(j, bristle)
            robot.add_to_joint(j, {"frictionloss": -float(values[0])})
        robot.tell_controller(self, values)


@dataclass(frozen=True)
class _Path:
    """The way of one joint through 2T−1 points, every sample and one in between, and its state z.

    Of each step Δ (2T−2,): the `sign` s and its `slope` ds/dΔ, the `kept` share k = e^(−|Δ|/d) and
    its `wear` −d ln k/dΔ. `first_slope` is dz_0/dv_0; `turning` (T−1, 3) are the derivatives of the
    points in between by the sample before, and by the speeds before and after.
    """

    sign: Array
    slope: Array
    kept: Array
    wear: Array
    state: Array
    first_slope: float
    turning: Array

    @classmethod
    def of(cls, signals: Signals, j: int, distance: float) -> "_Path":
        q, v = signals.q[:, j], signals.v[:, j]
        if signals.before is not None and len(signals.before) > 1:
            past = signals.before[:, j]
            step = float(signals.t[-1] - signals.t[-2])
            q, v = np.concatenate([past, q]), np.concatenate([np.gradient(past, step), v])
        # The last time step: a controller's clock stands before a run begins.
        step = float(signals.t[-1] - signals.t[-2]) if len(q) > 1 else 1.0
        points, turning = _with_turning_points(q, v, step)
        length = np.diff(points)
        width = 0.5 * step * sign_width()
        sign, slope = smooth_sign(length, width), smooth_sign_slope(length, width)
        width = 0.5 * step * max(sign_width(), _STANDING)
        side, change = smooth_sign(length, width), smooth_sign_slope(length, width)
        kept = np.exp(-side * length / distance)
        wear = (side + length * change) / distance
        first = smooth_sign(v[:1], _SLIDING)
        state = recursion(kept, np.concatenate([first, (1.0 - kept) * sign]))
        start = float(smooth_sign_slope(v[:1], _SLIDING).sum())
        return cls(sign, slope, kept, wear, state, start, turning)

    def pull_back(self, weights: Array) -> tuple[Array, Array]:
        """Derivatives of Σ weights ∘ z by q and v, (T,) each, for weights (T,) of the samples."""
        every = np.zeros(len(self.state))
        every[::2] = weights
        later = recursion(self.kept[::-1], every[::-1])[::-1]
        by_length = (self.sign - self.state[:-1]) * self.kept * self.wear
        by_length = later[1:] * (by_length + (1.0 - self.kept) * self.slope)
        by_point = -np.diff(by_length, prepend=0.0, append=0.0)
        between = by_point[1::2]
        by_q, by_v = by_point[::2], np.zeros(len(weights))
        by_q[:-1] += self.turning[:, 0] * between
        by_q[1:] += (1.0 - self.turning[:, 0]) * between
        by_v[:-1] += self.turning[:, 1] * between
        by_v[1:] += self.turning[:, 2] * between
        by_v[:1] += later[:1] * self.first_slope
        return by_q, by_v


def _with_turning_points(q: Array, v: Array, step: float) -> tuple[Array, Array]:
    """Samples with points in between (2T−1,), and how these follow q_k, v_k, v_{k+1}, (T−1, 3).

    Where the joint reverses within a step, that is where it turns if its speed changes evenly,
    q_k + step/2 v_k²/(v_k − v_{k+1}); elsewhere the middle, which changes nothing.
    """
    before, after = v[:-1], v[1:]
    turns = before * after < 0.0
    # Shares of the change, no more than one: speeds of 1e-160 have no squares.
    change = np.where(turns, before - after, 1.0)
    first, last = before / change, after / change
    between = np.where(turns, q[:-1] + 0.5 * step * before * first, 0.5 * (q[:-1] + q[1:]))
    points = np.empty(2 * len(q) - 1)
    points[::2], points[1::2] = q, between
    derivatives = [
        np.where(turns, 1.0, 0.5),
        0.5 * step * turns * first * (first - 2.0 * last),
        0.5 * step * turns * first**2,
    ]
    return points, np.stack(derivatives, axis=1)


def recursion(factors: Array, terms: Array) -> Array:
    """x (T,) of x_0 = terms_0, x_{k+1} = factors_k x_k + terms_{k+1}, by doubling."""
    x, factor = terms.copy(), np.concatenate([[0.0], factors])
    step = 1
    while step < len(x):
        x[step:] += factor[step:] * x[:-step]
        factor[step:] = factor[step:] * factor[:-step]
        step *= 2
    return x


class _Bristle:
    """f (z + r (s − z) |v|) of one joint of a simulated robot, r its damping."""

    def __init__(self, friction: float, distance: float, damping: float = 0.0) -> None:
        self._friction, self._distance, self._damping = friction, distance, damping
        self._q = self._z = 0.0

    def begin(self, q: float, v: float) -> None:
        """As a record begins."""
        self._q, self._z = q, float(np.tanh(v / _SLIDING))

    def torque(self, q: float, v: float) -> float:
        """At the joint's next position."""
        length = q - self._q
        side = 1.0 if (length or v) > 0.0 else -1.0
        self._z = side + (self._z - side) * float(np.exp(-abs(length) / self._distance))
        self._q = q
        return self._friction * (self._z + self._damping * (side - self._z) * abs(v))
