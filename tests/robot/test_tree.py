"""Joints in the posture and the tree they make, joints that stay still, and what is no skeleton."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.load_spec import load_spec
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.effects.catalogue import kind_named
from excite_cli.errors import RobotError
from excite_cli.robot.description import load_description
from excite_cli.robot.link_frame import branches, leaves
from excite_cli.robot.model import Robot, build_robot, links_by_joint
from excite_cli.robot.tree import skeleton_of
from tests.cli.program import SMOKE
from tests.proposal.robots import GOOD, joint, link, serial, written
from tests.robot.random_robots import random_robot


def _arm() -> Robot:
    return build_robot(load_spec(SMOKE).robot, SMOKE.parent)


def test_a_chain_follows_its_parents_and_ends_in_a_tip() -> None:
    robot = _arm()
    skeleton, n = skeleton_of(robot), robot.n
    assert len(skeleton.joints) == n
    assert skeleton.parents == tuple(range(-1, n - 1))
    assert skeleton.tips[:-1] == skeleton.joints[:-1]
    assert skeleton.fits(n)
    for change in ({"parents": (0,)}, {"parents": (9, 0, 1, 2, 3)}, {"base": (np.nan, 0.0, 0.0)}):
        assert not replace(skeleton, **change).fits(n), "this is no skeleton of this robot"
    turned = skeleton_of(replace(robot, posture=np.full(n, 0.3) * ~robot.sliding))
    lengths, before = (
        np.linalg.norm(np.diff(of.joints, axis=0), axis=1)[~robot.sliding[1:]]
        for of in (turned, skeleton)
    )
    assert lengths == pytest.approx(before)
    assert turned.joints != skeleton.joints


def test_a_chain_is_one_branch() -> None:
    robot = random_robot(3, joints=4, branches=False, prismatic=False)
    assert branches(robot) == [(0, 1, 2, 3)]
    assert kind_named("torque_delay").places(robot) == [(0, 1, 2, 3), (0,), (1,), (2,), (3,)]


def test_a_branch_is_what_carries_one_leaf_alone() -> None:
    robot = next(r for r in map(random_robot, range(40)) if len(leaves(r)) > 1 and r.n > 3)
    model, first = robot.model, int(robot.model.njoints) - robot.n
    for leaf, branch in zip(leaves(robot), branches(robot), strict=True):
        path = {int(j) - first for j in model.supports[leaf + first] if int(j) >= first}
        others = set()
        for other in leaves(robot):
            if other != leaf:
                others |= {int(j) - first for j in model.supports[other + first]}
        assert set(branch) == path - others
    assert not set(branches(robot)[0]) & set(branches(robot)[1])


@pytest.mark.parametrize("kind", ["planar", "floating"])
def test_a_base_that_drives_or_floats_stands_still(tmp_path: Path, kind: str) -> None:
    drive = joint("drive", "world", "body", kind=kind)
    arm = joint("arm", "body", "tip", GOOD)
    written(tmp_path, '<link name="world"/>', drive, link("body", 20), arm, link("tip"))
    robot = build_robot(RobotSpec(urdf="robot.urdf", joints=("arm",)), tmp_path)
    assert robot.joint_names == ("arm",)
    assert robot.model.nv == 1
    with pytest.raises(RobotError, match=r"'drive' is of type .*under robot\.joints"):
        build_robot(RobotSpec(urdf="robot.urdf"), tmp_path)


def test_a_locked_joint_may_be_called_as_a_link(tmp_path: Path) -> None:
    hand = joint("fixed", "upper", "gripper", kind="fixed"), link("gripper", 2.0)
    serial(tmp_path, "base arm upper gripper jaw", *hand)
    robot = build_robot(RobotSpec(urdf="robot.urdf", joints=("arm",)), tmp_path)
    assert set(links_by_joint(robot)["arm"]) == {"upper", "gripper", "jaw"}
    assert np.isclose(robot.model.inertias[1].mass, 4.0)


def test_a_right_angle_that_was_rounded_is_exact(tmp_path: Path) -> None:
    """An upright axis tilted by 4e-6 rad shows first moments that nobody can measure."""

    def panned(angles: str) -> str:
        turned = joint("pan", "base", "upper", GOOD).replace(
            '<origin xyz="0 0 0.25"/>', f'<origin xyz="0 0 0.25" rpy="{angles}"/>'
        )
        return str(written(tmp_path, link("base"), turned, link("upper")))

    text = load_description(panned("1.5708 0.3 -3.14159")).xml
    assert f'rpy="{np.pi / 2!r} 0.3 {-np.pi!r}"' in text
    robot = build_robot(RobotSpec(urdf=panned("1.5708 0 0")))
    assert find_base_parameters(robot).rank == 1  # turning about the vertical: Iyy alone
