"""Whether a set-up leaves joints within their limits: one that does not is hardly the true one."""

import numpy as np

from excite_cli.checks.samples import Samples
from excite_cli.checks.setup import Setup
from excite_cli.measurement.dataset import Mask
from excite_cli.robot.model import Robot

_SLACK = 0.1  # of a joint's range, by which limits of descriptions may be passed
_STEP = np.radians(25.0)  # half of the widest step in which zeros are sought, and some
_TURNS = 2.0 * np.pi * np.arange(-1, 2)  # rad; an angle says nothing of whole turns


def beyond_limits(robot: Robot, samples: Samples, setup: Setup) -> Mask:
    """Joints (n,) that are beyond their limits by more than a tenth of their range, set up so.

    Those that turn by 25° at least, since zeros are sought in steps of 30 to 45°.
    """
    q = setup.motion(samples)[0]
    low, high = q.min(axis=0), q.max(axis=0)
    slack = _SLACK * (robot.limits.upper - robot.limits.lower)
    slack = np.maximum(slack, np.where(robot.sliding, 0.0, _STEP))
    lower, upper = robot.limits.lower - slack, robot.limits.upper + slack
    turned = _TURNS[:, None] * ~robot.sliding
    within = (low + turned >= lower) & (high + turned <= upper)
    return ~(within.any(axis=0) | ~np.isfinite(upper - lower))
