"""What residual a model allows a joint: that of its own data, carried over to another motion.

When it was made, its residual had the RMS r₀ beside torque of the RMS τ₀: on held-out data, or on
those that it was fitted to, where there is more of it. What a model lacks grows with the torque,
and so does the noise of many sensors,

    allowed = r₀ max(1, τ/τ₀).

With the noise taken to stay as it is, 2 of 120 sound simulated runs raised an alarm (ratio 1.7).
Of joints that stand or reverse only what friction cannot explain is in both (`beyond_friction`).
Residuals are serially correlated, so that samples say little of how far a mean of squares may go:
that is told by means over blocks of a second of the model's own data, whose deviation is κ of their
mean.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d

from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Signals
from excite_cli.identification.factors import Mask
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.processing import (
    DEFAULT_MOVING,
    GAUSSIAN,
    GAUSSIAN_REACH,
    Processing,
)
from excite_cli.identification.stored_model import StoredModel
from excite_cli.identification.torque_trace import TorqueTrace
from excite_cli.robot.model import Array, Robot

SECONDS = 1.0  # of a block
# More than the model's own residual: models are worse in motions that they do not know. With 1.35,
# 3 of 240 sound runs raised an alarm, with ratios up to 1.75.
TOLERATED = 1.5
_SIGMAS = 4.0  # of a mean over blocks
_PEAK = 2.5  # times the largest block of the model's own data
_LEAST_SPREAD, _FEWEST = 0.5, 4  # of blocks, relative; blocks


@dataclass(frozen=True)
class Allowance:
    """Of every joint (n,): `residual` r₀ and `torque` τ₀ when the model was made.

    `spread` κ of blocks, and the largest block's RMS over its mean (`largest`); `slowest`: the
    speed [rad/s] (m/s) below which friction is not known (`slowest_known`).
    """

    residual: Array
    torque: Array
    spread: Array
    largest: Array
    slowest: Array

    def rms(self, torque: Array) -> Array:
        """RMS (n,) of the residual that is allowed beside torque of RMS (n,)."""
        return self.residual * np.maximum(1.0, torque / np.maximum(self.torque, 1e-12))

    def most(self, blocks: int) -> Array:
        """Ratio (n,) of RMS to `rms` beyond which a run of so many blocks is out of it."""
        chance = 1.0 + _SIGMAS * self.spread / np.sqrt(max(blocks, 1))
        return TOLERATED * np.sqrt(chance)

    @property
    def most_of_a_block(self) -> Array:
        """Ratio (n,) of a block's RMS to `rms` beyond which something happened in it."""
        return _PEAK * np.maximum(self.largest, TOLERATED)


def allowance_of(stored: StoredModel) -> Allowance | None:
    """What the model allows; None where nothing is known of its errors."""
    if stored.error is None:
        return None
    names = stored.robot.joint_names
    residual = np.array([stored.error.rms.get(name, np.nan) for name in names])
    relative = np.array([stored.error.relative.get(name, np.nan) for name in names])
    with np.errstate(divide="ignore", invalid="ignore"):
        torque = np.where(relative > 0, residual / relative, np.nan)
    if not np.isfinite(torque).any():
        return None
    slowest = slowest_known(stored.traces, stored.processing, len(names))
    blocks, torques = _own_blocks(stored, stored.traces, slowest)
    apart = [each for each in stored.traces if each.held_out]
    residual, torque = _known(*_own_blocks(stored, apart, slowest), residual, torque)
    trained, beside = _known(blocks, torques, np.zeros(len(names)), torque)
    larger = trained > residual
    residual, torque = np.where(larger, trained, residual), np.where(larger, beside, torque)
    return Allowance(residual, torque, *_of_blocks(blocks, residual), slowest)


def _own_blocks(
    stored: StoredModel, traces: Sequence[TorqueTrace], slowest: Array
) -> tuple[Array, Array]:
    """Mean squares (B, n) of what is judged of the model's own residual, and of the torque."""
    none = [np.zeros((0, stored.robot.n))]

    def judged(trace: TorqueTrace) -> Array:
        return beyond_friction(stored.robot, stored.model, trace, stored.processing, slowest)

    left = [blocks_of(judged(each), each.t) for each in traces]
    torques = [blocks_of(each.measured, each.t) for each in traces]
    return np.concatenate(none + left), np.concatenate(none + torques)


def _known(blocks: Array, torques: Array, residual: Array, torque: Array) -> tuple[Array, Array]:
    """RMS (n,) over blocks (B, n), of residual and torque; as given where too few say anything."""
    enough = np.isfinite(blocks).sum(axis=0) >= _FEWEST
    return (
        np.where(enough, rms_of(np.sqrt(blocks)), residual),
        np.where(enough, rms_of(np.sqrt(torques)), torque),
    )


def rms_of(x: Array) -> Array:
    """RMS (n,) of what is finite in (m, n), by joint; NaN where nothing is."""
    good = np.isfinite(x)
    count = good.sum(axis=0)
    total = np.where(good, np.square(x), 0.0).sum(axis=0)
    return np.where(count > 0, np.sqrt(total / np.maximum(count, 1)), np.nan)


def _of_blocks(blocks: Array, residual: Array) -> tuple[Array, Array]:
    """κ of blocks (B, n) of the model's own data, and the largest over `residual`, by joint."""
    n = len(residual)
    if len(blocks) < _FEWEST:
        return np.full(n, 1.0), np.full(n, 2.0)
    mean = np.square(rms_of(np.sqrt(blocks)))
    worst = np.where(np.isfinite(blocks), blocks, 0.0).max(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        spread = rms_of(blocks - mean) / mean
        largest = np.where(worst > 0.0, np.sqrt(worst) / residual, np.nan)
    return np.fmax(spread, _LEAST_SPREAD), np.fmax(np.nan_to_num(largest, nan=2.0), 1.0)


def blocks_of(residual: Array, t: Array) -> Array:
    """Mean squares (B, n) of a residual (M, n) over blocks of a second; NaN without samples."""
    if not len(t):
        return np.zeros((0, residual.shape[1]))
    block = ((t - t[0]) / SECONDS).astype(int)
    last = int(block[-1])
    if last and t[-1] - t[0] - last * SECONDS < 0.5 * SECONDS:
        block[block == last] = last - 1  # no short ones
    good = np.isfinite(residual)
    sums = _sum(np.where(good, np.square(residual), 0.0), block)
    counts = _sum(good.astype(float), block)
    return np.where(counts > 0, sums / np.maximum(counts, 1.0), np.nan)


def _sum(x: Array, block: Sequence[int] | Array) -> Array:
    total = np.zeros((int(max(block)) + 1, x.shape[1]))
    np.add.at(total, np.asarray(block), x)
    return total


# What of a residual friction cannot explain: where a joint stands, reverses or creeps.
#
# Where a joint slides more slowly than it did in the model's own data, its friction may be twice
# the F that the model says (Stribeck): a residual up to F says nothing of the robot. Where it
# stands or reverses, friction takes any value from −2 F to 2 F, whatever holds the load, and what
# the model says lies between −F and F: a residual up to 3 F says nothing. The slower a motion,
# the more of it is of either kind; with its residual counted in full, 24 of 24 sound runs at 5 %
# of the pace raised an alarm. So what is judged is
#
#     sgn e · (|e| − h),    h = 3 F where the joint stands or reverses, F where it creeps, 0 else,
#
# and nothing at all (NaN) where |e| ≤ h > 0; in the model's own data, which say what is allowed,
# just so. F is what the effects that follow the speed give at the speed from which on a joint
# moves.

# Share of the model's own samples that are its slowest: too few to know friction by.
_FEW = 0.02


def beyond_friction(
    robot: Robot,
    model: IdentifiedModel,
    trace: TorqueTrace,
    processing: Processing | None,
    slowest: Array,
) -> Array:
    """Residual (m, n) [N·m] (N) of `trace` that the model's friction leaves; NaN where it may be 0.

    `processing`: the filters that the trace was made with; None: those that are not known.
    `slowest` (n,) speed at which the model knows friction (`slowest_known`).
    """
    residual = trace.measured - trace.predicted
    size = _friction(robot, model, trace, _moving_speed(processing))
    creeps = np.abs(trace.v) < slowest
    held = np.where(_standing(trace, processing), 3.0 * size, np.where(creeps, size, 0.0))
    left = np.sign(residual) * np.maximum(np.abs(residual) - held, 0.0)
    return np.where((held > 0.0) & (left == 0.0), np.nan, left)


def slowest_known(
    traces: Sequence[TorqueTrace], processing: Processing | None, joints: int
) -> Array:
    """Speed (n,) [rad/s] (m/s) below which joints slid in next to none of these samples.

    Infinite of a joint that did in none; zero without any trace.
    """
    if not traces:
        return np.zeros(joints)
    speed = np.abs(np.concatenate([trace.v for trace in traces]))
    slides = np.concatenate(
        [np.isfinite(trace.measured) & ~_standing(trace, processing) for trace in traces]
    )
    columns = zip(speed.T, slides.T, strict=True)
    return np.array([np.quantile(v[some], _FEW) if some.any() else np.inf for v, some in columns])


def _moving_speed(processing: Processing | None) -> float:
    return DEFAULT_MOVING if processing is None else processing.moving_speed


def _friction(robot: Robot, model: IdentifiedModel, trace: TorqueTrace, speed: float) -> Array:
    """F (m, n): size of the friction at ± `speed`, the larger of both."""
    still = np.zeros_like(trace.v)
    body = RigidBody(robot, model.phi, trace.q, trace.v, still)
    total = np.zeros_like(trace.v)
    for effect, values in model.by_effect:
        if not effect.is_friction:
            continue
        sides = [
            effect.torque(
                Signals(trace.t, trace.q, still + v, still, trace.load, trace.load, body), values
            )
            for v in (speed, -speed)
        ]
        total += np.maximum(*np.abs(sides))
    return total


def _standing(trace: TorqueTrace, processing: Processing | None) -> Mask:
    """Samples (m, n) whose average over ± reach [s] holds a joint that stands or reverses.

    It may do so right after the last sample, which its speed and acceleration say.
    """
    cutoff = None if processing is None else processing.parallel_cutoff
    reach = GAUSSIAN_REACH * GAUSSIAN / cutoff if cutoff else 0.0
    stops = _moving_speed(processing) + reach * np.abs(trace.a)
    slow = ~trace.counted | (np.abs(trace.v) < stops)
    slow[1:] |= np.signbit(trace.v[1:]) != np.signbit(trace.v[:-1])
    step = float(np.median(np.diff(trace.t))) if len(trace.t) > 1 else 1.0
    half = int(np.ceil(reach / max(step, 1e-9)))
    return np.asarray(maximum_filter1d(slow.astype(np.uint8), 2 * half + 1, axis=0) > 0)
