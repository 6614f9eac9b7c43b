"""Pairs that SRDF and MJCF rule out become ignored pairs of the config, counted and told."""

from pathlib import Path

import pytest

from excite_cli.config.load_spec import parse_spec
from excite_cli.errors import RobotError
from excite_cli.geometry.reasons import Why
from excite_cli.proposal.propose import Proposal, Request, propose
from excite_cli.summary.pairs import kept_apart, pairs_data, unjudged
from tests.proposal.robots import serial

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
