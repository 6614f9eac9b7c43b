"""Which joints are chosen: arms and legs, no fingers, no wheels, unless there is nothing else."""

from pathlib import Path

import pytest

from excite_cli.errors import ConfigError, RobotError
from excite_cli.proposal.joints import JointChoice, choose_joints
from excite_cli.proposal.propose import Request, propose
from excite_cli.robot.description import EXAMPLE_PREFIX, load_description
from excite_cli.robot.urdf_joints import survey
from tests.proposal.robots import GOOD, joint, link, serial, surveyed, written

TINY = 'lower="-0.0005" upper="0.001" velocity="1" effort="10"'


def chosen(name: str, asked: tuple[str, ...] = ()) -> JointChoice:
    return choose_joints(survey(load_description(EXAMPLE_PREFIX + name)).joints, name, asked)


@pytest.mark.parametrize(
    ("robot", "count", "word"),
    [
        ("ur10", 6, ""),
        ("panda", 7, "finger"),
        ("talos", 30, "gripper"),
        ("tiago_dual", 17, "wheel"),
        ("b1-z1", 18, "jointGripper"),
        ("allegro_left_hand", 16, ""),
        ("finger_edu", 3, ""),
        ("human", 36, ""),
        ("romeo", 31, "LHand"),
    ],
)
def test_arms_legs_and_hands_alone_are_chosen(robot: str, count: int, word: str) -> None:
    choice = chosen(robot)
    assert len(choice.chosen) == count, [joint.name for joint in choice.chosen]
    assert word in " ".join(name for names in choice.left_out.values() for name in names)


def test_a_wrist_named_after_the_gripper_moves_and_rotors_do_not() -> None:
    names = [joint.name for joint in chosen("alex_nub_hands").chosen]
    assert "LeftGripperYaw" in names
    # Only rotors is a robot without anything to move.
    with pytest.raises(RobotError, match=r"iris has no arm, leg or hand to move, only rotors: "):
        chosen("iris")


def test_what_is_asked_for_is_moved() -> None:
    choice = chosen("panda", ("panda_finger_joint1", "panda_joint2"))
    assert [joint.name for joint in choice.chosen] == ["panda_joint2", "panda_finger_joint1"]
    # A joint that mimics cannot be asked for.
    words = r"'panda_finger_joint2' mimics 'panda_finger_joint1' and moves with it\. Leave it out"
    with pytest.raises(ConfigError, match=words):
        chosen("panda", ("panda_finger_joint2",))
    # A joint that mimics does as its driver does.
    choice = chosen("panda", ("panda_finger_joint1",))
    assert choice.followers == {"panda_finger_joint1": ("panda_finger_joint2",)}
    assert "moved with panda_finger_joint1: panda_finger_joint2" in choice.in_words()
    assert "panda_finger_joint2" not in choice.left_out["not requested"]
    assert "panda_finger_joint2" in chosen("panda").left_out["fingers and grippers"]
    # An unknown joint is told with the nearest.
    with pytest.raises(ConfigError, match=r"no joint 'elbow'\. Did you mean 'elbow_joint'\?"):
        chosen("ur10", ("elbow",))


WHY = {
    "eyes_pitch": ("faces", {}),
    "jaw_bellows": ("springs, bellows and hoses", {}),
    "flexure": ("joints with a range below 0.02 rad", {"limit": TINY}),
    "tool_slide": ("joints with a range below 0.002 m", {"limit": TINY, "kind": "prismatic"}),
    "drive": ("wheels and casters", {"kind": "continuous", "child": "left_wheel"}),
}


@pytest.mark.parametrize("name", WHY)
def test_joints_that_should_not_move_are_left_out_with_the_reason(
    name: str, tmp_path: Path
) -> None:
    why, given = WHY[name]
    end = given.get("child", "end")
    limit, kind = given.get("limit", GOOD), given.get("kind", "revolute")
    own = {name: joint(name, "upper", end, limit, kind), end: link(end, mass=0.01)}
    path = serial(tmp_path, f"base shoulder upper {name} {end}", **own)
    choice = choose_joints(surveyed(path).joints, "robot")
    assert choice.left_out == {why: (name,)}
    assert [each.name for each in choice.chosen] == ["shoulder"]


def test_joints_of_a_mobile_base_stay(tmp_path: Path) -> None:
    path = serial(
        tmp_path,
        "world drive body arm tip",
        world='<link name="world"/>',
        drive=joint("drive", "world", "body", kind="planar"),
    )
    choice = choose_joints(surveyed(path).joints, "robot")
    assert [joint.name for joint in choice.chosen] == ["arm"]
    assert choice.left_out == {"joints of the base": ("drive",)}
    # A robot without joints says so.
    with pytest.raises(RobotError, match="robot has no movable joint"):
        choose_joints(surveyed(written(tmp_path, link("base"))).joints, "robot")
    # The same joints move if asked for or where they carry the robot.
    names = "base eye_of_the_crane upper bellows end"
    path = serial(tmp_path, names, end=link("end", mass=0.01))
    joints = surveyed(path).joints
    assert [each.name for each in choose_joints(joints, "robot").chosen] == ["eye_of_the_crane"]
    asked = choose_joints(joints, "robot", ("bellows",)).chosen
    assert [each.name for each in asked] == ["bellows"]


@pytest.mark.parametrize(
    "closing",
    [
        '<loop_joint name="loop"><link1 link="rod"/><link2 link="crank"/></loop_joint>',
        '<gazebo><joint name="loop" type="revolute"><parent>robot::rod</parent><child>crank</child>'
        "</joint></gazebo>",
    ],
)
def test_joints_of_a_closed_loop_stay_where_they_are(closing: str, tmp_path: Path) -> None:
    shin = joint("knee", "upper", "shin", GOOD), link("shin")
    rod = joint("pin", "shin", "rod", GOOD), link("rod")
    path = serial(tmp_path, "base shoulder upper motor crank", *shin, *rod, closing)
    choice = choose_joints(surveyed(path).joints, "robot")
    assert choice.left_out == {
        "joints of closed loops, which the model cuts": ("motor", "knee", "pin")
    }
    (told,) = load_description(str(path)).notes
    assert told.startswith(
        "a closed loop is cut between rod and crank: in the model, motor, knee, "
    )
    assert "<mimic>" in told
    text = propose(Request("robot.urdf", tmp_path)).text
    assert "not moved, joints of closed loops, which the model cuts: motor, knee, pin" in text
