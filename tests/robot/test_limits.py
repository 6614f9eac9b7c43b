"""Position limits that are equal, reversed or missing, in every format; joints that follow others.

Of followers: their limits, where they stand, and what is told of wrong ones.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.config.load_spec import parse_spec
from excite_cli.config.robot_spec import JointLimits, RobotSpec
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.catalogue import urdf_friction
from excite_cli.effects.coulomb_friction import CoulombFriction
from excite_cli.effects.viscous_friction import ViscousFriction
from excite_cli.errors import ConfigError, RobotError
from excite_cli.excitation.boundary import posture_of as boundary_posture
from excite_cli.excitation.problem import build_problem
from excite_cli.proposal.assumed_limits import plan_limits
from excite_cli.proposal.joints import choose_joints
from excite_cli.proposal.propose import Proposal, Request, propose
from excite_cli.robot.description import load_description
from excite_cli.robot.link_frame import MovedBodies, leaves, link_frame, own_link
from excite_cli.robot.model import Robot, build_robot
from excite_cli.robot.overview import describe
from excite_cli.robot.tree import skeleton_of
from excite_cli.robot.urdf_joints import survey
from excite_cli.shown.note import Level
from excite_cli.summary.problem_notes import problem_notes
from tests.proposal.robots import GOOD, joint, link, serial, written
from tests.robot.coupled_robots import CLAW, HAND, coupled_robot, urdf_of
from tests.robot.formats.test_sdf import joint as sdf_joint
from tests.robot.formats.test_sdf import link as sdf_link
from tests.urdf_elements import robot_text

pytestmark = pytest.mark.long

KINDS = {"revolute": "hinge", "prismatic": "slide"}


def urdf(lower: float, upper: float, kind: str) -> str:
    limit = f'lower="{lower}" upper="{upper}" velocity="3" effort="50"'
    parts = [
        link("base"),
        joint("shoulder", "base", "upper", GOOD),
        link("upper"),
        joint("odd", "upper", "tip", limit, kind),
        link("tip"),
    ]
    return robot_text("robot", *parts)


def xacro(lower: float, upper: float, kind: str) -> str:
    text = urdf(lower, upper, kind).replace(f'lower="{lower}"', 'lower="${low}"')
    head = '<robot name="robot" xmlns:xacro="http://www.ros.org/wiki/xacro">'
    return text.replace(
        '<robot name="robot">', f'{head}<xacro:property name="low" value="{lower}"/>'
    )


def mjcf(lower: float, upper: float, kind: str, more: str = "") -> str:
    turn = 180 / math.pi if kind == "revolute" else 1.0  # degrees are the default
    bounds = f'range="{lower * turn!r} {upper * turn!r}" {more}'
    shape = '<geom type="box" size="0.05 0.05 0.1" pos="0 0 0.1" mass="1"/>'
    return (
        '<mujoco><worldbody><body name="upper"><joint name="shoulder" axis="0 1 0" '
        f'range="-110 110"/>{shape}<body name="tip" pos="0 0 0.25"><joint name="odd" '
        f'type="{KINDS[kind]}" axis="0 1 0" {bounds}/>{shape}</body></body></worldbody></mujoco>'
    )


def sdf(lower: float, upper: float, kind: str) -> str:
    links = (
        sdf_link(name, f"0 0 {k / 4} 0 0 0") for k, name in enumerate(("base", "upper", "tip"))
    )
    odd = sdf_joint("odd", "upper", "tip", kind=kind).replace("<lower>-1<", f"<lower>{lower}<")
    joints = sdf_joint("shoulder", "base", "upper") + odd.replace("<upper>2<", f"<upper>{upper}<")
    inside = "".join(links) + joints
    return f'<sdf version="1.8"><model name="robot">{inside}</model></sdf>'


FORMATS = {
    "robot.urdf": urdf,
    "robot.urdf.xacro": xacro,
    "robot.xml": mjcf,
    "limited.xml": lambda low, high, kind: mjcf(low, high, kind, 'limited="true"'),
    "robot.sdf": sdf,
}


def made(folder: Path, name: str, lower: float, upper: float, kind: str = "revolute") -> Path:
    path = folder / name
    path.write_text(FORMATS[name](lower, upper, kind), encoding="utf-8")
    return path


def proposed(path: Path, joints: tuple[str, ...] = ()) -> Proposal:
    return propose(Request(path.name, path.parent, joints))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", FORMATS)
def test_equal_limits_hold_a_joint(tmp_path: Path, name: str, kind: str) -> None:
    path = made(tmp_path, name, 0.05, 0.05, kind)
    robot = build_robot(RobotSpec(urdf=path.name), tmp_path)
    assert robot.joint_names == ("shoulder",)
    assert robot.locked == {"odd": pytest.approx(0.05)}
    found = proposed(path)
    assert found.joints == ("shoulder",)
    assert "odd" not in found.settled.tree["robot"].get("limits", {})
    assert found.settled.tree["robot"]["posture"]["odd"] == pytest.approx(0.05)
    assert found.settled.problem.robot.locked == {"odd": pytest.approx(0.05)}
    unit = "m" if kind == "prismatic" else "rad"
    assert f"not moved, held at 0.05 {unit} by equal position limits: odd" in found.notes
    with pytest.raises(ConfigError, match=r"--joints: 'odd' is held at 0.05 by equal"):
        proposed(path, ("shoulder", "odd"))
    text = f"robot: {{urdf: {name}}}\ncriterion: {{kind: log_det}}"
    said = [n.text for n in problem_notes(build_problem(parse_spec(text, "a config"), tmp_path))]
    assert "not moved, held by equal position limits: odd at 0.05" in said


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", FORMATS)
def test_reversed_limits_are_taken_the_other_way_round(
    tmp_path: Path, name: str, kind: str
) -> None:
    path = made(tmp_path, name, 0.7, 0.1, kind)
    robot = build_robot(RobotSpec(urdf=path.name), tmp_path)
    np.testing.assert_allclose([robot.limits.lower[1], robot.limits.upper[1]], [0.1, 0.7])
    found = proposed(path)
    limits = found.settled.problem.robot.limits
    np.testing.assert_allclose([limits.lower[1], limits.upper[1]], [0.1, 0.7])
    told = f"the position limits of odd are reversed in {name}, 0.7 to 0.1: they are taken as 0.1"
    assert any(note.startswith(told) for note in found.notes)
    said = list(problem_notes(found.settled.problem))
    assert any(note.text.startswith(told) and note.level is Level.WARNING for note in said)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", FORMATS)
def test_zero_and_zero_is_no_limit(tmp_path: Path, name: str, kind: str) -> None:
    found = proposed(made(tmp_path, name, 0.0, 0.0, kind))
    reach = 0.1 if kind == "prismatic" else 3.1
    assert found.settled.tree["robot"]["limits"]["odd"]["position"] == [-reach, reach]
    assert any(
        "assumed" in note and note.startswith("odd: the URDF gives no") for note in found.notes
    )


def test_a_config_still_moves_what_the_file_holds(tmp_path: Path) -> None:
    spec = RobotSpec(urdf=made(tmp_path, "robot.urdf", 0.5, 0.5).name)
    given = spec.model_copy(update={"limits": {"odd": JointLimits(position=(-1.0, 0.4))}})
    robot = build_robot(given, tmp_path)
    assert (robot.limits.lower[1], robot.limits.upper[1]) == (-1.0, 0.4)
    named = spec.model_copy(update={"joints": ("odd",)})
    with pytest.raises(ConfigError, match=r"'odd' is held at 0.5 .*robot.limits.odd.position"):
        build_robot(named, tmp_path)
    elsewhere = spec.model_copy(update={"posture": {"odd": 0.7}})
    with pytest.raises(ConfigError, match=r"posture.odd: 0.7 is not where it stands, 0.5"):
        build_robot(elsewhere, tmp_path)
    near = spec.model_copy(update={"posture": {"odd": 0.5001}})
    assert build_robot(near, tmp_path).locked == {"odd": 0.5}


def test_a_config_must_give_limits_that_are_missing(tmp_path: Path) -> None:
    spec = RobotSpec(urdf=made(tmp_path, "robot.urdf", 0.0, 0.0).name)
    with pytest.raises(ConfigError, match=r"'odd' has no position limits .*limits.odd.position"):
        build_robot(spec, tmp_path)
    still = spec.model_copy(update={"joints": ("shoulder",), "posture": {"odd": 0.7}})
    assert build_robot(still, tmp_path).locked == {"odd": 0.7}


def test_a_robot_of_which_nothing_moves(tmp_path: Path) -> None:
    held = 'lower="0.5" upper="0.5" velocity="3" effort="50"'
    path = written(tmp_path, link("base"), joint("odd", "base", "tip", held), link("tip"))
    with pytest.raises(RobotError, match="equal position limits hold every joint"):
        build_robot(RobotSpec(urdf=str(path)))
    with pytest.raises(RobotError, match=r"only held at 0\.5 rad by equal position limits: odd"):
        proposed(path)


@pytest.mark.parametrize(
    ("lower", "upper", "words"),
    [
        ("nan", "1", "is not a number of a real robot"),
        ("1", "nan", "is not a number of a real robot"),
        ("inf", "inf", "no robot can reach"),
        ("-inf", "-1e9", "no robot can reach"),
        ("2e9", "1e9", "no robot can reach"),
    ],
)
def test_limits_that_no_robot_has(tmp_path: Path, lower: str, upper: str, words: str) -> None:
    limit = f'lower="{lower}" upper="{upper}" velocity="3" effort="50"'
    path = written(tmp_path, link("base"), joint("odd", "base", "tip", limit), link("tip"))
    with pytest.raises(RobotError, match=words):
        load_description(str(path))


def follower(folder: Path, driver: str, limits: str, how: str) -> Path:
    """A joint, and one that follows it, with these limits."""
    more = f'<mimic joint="driver" {how}/>'
    driven = joint("driver", "upper", "one", f'{driver} velocity="3" effort="50"')
    second = joint("follower", "upper", "two", f'{limits} velocity="3" effort="50"', more=more)
    names = "base shoulder upper driver one"
    return serial(folder, names, second, link("two"), driver=driven)


def test_equal_limits_of_a_follower_hold_its_driver(tmp_path: Path) -> None:
    path = follower(
        tmp_path, 'lower="-1" upper="1"', 'lower="0.5" upper="0.5"', 'multiplier="2" offset="0.5"'
    )
    robot = build_robot(RobotSpec(urdf=str(path)))
    assert robot.joint_names == ("shoulder",)
    assert robot.locked == {"driver": 0.0, "follower": 0.5}
    found = proposed(path)
    assert found.joints == ("shoulder",)
    assert "not moved, held at 0 rad by equal position limits: driver" in found.notes
    assert found.settled.problem.robot.locked == robot.locked


def test_reversed_limits_of_a_follower_narrow_its_driver(tmp_path: Path) -> None:
    path = follower(tmp_path, 'lower="1" upper="-1"', 'lower="0.4" upper="-1"', 'multiplier="2"')
    robot = build_robot(RobotSpec(urdf=str(path)))
    assert (robot.limits.lower[1], robot.limits.upper[1]) == (-0.5, 0.2)
    limits = proposed(path).settled.problem.robot.limits
    assert (limits.lower[1], limits.upper[1]) == (-0.5, 0.2)


def test_followers_that_leave_no_range_do_not_widen_it(tmp_path: Path) -> None:
    path = follower(tmp_path, 'lower="-1" upper="0"', 'lower="0.5" upper="1"', 'multiplier="1"')
    with pytest.raises(ConfigError, match="leave it no range"):
        build_robot(RobotSpec(urdf=str(path)))
    found = proposed(path)
    assert found.joints == ("shoulder",)
    assert "driver" not in found.settled.tree["robot"].get("limits", {})
    with pytest.raises(ConfigError, match="'driver' has no range left"):
        proposed(path, ("driver",))


BOUND = st.one_of(
    st.sampled_from([0.0, -0.0, 0.5, -0.5, 1e-6, 30.0, 1e6, 1e9, -1e9, math.inf, -math.inf]),
    st.floats(-50, 50),
)


@settings(max_examples=300, deadline=None)
@given(lower=BOUND, upper=BOUND, kind=st.sampled_from(list(KINDS)))
def test_what_is_assumed_lies_within_what_is_given(
    tmp_path_factory: pytest.TempPathFactory, lower: float, upper: float, kind: str
) -> None:
    """Whatever a file says, a plan never leaves it: but for 0 and 0, which says nothing."""
    low, high = min(lower, upper), max(lower, upper)
    path = tmp_path_factory.getbasetemp() / "any.urdf"
    path.write_text(urdf(lower, upper, kind), encoding="utf-8")
    try:
        joints = survey(load_description(str(path))).joints
    except RobotError:
        assert low >= 1e9 or high <= -1e9
        return
    choice = choose_joints(joints, "robot", () if low == high != 0 else ("shoulder", "odd"))
    plans = {plan.name: plan for plan in plan_limits(choice.chosen)}
    if low == high != 0.0:
        assert "odd" not in plans
        return
    plan = plans["odd"]
    assert math.isfinite(plan.lower)
    assert math.isfinite(plan.upper)
    assert plan.lower < plan.upper
    if not low == high == 0.0:
        assert low <= plan.lower < plan.upper <= high
    assert ("position" in plan.notes) == ((plan.lower, plan.upper) != (low, high))


def claw(folder: Path, old: str = "", new: str = "", **spec: Any) -> Robot:
    """The claw with something else in its URDF."""
    text = urdf_of(CLAW)
    assert old in text
    (folder / "claw.urdf").write_text(text.replace(old, new))
    return build_robot(RobotSpec(urdf="claw.urdf", **spec), folder)


def test_drivers_alone_are_moved_joints() -> None:
    robot = coupled_robot(CLAW)
    assert robot.joint_names == ("shoulder", "wrist", "knuckle")
    assert robot.n == 3
    assert robot.tree.n == 8
    assert set(robot.followers[2]) == set(robot.tree.joint_names) - set(robot.joint_names)
    assert robot.parents == (-1, 0, 1)
    assert leaves(robot) == (2,)
    assert skeleton_of(robot).fits(3)
    links = describe(robot).joints[2].links
    assert links[0] == "left_outer"
    parts = ("outer", "finger", "inner")
    assert set(links) == {f"{side}_{part}" for side in ("left", "right") for part in parts}


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
    tip, palm = (
        data.oMf[robot.model.getFrameId(name)].rotation for name in ("left_finger", "palm")
    )
    np.testing.assert_allclose(tip, palm, atol=1e-12)  # the finger stays parallel
    locked = coupled_robot(CLAW, joints=("shoulder", "wrist"), posture={"knuckle": 0.4})
    assert locked.coupling is None
    assert locked.locked["right_tip"] == pytest.approx(0.9 * 0.4 + 0.05)


def test_followers_narrow_the_limits_of_their_driver(tmp_path: Path) -> None:
    limit, narrow = (
        f'lower="{low}" upper="{high}" velocity="{speed}" effort="30"'
        for low, high, speed in ((-0.9, 0.9, 2), (-0.5, 0.3, 0.9))
    )
    tail = urdf_of(CLAW).split('name="right_tip"')[1]
    given = {"left_tip": JointLimits(acceleration=5.0, jerk=60.0)}
    limits = claw(tmp_path, tail, tail.replace(limit, narrow, 1), limits=given).limits
    # right_tip stands at 0.9 q + 0.05, at most 0.3
    assert limits.upper[2] == pytest.approx((0.3 - 0.05) / 0.9)
    assert limits.lower[2] == 0.0
    assert limits.velocity[2] == pytest.approx(0.9 / 0.9)
    assert limits.acceleration[2] == 5.0
    assert limits.jerk[2] == 60.0
    assert limits.effort[2] == 30.0
    robot = claw(tmp_path, 'lower="-0.9" upper="0.9" velocity="2"', 'velocity="0"')
    assert robot.limits.upper[2] == 0.8, "followers without limits do not narrow"
    assert robot.limits.velocity[2] == 2.0


def test_what_contradicts_the_driver_is_told(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"posture.left_tip: 0.3 is not where it stands, -0.4: it "
                                          r"mimics 'knuckle'.*robot.posture.knuckle"):  # fmt: skip
        coupled_robot(CLAW, posture={"knuckle": 0.4, "left_tip": 0.3})
    assert coupled_robot(CLAW, posture={"knuckle": 0.4, "left_tip": -0.4}).posture[2] == 0.4
    with pytest.raises(ConfigError, match=r"'finger_2' mimics 'finger_1' and moves with"):
        coupled_robot(HAND, joints=("finger_2",))
    with pytest.raises(ConfigError, match=r"joint 'finger_2' follows another joint \(mimic\)"):
        boundary_posture(coupled_robot(HAND), {"finger_2": 0.02}, "trajectory.start")
    with pytest.raises(ConfigError, match=r"'knuckle' may stand in \[0, 0.8\].*mimic it \(.*range"):
        claw(tmp_path, 'lower="-0.9" upper="0.9"', 'lower="2" upper="3"')


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
