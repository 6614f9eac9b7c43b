"""Meshes that are missing cost the links they belong to, told as not guarded, not the robot."""

from pathlib import Path

import pytest

from excite_cli.config.load_spec import parse_spec
from excite_cli.constraints.self_collision import SelfCollision
from excite_cli.errors import ConfigError, RobotError
from excite_cli.excitation.problem import build_problem
from excite_cli.geometry.reasons import Why
from excite_cli.proposal.propose import Proposal, Request, propose
from excite_cli.summary.pairs import (
    bodies_without_shapes,
    kept_apart,
    pairs_data,
    pairs_in_words,
    unjudged,
)
from tests.proposal.robots import BOX, GOOD, TETRAHEDRON, joint, link, serial, written

# Packages are looked for beside the folders above a robot, where other tests have theirs.
FINGERS = "package://hand_description/meshes/{}.stl"


def shape(name: str, kind: str = "collision") -> str:
    return f'<{kind}><geometry><mesh filename="{name}"/></geometry></{kind}>'


def with_gripper(folder: Path, hand: str, second: str = GOOD) -> Path:
    """An arm of two boxes with a gripper of two links, of which `hand` is the first one's shape."""
    return serial(
        folder,
        "base shoulder upper elbow lower mount palm wrist finger",
        elbow=joint("elbow", "upper", "lower", second),
        mount=joint("mount", "lower", "palm", kind="fixed"),
        palm=link("palm", shape=hand),
        finger=link("finger", shape=shape(FINGERS.format("finger"))),
    )


def test_a_package_that_is_nowhere_costs_its_links_only(tmp_path: Path) -> None:
    with_gripper(tmp_path, shape(FINGERS.format("palm")))
    proposal = propose(Request("robot.urdf", tmp_path))
    (told,) = [note for note in proposal.notes if note.startswith("NOT GUARDED")]
    assert "palm, finger: the package 'hand_description' of the collision mesh" in told
    assert f"Looked in {tmp_path}" in told
    for variable in ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH"):
        assert variable in told
    assert "--package-dirs" in told
    own = parse_spec(proposal.text).constraints.self_collision
    assert own is not None
    assert own.without_shapes == ("palm", "finger")
    problem = proposal.settled.problem
    own_links = [each for each in problem.constraints if isinstance(each, SelfCollision)]
    assert {"base – lower"} == {label for each in own_links for label in each.labels}
    words = pairs_in_words(problem)
    assert "NOT GUARDED: the meshes of palm, finger are missing" in words[0]
    assert "checked." in words[1]
    assert "with collision shapes" in words[1]
    assert pairs_data(problem)["links_without_shapes"] == ["palm", "finger"]
    assert bodies_without_shapes(problem) == ["wrist"]


def test_once_the_package_is_there_the_links_are_guarded(tmp_path: Path) -> None:
    path = with_gripper(tmp_path, shape(FINGERS.format("palm")))
    path.write_text(path.read_text().replace("hand_description", "late_hand"))
    text = propose(Request("robot.urdf", tmp_path)).text
    bare = build_problem(parse_spec(text), tmp_path)
    meshes = tmp_path / "late_hand" / "meshes"
    meshes.mkdir(parents=True)
    for name in ("palm", "finger"):
        (meshes / f"{name}.stl").write_text(TETRAHEDRON)
    problem = build_problem(parse_spec(text), tmp_path)
    assert bodies_without_shapes(problem) == []
    assert pairs_data(problem)["links_without_shapes"] == []
    assert kept_apart(problem) > kept_apart(bare)


def test_visual_shapes_stand_for_collision_meshes_that_are_missing(tmp_path: Path) -> None:
    seen = BOX.replace("collision", "visual")
    for other in (BOX, seen):  # a link that misses one of two meshes keeps neither
        with_gripper(tmp_path, shape(FINGERS.format("palm")) + other)
        problem = propose(Request("robot.urdf", tmp_path)).settled.problem
        assert pairs_data(problem)["links_without_shapes"] == ["palm", "finger"]
    path = tmp_path / "robot.urdf"
    finger = link("finger", shape=shape(FINGERS.format("finger")))
    path.write_text(path.read_text().replace(finger, finger.replace("</link>", f"{seen}</link>")))
    problem = propose(Request("robot.urdf", tmp_path)).settled.problem
    assert problem.spec.constraints.self_collision is not None
    assert problem.spec.constraints.self_collision.shapes == "visual"
    assert pairs_data(problem)["links_without_shapes"] == []


def test_a_damaged_mesh_costs_its_link_only(tmp_path: Path) -> None:
    (tmp_path / "palm.stl").write_text("no mesh")
    (tmp_path / "finger.stl").write_text(TETRAHEDRON)
    path = with_gripper(tmp_path, shape("palm.stl"))
    path.write_text(path.read_text().replace(FINGERS.format("finger"), "finger.stl"))
    proposal = propose(Request("robot.urdf", tmp_path))
    assert any("palm.stl cannot be loaded" in note for note in proposal.notes)
    assert pairs_data(proposal.settled.problem)["links_without_shapes"] == ["palm"]
    # Without any mesh the note names the package.
    mesh = shape(FINGERS.format("palm"))
    written(tmp_path, link("base", shape=""), joint("j", "base", "l", GOOD), link("l", shape=mesh))
    notes = propose(Request("robot.urdf", tmp_path)).notes
    assert any("the package 'hand_description'" in note for note in notes)
    assert "robot.urdf has no collision geometry that can be read: self-collision is not " in (
        " ".join(notes)
    )


def test_a_config_that_does_not_name_the_link_is_refused_with_a_way_on(tmp_path: Path) -> None:
    """A mesh that gets lost must not silently cost a guard that was there."""
    with_gripper(tmp_path, BOX)
    text = "robot: {urdf: robot.urdf}\ntrajectory: {family: fourier, base_frequency: 0.6}\n"
    text += "constraints: {self_collision: {}}\n"
    with pytest.raises(RobotError, match=r"or list finger under .*without_shapes"):
        build_problem(parse_spec(text), tmp_path)
    named = text.replace("{self_collision: {}}", "{self_collision: {without_shapes: [fingr]}}")
    with pytest.raises(ConfigError, match=r"no link 'fingr'. Did you mean 'finger'"):
        build_problem(parse_spec(named), tmp_path)


CHAIN = ("base", "upper", "lower", "hand")


def arm(folder: Path) -> Path:
    return serial(folder, "base upper_joint upper lower_joint lower hand_joint hand")


def srdf(folder: Path, *disabled: tuple[str, str, str], name: str = "robot") -> Path:
    path = folder / f"{name}.srdf"
    pairs = "".join(
        f'<disable_collisions link1="{one}" link2="{other}" reason="{why}"/>'
        for one, other, why in disabled
    )
    state = (
        '<group_state name="home" group="a"><joint name="lower_joint" value="0.7"/></group_state>'
    )
    path.write_text(f'<robot name="robot">{state}{pairs}</robot>')
    return path


def ignored(proposal: Proposal) -> tuple[tuple[str, str], ...]:
    own = parse_spec(proposal.text).constraints.self_collision
    assert own is not None
    return own.ignore


def test_pairs_of_an_srdf_beside_the_urdf(tmp_path: Path) -> None:
    arm(tmp_path)
    bare = propose(Request("robot.urdf", tmp_path))
    assert ignored(bare) == ()
    srdf(tmp_path, ("hand", "base", "User"), ("upper", "hand", ""), ("base", "upper", "Adjacent"))
    proposal = propose(Request("robot.urdf", tmp_path))
    assert ignored(proposal) == (("base", "hand"), ("hand", "upper"))
    told = "ignore: NOT GUARDED: 2 pairs of links as robot.srdf disables them"
    assert told in proposal.notes
    assert told.removeprefix("ignore: ") in proposal.text.replace("\n    # ", " ")
    problem = proposal.settled.problem
    left = unjudged(problem)
    assert [pair.reason.why for pair in left] == [Why.IGNORED, Why.IGNORED]
    assert len(pairs_data(problem)["not_kept_apart"]) == 2
    assert kept_apart(problem) == kept_apart(bare.settled.problem) - 2


def test_pairs_that_never_meet_are_kept_apart_all_the_same(tmp_path: Path) -> None:
    arm(tmp_path)
    srdf(tmp_path, ("base", "hand", "Never"), ("base", "lower", "Default"))
    proposal = propose(Request("robot.urdf", tmp_path))
    assert ignored(proposal) == (("base", "lower"),)
    assert any("1 pairs that robot.srdf disables as never in" in note for note in proposal.notes)
    # Links that are not here are told.
    arm(tmp_path)
    srdf(tmp_path, ("base", "gripper", "User"))
    proposal = propose(Request("robot.urdf", tmp_path))
    assert ignored(proposal) == ()
    assert "links of robot.srdf that are not here: gripper" in proposal.notes


def test_the_srdf_of_another_robot_is_passed_over(tmp_path: Path) -> None:
    arm(tmp_path)
    path = srdf(tmp_path, ("base", "hand", "User"), name="other")
    path.write_text(path.read_text().replace('name="robot"', 'name="other"'))
    (tmp_path / "damaged.srdf").write_text("<robot")
    assert ignored(propose(Request("robot.urdf", tmp_path))) == ()
    given = propose(Request("robot.urdf", tmp_path, srdf=path))
    assert ignored(given) == (("base", "hand"),)
    assert "'home' of other.srdf" in given.text


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (None, "cannot be read as text"),
        ("<robot", "is not well-formed XML"),
        ("<!DOCTYPE robot><robot/>", "declares a document type"),
    ],
)
def test_an_srdf_that_is_given_must_be_one(tmp_path: Path, text: str | None, words: str) -> None:
    arm(tmp_path)
    path = tmp_path / "mine.srdf"
    if text is not None:
        path.write_text(text)
    with pytest.raises(RobotError, match=f"mine.srdf {words}"):
        propose(Request("robot.urdf", tmp_path, srdf=path))


def test_what_mjcf_excludes_is_ignored(tmp_path: Path) -> None:
    inside = ""
    for name in reversed(CHAIN[1:]):
        shape = '<geom type="box" size="0.025 0.025 0.08" pos="0 0 0.12" mass="1"/>'
        inside = (
            f'<body name="{name}" pos="0 0 0.25"><joint name="{name}_j" axis="0 1 0" '
            f'range="-100 100"/>{shape}{inside}</body>'
        )
    base = '<geom type="box" size="0.025 0.025 0.08" pos="0 0 0.12" mass="1"/>'
    exclude = '<contact><exclude body1="upper" body2="hand"/></contact>'
    (tmp_path / "robot.xml").write_text(
        f'<mujoco><worldbody><body name="base">{base}{inside}</body></worldbody>{exclude}</mujoco>'
    )
    proposal = propose(Request("robot.xml", tmp_path))
    assert ignored(proposal) == (("hand", "upper"),)
    assert any("1 pair of links as robot.xml excludes them" in note for note in proposal.notes)
