"""Robots of the campaigns: arms of some makers, our own small one, and a torso with two arms."""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.battery.motions import CONFIGS, Arm
from excite_cli.config.load import load_spec
from excite_cli.config.spec import Spec
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.robot.model import Robot, build_robot
from excite_cli.robot.tree import tree_of

ROBOTS = ("smoke", "ur10", "panda", "z1", "xarm7", "two_arms")
TWO_LEAVES = ("two_arms",)
_SHARES = (0.25, 0.25, 0.15, 0.15, 0.1, 0.1)

_SHIPPED = ("smoke", "ur10", "panda")
_OF_EXAMPLES: dict[str, dict[str, Any]] = {
    "z1": {
        "urdf": "example-robot-data:z1",
        "joints": [f"joint{k}" for k in range(1, 7)],
        "posture": {"joint2": 1.2, "joint3": -1.2},
    },
    "xarm7": {"urdf": "example-robot-data:xarm7", "posture": {"joint2": -0.5, "joint4": 0.9}},
    "two_arms": {
        "urdf": "example-robot-data:talos",
        "joints": [f"arm_{side}_{k}_joint" for side in ("left", "right") for k in (2, 3, 4)],
        "posture": {
            "arm_left_1_joint": 0.25847,
            "arm_left_2_joint": 0.4,
            "arm_left_4_joint": -0.525366,
            "arm_right_1_joint": -0.25847,
            "arm_right_2_joint": -0.4,
            "arm_right_4_joint": -0.525366,
        },
    },
}


def drawn_robot(rng: np.random.Generator, two_leaves: bool) -> str:
    """Name of a robot, of one with two leaves if that is asked for."""
    if two_leaves:
        return str(rng.choice(TWO_LEAVES))
    return str(rng.choice(ROBOTS, p=_SHARES))


@cache
def robot_of(name: str) -> Arm:
    """A robot with its base parameters and its configuration."""
    if name in _SHIPPED:
        spec = load_spec(CONFIGS / f"{name}.yaml", [])
    else:
        spec = Spec.model_validate({"robot": _OF_EXAMPLES[name]})
    robot = build_robot(spec.robot, CONFIGS)
    return Arm(name, robot, find_base_parameters(robot), spec)


def leaves(robot: Robot) -> tuple[int, ...]:
    """Moved joints that carry no other one, the last of them last."""
    parents = {joint.parent for joint in tree_of(robot).joints}
    return tuple(j for j in range(robot.n) if j not in parents)


def joint_limits(robot: Robot) -> tuple[NDArray, NDArray, NDArray]:
    """Lower and upper positions (n,) within ±π, and speeds (n,) that a person would allow."""
    lower, upper = (np.clip(x, -np.pi, np.pi) for x in robot.limits.ranges())
    return lower, upper, np.minimum(robot.limits.velocity, 3.0)
