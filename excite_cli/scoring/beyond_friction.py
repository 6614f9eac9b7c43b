"""What of a residual friction cannot explain: where a joint stands, reverses or creeps.

Where a joint slides more slowly than it did in the model's own data, its friction may be twice the
F that the model says (Stribeck): a residual up to F says nothing of the robot. Where it stands or
reverses, friction takes any value from −2 F to 2 F, whatever holds the load, and what the model
says lies between −F and F: a residual up to 3 F says nothing. The slower a motion, the more of it
is of either kind; with its residual counted in full, 24 of 24 sound runs at 5 % of the pace raised
an alarm. So what is judged is

    sgn e · (|e| − h),    h = 3 F where the joint stands or reverses, F where it creeps, 0 else,

and nothing at all (NaN) where |e| ≤ h > 0; in the model's own data, which say what is allowed, just
so. F is what the effects that follow the speed give at the speed from which on a joint moves.
"""

from collections.abc import Sequence

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
from excite_cli.identification.torque_trace import TorqueTrace
from excite_cli.robot.model import Array, Robot

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
        if "speed" not in effect.function_of or effect.over_time or effect.follows_covariate:
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
