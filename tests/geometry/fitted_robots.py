"""Robots with their capsules and pairs, fitted once for all tests."""

import os
import tempfile
from functools import cache
from unittest import mock

from excite_cli.config.constraints_spec import SelfCollisionSpec
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.geometry.capsules import Capsule, fit_capsules
from excite_cli.geometry.collision_pairs import CollisionPairs, choose_pairs
from excite_cli.robot.model import Robot, build_robot

ARMS = tuple(f"arm_{side}_{k}_joint" for side in ("left", "right") for k in range(1, 8))
PANDA = tuple(f"panda_joint{k}" for k in range(1, 8))

HALF_SITTING = {
    f"{limb}_joint": value
    for side, sign in (("left", 1), ("right", -1))
    for limb, value in {
        f"arm_{side}_1": sign * 0.25847,
        f"arm_{side}_2": sign * 0.173046,
        f"arm_{side}_4": -0.525366,
        f"arm_{side}_7": 0.1,
        f"leg_{side}_3": -0.411354,
        f"leg_{side}_4": 0.859395,
        f"leg_{side}_5": -0.448041,
    }.items()
}
READY = dict(zip(PANDA, (0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785), strict=True))

SPECS = {
    "talos": RobotSpec(urdf="example-robot-data:talos", joints=ARMS, posture=HALF_SITTING),
    "ur10": RobotSpec(urdf="example-robot-data:ur10", base_orientation=(0.0, 0.0, 0.5)),
    "panda": RobotSpec(urdf="example-robot-data:panda", joints=PANDA, posture=READY),
}


@cache
def robot_of(name: str) -> Robot:
    return build_robot(SPECS[name])


@cache
def capsules_of(name: str) -> tuple[Capsule, ...]:
    with (
        tempfile.TemporaryDirectory() as folder,
        mock.patch.dict(os.environ, {"XDG_CACHE_HOME": folder}),
    ):
        return fit_capsules(robot_of(name), SelfCollisionSpec())


@cache
def pairs_of(name: str) -> CollisionPairs:
    return choose_pairs(robot_of(name), capsules_of(name), SelfCollisionSpec())
