"""A proposal works as it is: the config loads, its posture is clear, and it gives a motion."""

from pathlib import Path

import pytest

from excite_cli.config.load_spec import parse_spec
from excite_cli.errors import ConfigError, RobotError
from excite_cli.excitation.problem import build_problem
from excite_cli.excitation.start import clear_posture
from excite_cli.excitation.task import MotionTask
from excite_cli.proposal.joints import limbs
from excite_cli.proposal.propose import Request, propose
from excite_cli.proposal.shapes import reference_posture, srdf_near
from excite_cli.robot.allowed_files import OutsideError
from excite_cli.robot.description import EXAMPLE_PREFIX, load_description
from excite_cli.robot.urdf_joints import survey
from tests.proposal.robots import GOOD, TETRAHEDRON, arm, joint, link, serial, written
from tests.summary.two_arms import two_arms

pytestmark = pytest.mark.long

BOTTOM = 'lower="0" upper="2.5" velocity="3" effort="50"'


def test_the_posture_is_clear_as_written(tmp_path: Path) -> None:
    arm(tmp_path, second=BOTTOM)
    proposal = propose(Request("robot.urdf", tmp_path))
    problem = build_problem(parse_spec(proposal.text), tmp_path)
    assert clear_posture(MotionTask(problem), 1).as_configured
    assert proposal.joints == ("shoulder", "elbow")
    # What was assumed stands beside the key.
    arm(tmp_path, 'lower="-2" upper="2" velocity="0" effort="0"')
    text = propose(Request("robot.urdf", tmp_path)).text
    line = next(line for line in text.splitlines() if "velocity: 3.1" in line)
    assert "the URDF gives 0 rad/s; 3.1 rad/s assumed" in line
    # A torque that does not hold the arm is given up. Horizontal whatever the posture, an arm of 2
    # kg needs more than 0.1 N·m.
    weak = 'lower="1.2" upper="1.9" velocity="3" effort="0.1"'
    arm(tmp_path, weak)
    proposal = propose(Request("robot.urdf", tmp_path))
    assert any("shoulder: the URDF's effort does not hold it up" in n for n in proposal.notes)


def test_the_distance_kept_yields_where_links_are_close(tmp_path: Path) -> None:
    near = (
        '<collision><origin xyz="{x} 0 0.12"/><geometry><box size="0.05 0.05 0.16"/></geometry>'
        "</collision>"
    )
    tight = 'lower="-0.05" upper="0.05" velocity="3" effort="50"'
    one, two = (link(name, shape=near.format(x=x)) for name, x in (("one", 0), ("two", 0.079)))
    joints = joint("a", "base", "one", tight), joint("b", "base", "two", tight)
    written(tmp_path, link("base", shape=""), one, two, *joints)
    problem = propose(Request("robot.urdf", tmp_path)).settled.problem
    assert problem.spec.constraints.self_collision is not None
    assert 0 < problem.spec.constraints.self_collision.margin < 0.01


def test_without_inertias_those_of_the_shapes_are_assumed(tmp_path: Path) -> None:
    arm(tmp_path, mass=-1)
    proposal = propose(Request("robot.urdf", tmp_path))
    assert parse_spec(proposal.text).robot.density == 1000.0
    assert any("the URDF has no masses" in note for note in proposal.notes)
    box = 1000.0 * 0.05 * 0.05 * 0.16
    masses = [inertia.mass for inertia in proposal.settled.problem.robot.model.inertias[1:]]
    assert masses == pytest.approx([box, box])
    # Without inertias and shapes one sentence says so.
    written(tmp_path, link("base", -1, ""), joint("j", "base", "l", GOOD), link("l", -1, ""))
    with pytest.raises(RobotError, match=r"^robot\.urdf has no <inertial> at all, and no shapes"):
        propose(Request("robot.urdf", tmp_path))
    written(tmp_path, link("base", 0, ""), joint("j", "base", "l", GOOD), link("l", 0, ""))
    with pytest.raises(RobotError, match=r"^robot\.urdf has no mass: every <mass> is 0"):
        propose(Request("robot.urdf", tmp_path))
    # Without collision geometry distances are not asked for.
    bare = {name: link(name, shape="") for name in ("base", "upper", "lower")}
    serial(tmp_path, "base shoulder upper elbow lower", **bare)
    proposal = propose(Request("robot.urdf", tmp_path))
    assert proposal.settled.problem.spec.constraints.self_collision is None
    assert any("no collision geometry" in note for note in proposal.notes)


def test_packages_are_found_above_the_urdf(tmp_path: Path) -> None:
    mesh = tmp_path / "ws" / "src" / "arm_description" / "meshes" / "arm.stl"
    mesh.parent.mkdir(parents=True)
    mesh.write_text(TETRAHEDRON)
    folder = tmp_path / "ws" / "urdf"
    folder.mkdir()
    shape = (
        '<collision><origin xyz="0 0 0.1"/><geometry>'
        '<mesh filename="package://arm_description/meshes/arm.stl"/></geometry></collision>'
    )
    own = {name: link(name, shape=shape) for name in ("upper", "lower")}
    serial(folder, "base shoulder upper elbow lower", base=link("base", shape=""), **own)
    with pytest.raises(OutsideError, match="the package 'arm_description' in"):
        propose(Request("urdf/robot.urdf", tmp_path / "ws"))
    request = Request("urdf/robot.urdf", tmp_path / "ws", allow=lambda needed: True)
    proposal = propose(request)
    assert "package_dirs: [src/arm_description]" in proposal.text
    assert any("read the package 'arm_description' in" in note for note in proposal.notes)


def test_limbs_and_reference_posture_of_a_humanoid() -> None:
    description = load_description(EXAMPLE_PREFIX + "talos")
    near = srdf_near(description.path)
    file, state, values = reference_posture(near, description.path, ("leg_left_4_joint",))
    assert (file, state) == ("talos.srdf", "half_sitting")
    assert values["leg_left_4_joint"] == pytest.approx(0.859395)
    # Limbs of a humanoid.
    joints = survey(load_description(EXAMPLE_PREFIX + "talos")).joints
    groups = limbs([joint for joint in joints if joint.mimics is None])
    assert len(groups["leg_left"]) == 6
    assert set(groups["torso"]) == {"torso_1_joint", "torso_2_joint"}


def test_visual_shapes_stand_for_collision_shapes_that_are_missing(tmp_path: Path) -> None:
    two_arms(tmp_path / "two.urdf")
    found = propose(Request("two.urdf", tmp_path))
    assert found.settled.tree["constraints"]["self_collision"]["shapes"] == "visual"
    assert any("moves with left_1, left_2" in note and "visual" in note for note in found.notes)


def test_what_is_written_is_what_was_tried(tmp_path: Path) -> None:
    """Pairs that are left out give other links capsules of their own, with which iCub's posture
    was not clear: `optimize` refused what `init` had written."""
    text = propose(Request(f"{EXAMPLE_PREFIX}icub", tmp_path)).text
    problem = build_problem(parse_spec(text), tmp_path)
    assert clear_posture(MotionTask(problem), 1).as_configured


def test_meshes_that_are_never_far_enough_apart_end_in_no_refusal(tmp_path: Path) -> None:
    """Two discs 2.1 mm apart, whichever way both joints turn: no posture has room."""
    disc = (
        '<collision><origin xyz="0 0 {at}" rpy="0.001 0 0"/><geometry>'
        '<cylinder radius="0.2" length="0.01"/></geometry></collision>'
    )
    second = joint("second", "middle", "above", GOOD).replace('xyz="0 1 0"', 'xyz="0 0 1"')
    path = serial(
        tmp_path,
        "base first middle second above third hand",
        base=link("base", shape=disc.format(at=0.0)),
        first=joint("first", "base", "middle", GOOD).replace('xyz="0 1 0"', 'xyz="0 0 1"'),
        middle=link("middle", shape=""),
        second=second.replace('xyz="0 0 0.25"', 'xyz="0 0 0"'),
        above=link("above", shape=disc.format(at=0.0121 - 0.25)),
    )
    found = propose(Request(str(path), tmp_path))
    assert found.settled.tree["constraints"]["self_collision"]["ignore"] == [["base", "above"]]
    assert "NOT GUARDED" in found.text


def test_what_is_given_stands_in_place_of_what_is_proposed(tmp_path: Path) -> None:
    arm(tmp_path)
    given = ("sequence.motions=5", "constraints.self_collision=null", "robot.posture.elbow=0.4")
    proposal = propose(Request("robot.urdf", tmp_path, overrides=given))
    spec = parse_spec(proposal.text)
    assert spec.sequence.motions == 5
    assert spec.constraints.self_collision is None
    assert spec.robot.posture["elbow"] == 0.4
    assert "motions: 5  # as given with --set" in proposal.text
    # What is given yields only where nothing else would do. A margin wider than the links are
    # apart.
    arm(tmp_path)
    wide = ("constraints.self_collision.margin=0.9",)
    proposal = propose(Request("robot.urdf", tmp_path, overrides=wide))
    own = parse_spec(proposal.text).constraints.self_collision
    assert own is not None
    assert own.margin < 0.9
    assert "leaves no room for more" in proposal.text


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("robot.joints=[elbow]", r"^--set robot\.joints: give it with --joints\."),
        ("sequence.motion=3", r"sequence\.motion.*Did you mean 'motions'"),
        ("sequence.motions=0", "greater than or equal to 1"),
        ("sequence", "key.path=value"),
    ],
)
def test_what_cannot_be_set_is_told(tmp_path: Path, given: str, words: str) -> None:
    arm(tmp_path)
    with pytest.raises(ConfigError, match=words):
        propose(Request("robot.urdf", tmp_path, overrides=(given,)))


def test_one_base_parameter_has_another_criterion(tmp_path: Path) -> None:
    """A flywheel: its condition number is always 1, which `optimize` would refuse."""
    upright = joint("wheel", "base", "disc", GOOD).replace('axis xyz="0 1 0"', 'axis xyz="0 0 1"')
    written(tmp_path, link("base"), upright, link("disc", shape=""))
    proposal = propose(Request("robot.urdf", tmp_path, ("wheel",)))
    assert proposal.settled.problem.base.rank == 1
    assert parse_spec(proposal.text).criterion.kind == "log_det"
    assert "of one base parameter is always 1" in proposal.text


def test_joints_of_the_base_and_joints_that_move_no_mass_stay(tmp_path: Path) -> None:
    """As MuJoCo's planar robots have them: three joints between the world and the trunk."""
    own = {name: f'<link name="{name}"/>' for name in ("world", "a", "b")}
    own["rootz"] = joint("rootz", "world", "a", GOOD, "prismatic")
    own["rootx"] = joint("rootx", "a", "b", GOOD, "prismatic")
    serial(tmp_path, "world rootz a rootx b rooty trunk hip leg", **own)
    proposal = propose(Request("robot.urdf", tmp_path))
    assert proposal.joints == ("hip",)
    assert proposal.left_out["joints of the base"] == ("rootz", "rootx", "rooty")
    # A joint that moves no mass stays. It shows no parameter, and no simulator plays it.
    serial(tmp_path, "base shoulder upper flange tip", tip='<link name="tip"/>')
    proposal = propose(Request("robot.urdf", tmp_path))
    assert proposal.joints == ("shoulder",)
    assert proposal.left_out["joints that move no mass"] == ("flange",)
