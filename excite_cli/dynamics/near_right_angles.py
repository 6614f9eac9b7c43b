"""Rotations that are right angles but for their decimals: 1.57, 1.571, 3.1416.

Tilted by a thousandth of a radian, an upright axis shows parameters through gravity that nobody
can measure, and the condition number is a million. Which parameters show is therefore decided on a
robot whose nearly right angles are right; its dynamics keep the angles as they are given.
"""

from dataclasses import replace

import numpy as np
import pinocchio as pin

from excite_cli.robot.model import Array, Robot

# 3.14 is 1.6e-3 off; a real tilt of a mount is rarely smaller, and shows as little.
_NEAR = 2e-3  # rad
_ROUNDING = 1e-12
BASE = "base_orientation"


def nearly_right(robot: Robot) -> tuple[str, ...]:
    """Joints whose frame is turned by nearly right angles, `base_orientation` for the base.

    Of a joint at a fixed base the turn contains that of the base.
    """
    found = [
        str(robot.model.names[joint])
        for joint in range(1, robot.model.njoints)
        if _differs(robot.model.jointPlacements[joint].rotation)
    ]
    if robot.floating and _differs(_base_rotation(robot)):
        found.append(BASE)
    return tuple(found)


def squared(robot: Robot, but: str | None = None) -> Robot:
    """The robot with all nearly right angles made right, but for those of the joint `but`."""
    model = robot.model.copy()
    for joint in range(1, model.njoints):
        if str(model.names[joint]) != but:
            placement = model.jointPlacements[joint]
            model.jointPlacements[joint] = pin.SE3(
                _squared(placement.rotation), placement.translation
            )
    reference = robot.reference.copy()
    if robot.floating and but != BASE:
        reference[3:7] = pin.Quaternion(_squared(_base_rotation(robot))).coeffs()
    return replace(robot, model=model, reference=reference)


def _base_rotation(robot: Robot) -> Array:
    return np.asarray(pin.Quaternion(*robot.reference[[6, 3, 4, 5]]).matrix())


def _differs(rotation: Array) -> bool:
    return bool(np.abs(_squared(rotation) - rotation).max() > _ROUNDING)


def _squared(rotation: Array) -> Array:
    """The rotation next to `rotation` (3, 3) of which no entry is nearly 0 or nearly ±1.

    Entries near 0 become 0 and rows and columns unit; any angle about a coordinate axis stays.
    """
    small = (np.abs(rotation) < _NEAR) & (rotation != 0.0)
    if not small.any():
        return np.asarray(rotation)
    near_one = np.abs(np.abs(rotation) - 1.0) < _NEAR**2
    rounded = np.where(near_one, np.sign(rotation), rotation)
    kept = np.where(np.abs(rotation) < _NEAR, 0.0, rounded)
    if np.array_equal(kept @ kept.T, np.eye(3)):
        return np.asarray(kept)
    left, _, right = np.linalg.svd(kept)
    found = left @ right
    return np.asarray(np.where(np.abs(found) < _ROUNDING, 0.0, found))
