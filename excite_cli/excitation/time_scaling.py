"""The same path, slower: its derivative of order k falls with the power k of the pace c.

With |x_j(t)| ≤ share·x_max,j required of speeds, accelerations and jerks at every instant,

    c = min(1, min_{k,j} (share·x_max,kj / max_t|x_kj|)^(1/k)),      k = 1, 2, 3

The largest derivatives are bounds over whole intervals of time (Taylor models), so that the limits
hold between samples too. Torques of rigid bodies, τ = τ_g + c²·(τ₁ − τ_g),
lie between those of standing still at the same posture, τ_g, and those of the original, τ₁: a slow
motion can break a bound on torque only where standing still breaks it (or, of a motor that has less
torque at speed, would break it with that of the motion's speed).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from excite_cli.constraints.base import Array, Constraint
from excite_cli.constraints.joint_columns import Quantity
from excite_cli.errors import ConfigError
from excite_cli.proof.enclosed_motion import Intervals, enclosed_states, intervals_of
from excite_cli.trajectory.base import Trajectory
from excite_cli.trajectory.fade import Chain

# A share of the limits below which a motion takes hours, and no memory holds its instants.
_LEAST = 1e-3
_INTERVALS = 2000  # in a motion, or one for each of its smooth pieces
_CHUNK = 4000


@dataclass(frozen=True)
class PaceLimits:
    """Largest speed, acceleration and jerk (3, n) of joints, infinite where there is no bound."""

    largest: Array

    @classmethod
    def of(cls, constraints: Sequence[Constraint], n: int) -> "PaceLimits":
        """From the joint bounds among `constraints`; the nearer one where two sides differ."""
        found = np.full((3, n), np.inf)
        for constraint in constraints:
            columns = constraint.linear
            if columns is not None and columns.quantity != Quantity.POSITION:
                np.minimum.at(found[columns.quantity - 1], columns.joints, columns.bounds)
        return cls(found)


def slowing(limits: PaceLimits, trajectory: Trajectory, coefficients: Array, share: float) -> float:
    """The pace c, at most 1, at which derivatives keep `share` of their limits.

    Raises
    ------
    ConfigError
        `share` is not between `_LEAST` and 1, or no joint has a limit.
    """
    if not _LEAST <= share <= 1.0:
        raise ConfigError(f"--slow {share:g}: give a share of the limits from {_LEAST:g} to 1.")
    if not np.isfinite(limits.largest).any():
        raise ConfigError(
            "--slow: the config gives no limits of speed, acceleration or jerk to keep a share of. "
            "Set constraints.joint_limits.velocity, .acceleration or .jerk."
        )
    with np.errstate(divide="ignore"):
        allowed = share * limits.largest / largest(trajectory, coefficients)
    return float(min(1.0, (allowed ** (1 / np.arange(1, 4))[:, None]).min()))


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


def largest(trajectory: Trajectory, coefficients: Array) -> Array:
    """Bounds (3, n) on the speed, acceleration and jerk of every joint, at every instant."""
    intervals = intervals_of(trajectory, trajectory.duration / _INTERVALS)
    found = np.zeros((3, coefficients.shape[1]))
    for begin in range(0, len(intervals), _CHUNK):
        some: Intervals = intervals.only(slice(begin, begin + _CHUNK))
        states = enclosed_states(trajectory, coefficients, some)
        for order in (1, 2, 3):
            enclosed = states.order(order)
            size = np.maximum(np.abs(enclosed.upper()), np.abs(enclosed.lower()))
            np.maximum(found[order - 1], size.max(axis=0), out=found[order - 1])
    return found
