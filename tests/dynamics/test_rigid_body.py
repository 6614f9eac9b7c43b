"""Derivatives of the rigid-body torque at whatever inertias a fit leaves."""

import numpy as np
import pytest

from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from tests.robot.random_robots import random_robot

STEP = 1e-6


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("share", [0.5, -3.0])
def test_derivatives_are_those_of_the_torque_for_negative_masses_too(
    seed: int, share: float
) -> None:
    robot = random_robot(seed, joints=5)
    rng = np.random.default_rng(seed)
    phi = standard_parameters(robot) * rng.uniform(0.5, 1.5, 10 * robot.n_bodies)
    phi[::20] *= share
    q, v, a = rng.normal(size=(3, 2, robot.n))
    body = RigidBody(robot, phi, q, v, a)
    for k, part in enumerate((body.by_position, body.by_velocity, body.mass)):
        size = np.abs(body.load).max() + np.abs(part).max()
        for j in range(robot.n):
            ends = []
            for sign in (1.0, -1.0):
                moved = [q.copy(), v.copy(), a.copy()]
                moved[k][:, j] += sign * STEP
                ends.append(RigidBody(robot, phi, *moved).regressor @ phi)
            slope = (ends[0] - ends[1]) / (2 * STEP)
            assert part[:, :, j] == pytest.approx(slope, rel=1e-6, abs=1e-6 * size)
