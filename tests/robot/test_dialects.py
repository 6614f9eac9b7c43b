"""Capsules and ball joints of simulators' URDFs."""

from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.geometry.link_shapes import collision_model, placed_shapes
from excite_cli.robot.description import load_description
from excite_cli.robot.model import build_robot
from tests.proposal.robots import GOOD, joint, link, written


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    """A capsule along x, ended by NULs as PyBullet's humanoid is."""
    shape = (
        '<collision><origin xyz="0 0 0.5" rpy="0 1.5707963267948966 0"/><geometry>'
        '<capsule radius="0.1" length="0.6"/></geometry></collision>'
    )
    path = written(
        tmp_path,
        link("base"),
        joint("neck", "base", "head", kind="spherical"),
        link("head"),
        joint("j", "head", "arm", GOOD),
        link("arm", shape=shape),
    )
    path.write_text(path.read_text() + "\r\n\0\0")
    return path


def test_a_capsule_is_a_cylinder_with_two_balls(robot: Path) -> None:
    built = build_robot(RobotSpec(urdf=str(robot)))
    found = placed_shapes(built, collision_model(built))
    points = np.vstack([corners for _, name, corners in found if name == "arm"])
    np.testing.assert_allclose(np.ptp(points, axis=0), [0.8, 0.2, 0.2], rtol=0.02)
    np.testing.assert_allclose(points.mean(axis=0), [0, 0, 0.5], atol=0.01)


def test_a_ball_joint_stays_and_is_told(robot: Path) -> None:
    found = load_description(str(robot))
    assert "ball joints stay where they are: neck" in found.notes
    assert build_robot(RobotSpec(urdf=str(robot))).joint_names == ("j",)
