"""Distances between capsules, and from obstacles, bounded over intervals: never above the truth."""

import numpy as np
import pytest

from excite_cli.geometry.obstacle_distances import ObstacleDistances
from excite_cli.geometry.obstacles import Box, Plane
from excite_cli.geometry.pair_distances import PairDistances
from excite_cli.proof.enclosed_distances import EnclosedCapsules
from excite_cli.proof.enclosed_motion import EnclosedMotion
from excite_cli.proof.enclosed_obstacles import least_clearances
from excite_cli.proof.enclosed_trajectory import enclosed_states, intervals_of
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.model import Robot
from excite_cli.trajectory.fourier import FourierTrajectory
from tests.robot.random_robots import random_robot

FAMILY = FourierTrajectory(3, 2.0)
INSIDE = np.linspace(-1, 1, 21)


def capsules_of(robot: Robot, rng: np.random.Generator) -> tuple[Capsule, ...]:
    """One per body and one that stands; one of them a ball."""
    found = []
    for joint in range(robot.model.njoints):
        start = rng.normal(size=3) * 0.3
        end = start if joint == 2 else start + rng.normal(size=3) * 0.4
        found.append(Capsule(f"link_{joint}", joint, start, end, 0.02, (f"link_{joint}",)))
    return tuple(found)


def bounds_and_truth(seed: int, width: float, least, true) -> tuple[np.ndarray, np.ndarray]:
    robot = random_robot(seed, 4)
    rng = np.random.default_rng(seed)
    coefficients = rng.normal(size=(FAMILY.n_coefficients, robot.n)) * 0.5
    capsules = capsules_of(robot, rng)
    intervals = intervals_of(FAMILY, width).only(slice(0, 60, 3))
    motion = EnclosedMotion(robot, enclosed_states(FAMILY, coefficients, intervals))
    bound = least(EnclosedCapsules(capsules, motion))
    values = []
    for s in INSIDE:
        times = intervals.middles + s * intervals.halves
        values.append(true(robot, capsules, FAMILY.basis(times).states(coefficients)[0]))
    return bound, np.min(values, axis=0)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("width", [0.2, 0.02])
def test_capsules(seed: int, width: float) -> None:
    pairs = [(i, j) for i in range(5) for j in range(i + 1, 5)]
    first, second = np.array(pairs).T
    bound, least = bounds_and_truth(
        seed,
        width,
        lambda axes: axes.least_distances(first, second, 10.0),
        lambda robot, capsules, q: PairDistances(robot, capsules, pairs).distances(q),
    )
    assert np.all(bound <= least + 1e-9)
    if width < 0.1:
        apart = least > 0.03
        assert apart.sum() > 20
        assert np.quantile((least - bound)[apart], 0.9) < 2e-3


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("width", [0.2, 0.02])
def test_obstacles(seed: int, width: float) -> None:
    rng = np.random.default_rng(seed + 100)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    things = (
        Plane("wall", turn[0], -1.0),
        Box("box", turn * np.sign(np.linalg.det(turn)), rng.normal(size=3), np.full(3, 0.2)),
    )
    which = np.arange(5)
    for index, thing in enumerate(things):
        pairs = [(capsule, index) for capsule in range(5)]
        bound, least = bounds_and_truth(
            seed,
            width,
            lambda axes, thing=thing: least_clearances(axes, thing, which, 10.0),
            lambda robot, capsules, q, pairs=pairs: ObstacleDistances(
                robot, capsules, things, pairs
            ).distances(q),
        )
        assert np.all(bound <= least + 1e-9)
        if width < 0.1:
            apart = least > 0.03
            assert np.quantile((least - bound)[apart], 0.9) < 2e-3
