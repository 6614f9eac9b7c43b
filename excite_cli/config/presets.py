"""What the commonest recorders call things: values of `measurement` under one name each.

What the file of a config says itself goes before them.
"""

from typing import Any

import numpy as np

PRESETS: dict[str, dict[str, Any]] = {
    # Universal Robots, "Real-Time Data Exchange (RTDE) Guide", controller outputs: timestamp [s],
    # actual_q [rad], actual_qd [rad/s], actual_current [A]. record.py of its client library writes
    # a column for each joint, from 0 on, separated by blanks.
    "ur_rtde": {
        "channels": {"t": "timestamp", "q": "actual_q", "dq": "actual_qd", "tau": "actual_current"},
        "torque": "current",
    },
    # ur_robot_driver's hardware interface fills effort with actual_current [A].
    "ur_ros2": {"torque": "current"},
    # libfranka, RobotState: q [rad], dq [rad/s], tau_J [N·m], "measured link-side joint torque
    # sensor signals", unfiltered.
    "franka": {"channels": {"tau": "tau_J"}, "torque": "link"},
    # KUKA.RobotSensorInterface: IPOC counts ms; AIPos are axes' actual positions [deg]; MACur are
    # motor currents.
    "kuka_rsi": {
        "channels": {"t": "IPOC", "q": "AIPos", "tau": "MACur"},
        "time": "ms",
        "angle": "deg",
        "torque": "current",
    },
    # unitree_legged_sdk and unitree_sdk2, MotorState: q [rad], dq [rad/s], tauEst (tau_est) [N·m],
    # estimated at the output from the current.
    "unitree": {"channels": {"tau": "tau_est"}, "torque": "link"},
    # ROBOTIS e-Manual, X series: present position 4096 counts a turn; present current 2.69 mA a
    # count (XM430, XM540); the unit of present velocity is another one.
    "dynamixel": {
        "channels": {"q": "present_position", "dq": None, "tau": "present_current"},
        "angle": 2 * np.pi / 4096,
        "torque": "current",
        "torque_unit": 2.69e-3,
    },
}


def with_preset(values: dict[str, Any]) -> dict[str, Any]:
    """`measurement` with what its preset adds; mappings are joined key by key."""
    preset = PRESETS.get(str(values.get("preset")))
    if preset is None:
        return values
    found = {**preset, **values}
    for key, own in preset.items():
        if isinstance(own, dict) and isinstance(values.get(key), dict):
            found[key] = {**own, **values[key]}
    return found
