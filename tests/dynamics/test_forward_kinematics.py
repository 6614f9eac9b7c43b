"""Kinematics, centre of mass, rows and the ground's wrench against Pinocchio and MuJoCo."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.dynamics.forward_kinematics import BatchKinematics, States
from excite_cli.dynamics.regressor import InverseDynamics, standard_parameters
from excite_cli.dynamics.row_adjoint import RowAdjoint
from excite_cli.dynamics.whole_robot import (
    CenterOfMass,
    GroundWrench,
    drawn_states,
    whole_parameters,
)
from excite_cli.excitation.gradient_check import central_differences, relative_error
from excite_cli.robot.model import Robot, build_robot
from tests.robot.random_robots import random_robot
from tests.whole_plant import WholePlant

ARMS = tuple(f"arm_{side}_{k}_joint" for side in ("left", "right") for k in range(1, 8))
ROBOTS = {
    "talos_arms": RobotSpec(urdf="example-robot-data:talos", joints=ARMS),
    "talos_floating": RobotSpec(
        urdf="example-robot-data:talos", base="floating", base_orientation=(0.1, -0.4, 0.7)
    ),
    "ur10_turned": RobotSpec(urdf="example-robot-data:ur10", base_orientation=(0.1, 0.2, 0.3)),
    "panda_with_fingers": RobotSpec(urdf="example-robot-data:panda"),  # prismatic, skew axes
    "icub": RobotSpec(urdf="example-robot-data:icub"),  # revolute about skew axes
}


@pytest.fixture(scope="module", params=ROBOTS)
def robot(request: pytest.FixtureRequest) -> Robot:
    return build_robot(ROBOTS[request.param])


def test_placements_and_axes_equal_pinocchio(robot: Robot) -> None:
    kinematics = BatchKinematics(robot)
    q, _, _ = robot.draw_states(20, seed=3)
    rotations, translations = kinematics.placements(q)
    axes = kinematics.axes(rotations, translations)
    assert rotations.shape == (20, robot.n_bodies, 3, 3)
    assert axes.shape == (20, robot.model.nv, 6)
    data = robot.model.createData()
    for t, configuration in enumerate(robot.configurations(q)):
        columns = pin.computeJointJacobians(robot.model, data, configuration)
        np.testing.assert_allclose(axes[t], columns.T, atol=1e-12)
        for body in range(robot.n_bodies):
            placement = data.oMi[body + 1]
            np.testing.assert_allclose(rotations[t, body], placement.rotation, atol=1e-12)
            np.testing.assert_allclose(translations[t, body], placement.translation, atol=1e-12)


def _states(robot: Robot, q: np.ndarray) -> States:
    return States(BatchKinematics(robot), q, np.zeros_like(q), np.zeros_like(q))


@settings(max_examples=15, derandomize=True, deadline=None)
@given(seed=st.integers(0, 9999), joints=st.integers(1, 6), floating=st.booleans())
def test_jacobian_agrees_with_differences(seed: int, joints: int, floating: bool) -> None:
    robot = random_robot(seed, joints=joints, floating=floating)
    mass = CenterOfMass(robot)
    q = robot.draw_states(1, seed)[0]
    jacobian = mass.jacobian(_states(robot, q))[0]
    for axis in range(3):
        expected = central_differences(
            lambda x, axis=axis: float(mass.position(_states(robot, x[None]))[0, axis]), q[0]
        )
        assert np.abs(jacobian[axis] - expected).max() < 1e-8 * (1 + np.abs(expected).max())


def test_position_counts_what_is_locked_and_what_stands_still() -> None:
    arms = tuple(f"arm_{side}_{i}_joint" for side in ("left", "right") for i in range(1, 8))
    posture = {"leg_left_4_joint": 0.8, "torso_1_joint": 0.3}
    part = build_robot(RobotSpec(urdf="example-robot-data:talos", joints=arms, posture=posture))
    whole = build_robot(RobotSpec(urdf="example-robot-data:talos", base="floating"))
    q = part.draw_states(1, 2)[0]
    mass = CenterOfMass(part)
    full = whole.reference.copy()
    values = {**part.locked, **dict(zip(part.joint_names, q[0], strict=True))}
    for name, value in values.items():
        full[whole.model.joints[whole.model.getJointId(name)].idx_q] = value
    expected = pin.centerOfMass(whole.model, whole.model.createData(), full)
    assert np.isclose(mass.total_mass, pin.computeTotalMass(whole.model))
    assert relative_error(mass.position(_states(part, q))[0], expected) < 1e-9


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
