"""The same path, slower: speeds fall with the pace c, accelerations with its square.

With |v_j(t)| ≤ share·v_max,j and |a_j(t)| ≤ share·a_max,j required at every instant,

    c = min(1, min_j share·v_max,j / max_t|v_j|, min_j √(share·a_max,j / max_t|a_j|))

The largest speeds and accelerations are bounds over whole intervals of time (Taylor models), so
that the limits hold between samples too. Torques of rigid bodies, τ = τ_g + c²·(τ₁ − τ_g),
lie between those of standing still at the same posture, τ_g, and those of the original, τ₁: a slow
motion can break a bound on torque only where standing still breaks it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from excite_cli.constraints.base import Array, Constraint
from excite_cli.constraints.joint_columns import Quantity
from excite_cli.errors import ConfigError
from excite_cli.proof.enclosed_trajectory import Intervals, enclosed_states, intervals_of
from excite_cli.trajectory.base import Trajectory
from excite_cli.trajectory.fade import Chain

# A share of the limits below which a motion takes hours, and no memory holds its instants.
_LEAST = 1e-3
_INTERVALS = 2000  # in a motion, or one for each of its smooth pieces
_CHUNK = 4000


@dataclass(frozen=True)
class PaceLimits:
    """Largest speed and acceleration (n,) of every joint, infinite where there is no bound."""

    velocity: Array
    acceleration: Array

    @classmethod
    def of(cls, constraints: Sequence[Constraint], n: int) -> "PaceLimits":
        """From the joint bounds among `constraints`; the nearer one where two sides differ."""
        found = {Quantity.VELOCITY: np.full(n, np.inf), Quantity.ACCELERATION: np.full(n, np.inf)}
        for constraint in constraints:
            columns = constraint.linear
            if columns is not None and columns.quantity in found:
                np.minimum.at(found[columns.quantity], columns.joints, columns.bounds)
        return cls(found[Quantity.VELOCITY], found[Quantity.ACCELERATION])


def slowing(limits: PaceLimits, trajectory: Trajectory, coefficients: Array, share: float) -> float:
    """The pace c, at most 1, at which speeds and accelerations keep `share` of their limits.

    Raises
    ------
    ConfigError
        `share` is not between `_LEAST` and 1, or no joint has a limit.
    """
    if not _LEAST <= share <= 1.0:
        raise ConfigError(f"--slow {share:g}: give a share of the limits from {_LEAST:g} to 1.")
    both = np.concatenate([limits.velocity, limits.acceleration])
    if not np.isfinite(both).any():
        raise ConfigError(
            "--slow: the config gives no limits of speed or acceleration to keep a share of. Set "
            "constraints.joint_limits.velocity or .acceleration."
        )
    velocity, acceleration = largest(trajectory, coefficients)
    with np.errstate(divide="ignore"):
        by_speed = share * limits.velocity / velocity
        by_acceleration = np.sqrt(share * limits.acceleration / acceleration)
    return float(min(1.0, by_speed.min(), by_acceleration.min()))


def slowed_chain(limits: PaceLimits, chain: Chain, share: float) -> tuple[Chain, float]:
    """All segments at the pace of the one that must go slowest, so that they still join; the pace.

    Raises
    ------
    ConfigError
        As `slowing`.
    """
    different = {id(segment): segment for segment in chain.segments}.values()
    pace = min(slowing(limits, each.trajectory, each.coefficients, share) for each in different)
    segments = (replace(s, trajectory=s.trajectory.slowed(pace)) for s in chain.segments)
    return Chain(tuple(segments)), pace


def largest(trajectory: Trajectory, coefficients: Array) -> tuple[Array, Array]:
    """Bounds (n,) on the speed and acceleration of every joint, at every instant."""
    intervals = intervals_of(trajectory, trajectory.duration / _INTERVALS)
    velocity, acceleration = np.zeros((2, coefficients.shape[1]))
    for begin in range(0, len(intervals), _CHUNK):
        some: Intervals = intervals.only(slice(begin, begin + _CHUNK))
        states = enclosed_states(trajectory, coefficients, some)
        for found, enclosed in ((velocity, states.v), (acceleration, states.a)):
            size = np.maximum(np.abs(enclosed.upper()), np.abs(enclosed.lower()))
            np.maximum(found, size.max(axis=0), out=found)
    return velocity, acceleration
