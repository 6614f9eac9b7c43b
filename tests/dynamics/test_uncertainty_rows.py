"""Rows of inverse dynamics and the wrench of the ground against Pinocchio and MuJoCo."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.dynamics.center_of_mass import CenterOfMass
from excite_cli.dynamics.regressor import InverseDynamics, standard_parameters
from excite_cli.dynamics.row_adjoint import RowAdjoint
from excite_cli.dynamics.whole_robot import GroundWrench, drawn_states, whole_parameters
from excite_cli.robot.model import Robot
from tests.robot.random_robots import random_robot
from tests.whole_plant import WholePlant


@settings(max_examples=20, derandomize=True, deadline=None)
@given(seed=st.integers(0, 9999), joints=st.integers(1, 6), floating=st.booleans())
def test_rows_agree_with_the_derivatives_of_pinocchio(
    seed: int, joints: int, floating: bool
) -> None:
    robot = random_robot(seed, joints=joints, floating=floating)
    q, v, a = robot.draw_states(3, seed)
    times, rows = (index.ravel() for index in np.indices((3, joints)))
    phi = np.tile(standard_parameters(robot), (len(times), 1))
    # Rows do not mind the inertias of each other: every second one is twice as heavy.
    phi[::2] *= 2.0
    found = RowAdjoint(robot).torques(q, v, a, times, rows, phi)
    for part, expected in zip(found, InverseDynamics(robot).derivatives(q, v, a), strict=True):
        expected = expected.reshape(-1, joints)
        expected[::2] *= 2.0
        assert np.abs(part - expected).max() <= 1e-11 * (1.0 + np.abs(expected).max())


def root_wrench(robot: Robot, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Wrench on a floating base about the world origin, from Pinocchio's inverse dynamics."""
    data = robot.model.createData()
    full = robot.configurations(q[None])[0]
    rates = robot.velocities(np.array([v, a]))
    local = pin.rnea(robot.model, data, full, *rates)[:6]
    pin.forwardKinematics(robot.model, data, full)
    return np.asarray(data.oMi[1].act(pin.Force(local)).vector)


@pytest.mark.parametrize("seed", range(3))
def test_the_wrench_of_a_floating_base(seed: int) -> None:
    robot = random_robot(seed, joints=5, floating=True)
    states = drawn_states(robot, 5, seed)
    found = GroundWrench(robot).regressor(states) @ whole_parameters(robot)
    every = zip(states.q, states.v, states.a, strict=True)
    expected = [root_wrench(robot, *state) for state in every]
    assert np.allclose(found, expected, rtol=1e-10, atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_wrench_torque_and_mass_agree_with_mujoco(seed: int) -> None:
    """Any inertias, also those that no body has."""
    robot = random_robot(seed, joints=5)
    states = drawn_states(robot, 4, seed)
    plant = WholePlant(robot)
    rng = np.random.default_rng(seed)
    for phi in whole_parameters(robot) * rng.uniform(0.7, 1.3, (3, 60)):
        plant.set_inertias(phi)
        torque, wrench, center = plant.inverse(states.q, states.v, states.a)
        found = GroundWrench(robot).regressor(states) @ phi
        assert np.allclose(found, wrench, rtol=1e-9, atol=1e-8)
        masses = phi.reshape(-1, 10)[:, :4].ravel()
        mass, x, y = (CenterOfMass(robot).rows(states) @ masses).T
        assert np.allclose(np.column_stack([x, y]) / mass[:, None], center[:, :2])
        assert torque.shape == states.q.shape
