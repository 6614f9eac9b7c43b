"""Robots of campaigns, and their motions: Fourier series of 4–10 s, or short moves with rests.

Several series are drawn for a run and the best conditioned one is taken, so that parameters are
known about as well as from planned motions. Short moves are those that people record: from point to
point in 0.5–2 s with rests, and in each move some of the joints stand.
"""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.battery.motions import CONFIGS, HARMONICS, Arm, waves
from excite_cli.config.load_spec import load_spec
from excite_cli.config.spec import Spec
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.regressor import Regressor
from excite_cli.robot.model import Array, Robot, build_robot
from excite_cli.robot.tree import tree_of
from excite_cli.simulation.planned_motion import Planned, PlannedMotion, PlannedProgram
from excite_cli.trajectory.fade import Chain, Segment
from excite_cli.trajectory.fourier import FourierTrajectory
from excite_cli.trajectory.point_to_point import PointToPoint, at_rest_between

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


_ACCELERATION = 8.0  # rad/s²
_DRAWS = 6
_GRID = 60
_AGAIN = 0.3  # of the runs repeat the motion of an earlier one
_STANDING = 0.4  # of the joints in a short move
# Peaks of a move of degree five from rest to rest: speed by distance/time, acceleration by its.
_PEAK_SPEED, _PEAK_PUSH = 1.875, 5.774


def series(of: Arm, names: tuple[str, ...], rng: np.random.Generator) -> tuple[Planned, ...]:
    """A well conditioned Fourier motion for every run; some runs repeat one."""
    found: list[PlannedMotion] = []
    seconds = float(rng.uniform(4.0, 8.0))
    for name in names:
        if len(found) > 1 and rng.uniform() < _AGAIN:
            again = found[rng.integers(len(found))]
            found.append(PlannedMotion(name, again.trajectory, again.coefficients))
            continue
        trajectory = FourierTrajectory(HARMONICS, 2 * np.pi / (seconds * rng.uniform(1.0, 1.2)))
        fastest = joint_limits(of.robot)[2]
        drawn = [waves(of, trajectory, 300, fastest, _ACCELERATION, rng) for _ in range(_DRAWS)]
        best = min(drawn, key=lambda each: _condition(of, trajectory, each))
        found.append(PlannedMotion(name, trajectory, best))
    return tuple(found)


def short_moves(of: Arm, names: tuple[str, ...], rng: np.random.Generator) -> tuple[Planned, ...]:
    """A program of moves and rests, 5–10 s long, for every run."""
    return tuple(PlannedProgram(name, _moves(of, rng)) for name in names)


def _condition(of: Arm, trajectory: FourierTrajectory, coefficients: Array) -> float:
    times = np.arange(_GRID) * trajectory.duration / _GRID
    states = trajectory.basis(times).states(coefficients)
    y = Regressor(of.robot).evaluate(*states)[:, :, of.base.selection].reshape(-1, of.base.rank)
    return float(np.linalg.cond(y / np.maximum(np.linalg.norm(y, axis=0), 1e-12)))


def _moves(of: Arm, rng: np.random.Generator) -> Chain:
    lower, upper, fastest = joint_limits(of.robot)
    middle, half = (upper + lower) / 2, 0.45 * (upper - lower)
    at = middle + half * rng.uniform(-1.0, 1.0, of.robot.n)
    wanted, spent = float(rng.uniform(5.0, 10.0)), 0.0
    segments: list[Segment] = []
    while spent < wanted:
        seconds, rest = float(rng.uniform(0.5, 2.0)), float(rng.uniform(0.2, 1.0))
        stands = rng.uniform(size=of.robot.n) < _STANDING
        stands[rng.integers(of.robot.n)] = False
        step = middle + half * rng.uniform(-1.0, 1.0, of.robot.n) - at
        largest = np.minimum(
            fastest * seconds / _PEAK_SPEED, _ACCELERATION * seconds**2 / _PEAK_PUSH
        )
        to = at + np.where(stands, 0.0, np.clip(step, -largest, largest))
        segments.append(Segment("move", PointToPoint(seconds, True), at_rest_between(at, to)))
        segments.append(Segment("rest", PointToPoint(rest, True), at_rest_between(to, to)))
        at, spent = to, spent + seconds + rest
    return Chain(tuple(segments))
