"""Joints that follow others: their limits, where they stand, and what is told of wrong ones."""

from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from excite_cli.config.robot_spec import JointLimits, RobotSpec
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.catalogue import urdf_friction
from excite_cli.effects.coulomb_friction import CoulombFriction
from excite_cli.effects.viscous_friction import ViscousFriction
from excite_cli.errors import ConfigError, RobotError
from excite_cli.excitation.boundary import posture_of as boundary_posture
from excite_cli.robot.carried_bodies import MovedBodies
from excite_cli.robot.link_frame import leaves, link_frame, own_link
from excite_cli.robot.model import Robot, build_robot
from excite_cli.robot.overview import describe
from excite_cli.robot.tree import skeleton_of
from tests.robot.coupled_robots import CLAW, HAND, coupled_robot, urdf_of


def claw(folder: Path, old: str = "", new: str = "", **spec: Any) -> Robot:
    """The claw with something else in its URDF."""
    text = urdf_of(CLAW)
    assert old in text
    path = folder / "claw.urdf"
    path.write_text(text.replace(old, new))
    return build_robot(RobotSpec(urdf=str(path), **spec))


def test_drivers_alone_are_moved_joints() -> None:
    robot = coupled_robot(CLAW)
    assert robot.joint_names == ("shoulder", "wrist", "knuckle")
    assert robot.n == 3
    assert robot.tree.n == 8
    assert set(robot.followers[2]) == set(robot.tree.joint_names) - set(robot.joint_names)
    assert robot.parents == (-1, 0, 1)
    assert leaves(robot) == (2,)
    assert skeleton_of(robot).fits(3)


def test_links_of_followers_belong_to_the_driver() -> None:
    knuckle = describe(coupled_robot(CLAW)).joints[2]
    assert knuckle.links[0] == "left_outer"
    assert set(knuckle.links) == {
        f"{side}_{part}" for side in ("left", "right") for part in ("outer", "finger", "inner")
    }


def test_chains_of_followers_end_at_the_driver() -> None:
    """As Pinocchio's own kinematics has it, joint by joint."""
    robot = coupled_robot(CLAW)
    q = np.array([0.1, 0.2, 0.5])
    at = dict(zip(robot.tree.joint_names, robot.all_positions(q), strict=True))
    assert at["knuckle"] == 0.5
    assert at["left_tip"] == -0.5
    assert at["right_inner_joint"] == -0.5
    assert at["right_tip"] == pytest.approx(-0.9 * -0.5 + 0.05)
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, robot.configurations(q[None])[0])
    tip = data.oMf[robot.model.getFrameId("left_finger")].rotation
    palm = data.oMf[robot.model.getFrameId("palm")].rotation
    np.testing.assert_allclose(tip, palm, atol=1e-12)  # the finger stays parallel


def test_followers_narrow_the_limits_of_their_driver(tmp_path: Path) -> None:
    narrow = 'lower="-0.5" upper="0.3" velocity="0.9" effort="30"'
    limit = 'lower="-0.9" upper="0.9" velocity="2" effort="30"'
    text = urdf_of(CLAW)
    head, tail = text.split('name="right_tip"')
    (tmp_path / "claw.urdf").write_text(f'{head}name="right_tip"{tail.replace(limit, narrow, 1)}')
    given = {"left_tip": JointLimits(acceleration=5.0)}
    robot = build_robot(RobotSpec(urdf=str(tmp_path / "claw.urdf"), limits=given))
    limits = robot.limits
    # right_tip stands at 0.9 q + 0.05, at most 0.3
    assert limits.upper[2] == pytest.approx((0.3 - 0.05) / 0.9)
    assert limits.lower[2] == 0.0
    assert limits.velocity[2] == pytest.approx(0.9 / 0.9)
    assert limits.acceleration[2] == 5.0
    assert limits.effort[2] == 30.0


def test_followers_without_limits_do_not_narrow(tmp_path: Path) -> None:
    robot = claw(tmp_path, 'lower="-0.9" upper="0.9" velocity="2"', 'velocity="0"')
    assert robot.limits.upper[2] == 0.8
    assert robot.limits.velocity[2] == 2.0


def test_limits_of_followers_that_leave_nothing_are_told(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"'knuckle' may stand in \[0, 0.8\].*mimic it \(.*range"):
        claw(tmp_path, 'lower="-0.9" upper="0.9"', 'lower="2" upper="3"')


def test_a_follower_of_a_locked_driver_stands_where_that_leads_it() -> None:
    robot = coupled_robot(CLAW, joints=("shoulder", "wrist"), posture={"knuckle": 0.4})
    assert robot.coupling is None
    assert robot.locked["right_tip"] == pytest.approx(0.9 * 0.4 + 0.05)


def test_a_posture_that_contradicts_the_driver_is_told() -> None:
    with pytest.raises(ConfigError, match=r"posture.left_tip: 0.3 is not where it stands, -0.4: it "
                                          r"mimics 'knuckle'.*robot.posture.knuckle"):  # fmt: skip
        coupled_robot(CLAW, posture={"knuckle": 0.4, "left_tip": 0.3})
    assert coupled_robot(CLAW, posture={"knuckle": 0.4, "left_tip": -0.4}).posture[2] == 0.4


def test_a_follower_cannot_be_moved_alone() -> None:
    with pytest.raises(ConfigError, match=r"'finger_2' mimics 'finger_1' and moves with"):
        coupled_robot(HAND, joints=("finger_2",))


def test_a_motion_names_the_driver_where_it_begins() -> None:
    robot = coupled_robot(HAND)
    with pytest.raises(ConfigError, match=r"joint 'finger_2' follows another joint \(mimic\)"):
        boundary_posture(robot, {"finger_2": 0.02}, "trajectory.start")


def test_what_nobody_can_follow_is_told(tmp_path: Path) -> None:
    robot = claw(tmp_path, '<mimic joint="knuckle" multiplier="-1.0"', '<mimic joint="knuckl"')
    assert {"left_tip", "right_knuckle", "right_tip"} == set(robot.locked)
    assert robot.description.notes[0] == (
        "'left_tip' mimics 'knuckl', which is no joint of the URDF: the joint is locked. Did you "
        "mean 'knuckle'?"
    )
    with pytest.raises(RobotError, match=r"in a circle \(.*left_inner_joint → left_inner_joint\)"):
        claw(tmp_path, '<mimic joint="knuckle" multiplier="1.0"',
             '<mimic joint="left_inner_joint"')  # fmt: skip


def test_friction_of_followers_is_felt_at_the_driver(tmp_path: Path) -> None:
    text = urdf_of(HAND).replace(
        '<mimic joint="finger_1"/>',
        '<mimic joint="finger_1" multiplier="-0.5"/><dynamics damping="4" friction="3"/>',
    ).replace('lower="0" upper="0.04"', 'lower="-0.04" upper="0.04"')  # fmt: skip
    (tmp_path / "hand.urdf").write_text(text)
    effects, values = urdf_friction(build_robot(RobotSpec(urdf=str(tmp_path / "hand.urdf"))))
    assert effects == (ViscousFriction((2,)), CoulombFriction((2,)))
    np.testing.assert_allclose(values, [1.0, 1.5])


def test_the_mass_of_a_follower_is_a_parameter_of_its_driver() -> None:
    robot = coupled_robot(HAND)
    base = find_base_parameters(robot)
    names = [base.names[index] for index in base.selection]
    assert {"m[finger_1]", "m[finger_2]"} <= set(names)
    row = base.mapping[names.index("m[finger_2]")]
    assert row @ standard_parameters(robot) == pytest.approx(0.12)


def test_links_that_followers_carry_hold_no_load() -> None:
    robot = coupled_robot(HAND)
    assert link_frame(robot, "left_finger", "--link").joint == 2
    assert own_link(robot.tree, 3).name == "right_finger"
    with pytest.raises(ConfigError, match=r"'right_finger' is carried by 'finger_2', which"):
        link_frame(robot, "right_finger", "--link")


def test_what_moves_two_links_against_each_other() -> None:
    robot = coupled_robot(CLAW)
    joints = {str(name): k for k, name in enumerate(robot.model.names)}
    moved = MovedBodies(robot)
    assert moved.between(joints["left_tip"], joints["right_tip"]).tolist() == [2]
    assert moved.between(joints["shoulder"], joints["right_tip"]).tolist() == [1, 2]
    assert moved.moving(joints["right_inner_joint"]).tolist() == [0, 1, 2]
