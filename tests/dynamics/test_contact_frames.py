"""Readings of an inertial unit on a base that tilts."""

import numpy as np
import pinocchio as pin
import pytest

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.dynamics.contact_frames import readings
from excite_cli.robot.model import build_robot


def test_a_unit_reads_how_its_place_turns_and_accelerates_less_gravity() -> None:
    """By differences of where it is in the world, on a body that is tilted in every way."""
    robot, step = build_robot(RobotSpec(urdf="example-robot-data:ur5")), 1e-3
    t = step * np.arange(-2, 3)
    rate, phase = np.linspace(0.7, 1.9, robot.n), np.arange(robot.n)
    angle = t[:, None] * rate + phase
    states = np.sin(angle), rate * np.cos(angle), -(rate**2) * np.sin(angle)
    turn, lever = pin.exp3(np.array([0.3, -0.5, 0.8])), np.array([0.1, -0.2, 0.05])
    gravity, data = np.array([0.4, -0.3, -9.7]), robot.model.createData()
    axes, points = [], []
    for q in robot.configurations(states[0]):
        pin.forwardKinematics(robot.model, data, q)
        place = data.oMi[robot.model_joints[5]]
        axes.append(place.rotation @ turn)
        points.append(place.act(lever))
    rates, forces = readings(robot, 5, (turn, lever), states, gravity)
    accelerates = (points[3] - 2 * points[2] + points[1]) / step**2
    assert forces[2] == pytest.approx(axes[2].T @ (accelerates - gravity), abs=1e-4)
    turned = pin.log3(axes[1].T @ axes[3]) / (2 * step)
    assert rates[2] == pytest.approx(turned, abs=1e-4)
