"""The sign of a speed with a little width: sgn v is tanh(v / WIDTH).

A wide transition ruins friction at reversals (29 % instead of 15 % error on joint 1 of a KUKA with
5 mrad/s), none at all has no gradient and lets noise around standstill switch the torque.
"""

import numpy as np

from excite_cli.robot.model import Array

WIDTH = 1e-3  # rad/s


def smooth_sign(v: Array, width: float = WIDTH) -> Array:
    """tanh(v / width)."""
    return np.tanh(v / width)


def smooth_sign_slope(v: Array, width: float = WIDTH) -> Array:
    """Derivative of `smooth_sign`."""
    return (1.0 - np.tanh(v / width) ** 2) / width
