"""What of a residual friction cannot explain: where a joint stands or reverses, its torque is its own.

Friction of a joint that stands takes any value from −F to F, whatever holds the load, and what the
model says of it there lies between them too: a residual up to 2 F says nothing of the robot. The
slower a motion, the more of it is standing and reversing (half of the samples at 5 % of the pace):
with those residuals counted in full, all of 54 sound runs at that pace raised an alarm. So what is
judged is

    e                          where the joint slides,
    sgn e · (|e| − 2 F)        where it does not and |e| > 2 F,

and nothing at all (NaN) elsewhere; in the model's own data, which say what is allowed, just so.
F is what the effects that follow the speed give at the speed from which on a joint moves.
"""

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


def beyond_friction(
    robot: Robot, model: IdentifiedModel, trace: TorqueTrace, processing: Processing | None
) -> Array:
    """Residual (m, n) [N·m] (N) of `trace` that the model's friction leaves; NaN where it may be 0.

    `processing`: the filters that the trace was made with; None: those that are not known.
    """
    residual = trace.measured - trace.predicted
    moving_speed = DEFAULT_MOVING if processing is None else processing.moving_speed
    cutoff = None if processing is None else processing.parallel_cutoff
    reach = GAUSSIAN_REACH * GAUSSIAN / cutoff if cutoff else 0.0
    held = 2.0 * _friction(robot, model, trace, moving_speed)
    held = np.where(_standing(trace, moving_speed, reach), held, 0.0)
    left = np.sign(residual) * np.maximum(np.abs(residual) - held, 0.0)
    return np.where((held > 0.0) & (left == 0.0), np.nan, left)


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


def _standing(trace: TorqueTrace, moving_speed: float, reach: float) -> Mask:
    """Samples (m, n) whose average over ± `reach` [s] holds a joint that stands or reverses.

    It may do so right after the last sample, which its speed and acceleration say.
    """
    slow = ~trace.counted | (np.abs(trace.v) < moving_speed + reach * np.abs(trace.a))
    slow[1:] |= np.signbit(trace.v[1:]) != np.signbit(trace.v[:-1])
    step = float(np.median(np.diff(trace.t))) if len(trace.t) > 1 else 1.0
    half = int(np.ceil(reach / max(step, 1e-9)))
    return np.asarray(maximum_filter1d(slow.astype(np.uint8), 2 * half + 1, axis=0) > 0)
