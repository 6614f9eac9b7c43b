"""Joints that stay still: of any kind, and whatever they are called."""

from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.errors import RobotError
from excite_cli.robot.description import load_description
from excite_cli.robot.model import build_robot, links_by_joint
from tests.proposal.robots import GOOD, joint, link, written


@pytest.mark.parametrize("kind", ["planar", "floating"])
def test_a_base_that_drives_or_floats_stands_still(tmp_path: Path, kind: str) -> None:
    written(
        tmp_path,
        '<link name="world"/>',
        joint("drive", "world", "body", kind=kind),
        link("body", 20),
        joint("arm", "body", "tip", GOOD),
        link("tip"),
    )
    robot = build_robot(RobotSpec(urdf="robot.urdf", joints=("arm",)), tmp_path)
    assert robot.joint_names == ("arm",)
    assert robot.model.nv == 1
    with pytest.raises(RobotError, match=r"'drive' is of type .*under robot\.joints"):
        build_robot(RobotSpec(urdf="robot.urdf"), tmp_path)


def test_a_locked_joint_may_be_called_as_a_link(tmp_path: Path) -> None:
    written(
        tmp_path,
        link("base"),
        joint("arm", "base", "upper", GOOD),
        link("upper"),
        joint("gripper", "upper", "jaw", GOOD),
        link("jaw"),
        joint("fixed", "upper", "gripper", kind="fixed"),
        link("gripper", 2.0),
    )
    robot = build_robot(RobotSpec(urdf="robot.urdf", joints=("arm",)), tmp_path)
    assert set(links_by_joint(robot)["arm"]) == {"upper", "gripper", "jaw"}
    assert np.isclose(robot.model.inertias[1].mass, 4.0)


def test_a_right_angle_that_was_rounded_is_exact(tmp_path: Path) -> None:
    """An upright axis tilted by 4e-6 rad shows first moments that nobody can measure."""
    turned = joint("pan", "base", "upper", GOOD).replace(
        '<origin xyz="0 0 0.25"/>', '<origin xyz="0 0 0.25" rpy="1.5708 0.3 -3.14159"/>'
    )
    written(tmp_path, link("base"), turned, link("upper"))
    text = load_description(str(tmp_path / "robot.urdf")).xml
    assert f'rpy="{np.pi / 2!r} 0.3 {-np.pi!r}"' in text
    upright = joint("pan", "base", "upper", GOOD).replace(
        '<origin xyz="0 0 0.25"/>', '<origin xyz="0 0 0.25" rpy="1.5708 0 0"/>'
    )
    written(tmp_path, link("base"), upright, link("upper"))
    robot = build_robot(RobotSpec(urdf="robot.urdf"), tmp_path)
    assert find_base_parameters(robot).rank == 1  # turning about the vertical: Iyy alone
