"""What an inertial measurement unit on a body reads: its rate and its specific force."""

import numpy as np
import pinocchio as pin

from excite_cli.robot.model import Array, Robot


def readings(
    robot: Robot, joint: int, place: tuple[Array, Array], states: tuple[Array, Array, Array],
    gravity: Array,
) -> tuple[Array, Array]:  # fmt: skip
    """Rates ω (T, 3) [rad/s] and specific forces p̈ − g (T, 3) [m/s²], in axes of the unit.

    `place`: rotation (3, 3) and position (3,) of the unit in the frame of moved `joint`; `states`
    q, v, a (T, n); `gravity` (3,) of the world.
    """
    rotation, lever = place
    model, body = robot.model, robot.model_joints[joint]
    data = model.createData()
    rates, forces = np.empty((2, len(states[0]), 3))
    full = robot.configurations(states[0]), *map(robot.velocities, states[1:])
    for t, (q, v, a) in enumerate(zip(*full, strict=True)):
        pin.forwardKinematics(model, data, q, v, a)
        twist, gained = data.v[body], data.a[body]
        turning = np.cross(twist.angular, lever)
        at = gained.linear + np.cross(twist.angular, twist.linear + turning)
        rates[t] = twist.angular
        forces[t] = at + np.cross(gained.angular, lever) - data.oMi[body].rotation.T @ gravity
    return rates @ rotation, forces @ rotation
