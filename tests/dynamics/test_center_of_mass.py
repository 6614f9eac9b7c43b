"""Centre of mass and Jacobian against Pinocchio on the whole robot, and against differences."""

import numpy as np
import pinocchio as pin
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.dynamics.center_of_mass import CenterOfMass
from excite_cli.dynamics.forward_kinematics import BatchKinematics, States
from excite_cli.excitation.gradient_check import central_differences, relative_error
from excite_cli.robot.model import Robot, build_robot
from tests.robot.random_robots import random_robot


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
