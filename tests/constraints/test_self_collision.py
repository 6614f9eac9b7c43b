"""Tabled distances of meshes: margins, gradients, and bounds over intervals of time."""

import numpy as np
import pytest

from excite_cli.constraints.self_collision import MeshClearance
from excite_cli.dynamics.forward_kinematics import BatchKinematics, States
from excite_cli.geometry.mesh_pairs import PairTable
from excite_cli.proof.enclosed_motion import (
    EnclosedMotion,
    Intervals,
    enclosed_states,
    intervals_of,
)
from excite_cli.trajectory.fourier import FourierTrajectory
from tests.constraints.test_gradients import check_gradients
from tests.robot.random_robots import random_robot

ROBOT = random_robot(2, joints=4)
FAMILY = FourierTrajectory(3, 2.0)


def table(seed: int, joints: tuple[int, int], reach: float = 1.5) -> PairTable:
    """A wavy surface with a hole, over positions within `reach`."""
    rng = np.random.default_rng(seed)
    grids = (np.linspace(-reach, reach, 60), np.linspace(-reach, reach, 50))
    x, y = np.meshgrid(*grids, indexing="ij")
    values = 0.02 * np.sin(2 * x + rng.uniform(0, 6)) * np.cos(3 * y) + 0.004
    values = np.where(x * x + y * y < 0.1, -0.01, values)  # a kink, as at contact
    return PairTable("one", "other", joints, grids, values, error=0.0005, touching=0.1)


def states_of(q: np.ndarray) -> States:
    return States(BatchKinematics(ROBOT), q, np.zeros_like(q), np.zeros_like(q))


def test_margins_are_the_table_less_what_is_kept() -> None:
    one = table(0, (1, 3))
    constraint = MeshClearance((one,), margin=0.002)
    q = np.random.default_rng(0).uniform(-1, 1, (20, ROBOT.n))
    q[0, [1, 3]] = one.grids[0][10], one.grids[1][20]
    margins = constraint.margins(states_of(q))[:, 0]
    assert margins[0] == pytest.approx(one.values[10, 20] - 0.0025)
    assert constraint.labels == ("one – other",)


def test_gradients_by_differences() -> None:
    check_gradients(ROBOT, MeshClearance((table(1, (0, 2)), table(2, (3, 1)))), 1, 1e-5)


def bounds(constraint: MeshClearance, coefficients: np.ndarray, intervals: Intervals) -> np.ndarray:
    states = enclosed_states(FAMILY, coefficients, intervals)
    return np.asarray(constraint.least(EnclosedMotion(ROBOT, states)))


@pytest.mark.parametrize("width", [0.1, 0.01])
def test_bounds_hold_at_every_instant(width: float) -> None:
    constraint = MeshClearance((table(3, (0, 2)), table(4, (1, 3))))
    rng = np.random.default_rng(3)
    coefficients = rng.normal(size=(FAMILY.n_coefficients, ROBOT.n)) * 0.2
    intervals = intervals_of(FAMILY, width)
    least = bounds(constraint, coefficients, intervals)
    truth = []
    for s in np.linspace(-1, 1, 21):
        times = intervals.middles + s * intervals.halves
        truth.append(constraint.margins(states_of(FAMILY.basis(times).states(coefficients)[0])))
    smallest = np.min(truth, axis=0)
    assert np.all(least <= smallest + 1e-12)
    if width < 0.05:
        assert np.median((smallest - least)[np.isfinite(least)]) < 5e-3
    # Nothing is known beyond a table.
    small = MeshClearance((table(5, (0, 2), reach=0.3),))
    still = FAMILY.constant(np.full(ROBOT.n, 0.5))
    assert np.all(bounds(small, still, intervals_of(FAMILY, 1.0)) == -np.inf)
