import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.dynamics.forward_kinematics import BatchKinematics
from excite_cli.robot.model import Robot, build_robot

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


@settings(max_examples=10, deadline=None, derandomize=True)
@given(st.integers(0, 10_000))
def test_each_instant_stands_alone(seed: int) -> None:
    robot = build_robot(ROBOTS["ur10_turned"])
    q, _, _ = robot.draw_states(3, seed)
    kinematics = BatchKinematics(robot)
    together = kinematics.placements(q)
    alone = kinematics.placements(q[1:2])
    for many, one in zip(together, alone, strict=True):
        np.testing.assert_allclose(many[1], one[0], atol=1e-14)
