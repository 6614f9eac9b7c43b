"""Pseudo-inertias and lengths of bodies, against values by hand."""

import numpy as np
import pytest

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.dynamics.pseudo_inertia import body_lengths, nearest_inertias, smallest_eigenvalues
from excite_cli.effects.judgement import half_of
from excite_cli.robot.model import Array, Robot, build_robot


@pytest.fixture(scope="module")
def robot() -> Robot:
    return build_robot(RobotSpec(urdf="example-robot-data:ur5"))


def body(mass: float, center: float = 0.0, gyration: float = 0.0) -> list[float]:
    """A ball of that radius of gyration [m] about each axis, its centre on x."""
    inertia = mass * gyration**2
    offset = mass * center**2
    return [mass, mass * center, 0, 0, inertia, 0, inertia + offset, 0, 0, inertia + offset]


def half_reach(robot: Robot) -> Array:
    """Of the bodies of an open chain: half the distance to the next joint; none of the last."""
    placements = robot.model.jointPlacements
    found = [np.linalg.norm(placements[k].translation) / 2 for k in range(2, robot.model.njoints)]
    return np.array([*found, 0.0])


def test_a_length_is_the_largest_of_gyration_lever_and_half_reach(robot: Robot) -> None:
    count = robot.model.njoints - 1
    far, wide, plain = body(2.0, center=3.0), body(2.0, gyration=4.0), body(2.0, gyration=1e-6)
    lengths = body_lengths(robot, np.array([far, wide, *[plain] * (count - 2)]).ravel())
    # Of a point mass 3 m away: the square of its radius of gyration is half of 9 + 9.
    assert lengths[0] == pytest.approx(3.0)
    # Half the trace of 3 · 16 m is 24 m.
    assert lengths[1] == pytest.approx(np.sqrt(1.5) * 4.0)
    assert lengths[2:-1] == pytest.approx(half_reach(robot)[2:-1], rel=1e-6)
    assert lengths[-1] == 0.02  # the least of all


def test_of_a_body_without_mass_only_its_reach_counts(robot: Robot) -> None:
    """Its first moments, divided by next to nothing, would be kilometres."""
    nothing = [1e-9, 1e-6, 0, 0, 1e-6, 0, 1e-6, 0, 0, 1e-6]
    lengths = body_lengths(robot, np.tile(nothing, robot.model.njoints - 1))
    reach = half_reach(robot)
    assert lengths[:-1] == pytest.approx(reach[:-1])
    assert lengths[-1] == pytest.approx(np.median(reach[reach > 0]))


def test_the_least_eigenvalue_says_whether_it_is_a_body(robot: Robot) -> None:
    ball = np.array(body(2.0, gyration=0.5))
    assert smallest_eigenvalues(ball, np.ones(1)) == pytest.approx([2.0 * 0.125])
    flat = ball.copy()
    flat[9] = 3 * ball[4]  # more about one axis than about the two others together
    assert smallest_eigenvalues(flat, np.ones(1))[0] < 0.0


LENGTH = np.array([0.2])
NONE = np.zeros(0, dtype=np.intp)
# m, mx, my, mz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz of 0.2 kg at (0.1, 0, 0.05) m, Ixx too small.
IMPOSSIBLE = np.array([0.2, 0.02, 0.0, 0.01, 1e-4, 0.0, 1e-3, -1e-3, 0.0, 1e-3])


@pytest.mark.parametrize("seed", range(8))
def test_a_planar_arm_shows_few_of_ten_numbers(seed: int) -> None:
    """By a covariance as a fit gives it, 1e16 times as wide where nothing shows.

    The solver broke off with 41 of 60 such fits, and a payload on a planar arm had no name.
    """
    rng = np.random.default_rng(seed)
    shown = [0, 2, 3, 4, 9][: 3 + seed % 3]
    columns = 1e-16 * rng.normal(size=(200, 10))
    columns[:, shown] += rng.normal(size=(200, len(shown))) * 10 ** rng.uniform(-1, 1, len(shown))
    columns[:, shown[-1]] += columns[:, shown[0]]
    norms = np.linalg.norm(columns, axis=0)
    unit = columns / norms
    inverse = np.linalg.inv(unit.T @ unit + 1e-10 * np.eye(10))
    covariance = 1e-6 * inverse / np.outer(norms, norms)
    start = IMPOSSIBLE + 1e-3 * rng.normal(size=10)
    found = nearest_inertias(half_of(covariance), start, LENGTH, NONE, 1e-6)
    assert found.solved, found.status
    assert smallest_eigenvalues(found.x, LENGTH).min() > 0.0


def test_what_is_possible_stays_and_what_is_not_moves_by_the_least() -> None:
    possible = np.array([1.0, 0.0, 0.0, 0.0, 0.02, 0.0, 0.02, 0.0, 0.0, 0.02])
    same = nearest_inertias(np.eye(10), possible, LENGTH, NONE, 1e-6)
    assert (same.distance, same.x.tolist()) == (0.0, possible.tolist())
    negative = possible.copy()
    negative[0] = -0.5
    moved = nearest_inertias(np.eye(10), negative, LENGTH, NONE, 1e-6)
    assert moved.solved
    assert moved.x[0] == pytest.approx(1e-6, abs=1e-6)
    assert moved.distance == pytest.approx(0.25, rel=1e-3)
