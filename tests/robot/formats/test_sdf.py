"""SDF as a robot: frames, shapes, loops and worlds, and what is told."""

from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.errors import RobotError
from excite_cli.geometry.link_shapes import collision_model, placed_shapes
from excite_cli.robot.description import RobotDescription, load_description
from excite_cli.robot.loops import Loop, Mimic
from excite_cli.robot.model import build_robot


def link(name: str, pose: str = "0 0 0 0 0 0", shape: str = "") -> str:
    inertia = "<inertia><ixx>0.1</ixx><iyy>0.1</iyy><izz>0.1</izz></inertia>"
    return (
        f'<link name="{name}"><pose>{pose}</pose><inertial><mass>2</mass>{inertia}</inertial>'
        f"{shape}</link>"
    )


def joint(name: str, parent: str, child: str, more: str = "", kind: str = "revolute") -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent>{parent}</parent><child>{child}</child>'
        f"<axis><xyz>0 1 0</xyz><limit><lower>-1</lower><upper>2</upper></limit>{more}</axis>"
        "</joint>"
    )


def described(folder: Path, *parts: str, beside: str = "") -> RobotDescription:
    path = folder / "robot.sdf"
    model = f'<model name="arm">{"".join(parts)}</model>'
    path.write_text(f'<sdf version="1.9"><world name="w">{model}{beside}</world></sdf>')
    return load_description(str(path))


def test_frames_are_those_that_are_named(tmp_path: Path) -> None:
    """A joint at a frame that is attached to a link, and a link placed by that joint."""
    frame = '<frame name="mount" attached_to="a"><pose relative_to="a">0 0 0.3 0 0 0</pose></frame>'
    second = joint("j2", "a", "b").replace(
        "<axis>", '<pose relative_to="mount">0.1 0 0 0 0 0</pose><axis>', 1
    )
    placed = link("b").replace("<pose>0 0 0", '<pose relative_to="j2">0 0 0.5', 1)
    described(tmp_path, link("base"), joint("j1", "base", "a"), link("a", "0 0 0.2 0 0 0"), frame,
              second, placed)  # fmt: skip
    robot = build_robot(RobotSpec(urdf="robot.sdf"), tmp_path)
    assert robot.joint_names == ("j1", "j2")
    np.testing.assert_allclose(robot.model.jointPlacements[1].translation, [0, 0, 0.2])
    np.testing.assert_allclose(robot.model.jointPlacements[2].translation, [0.1, 0, 0.3])
    np.testing.assert_allclose(robot.model.inertias[2].lever, [0, 0, 0.5])


def test_shapes_of_every_kind_stand_where_they_do(tmp_path: Path) -> None:
    kinds = (
        "<box><size>0.2 0.4 0.6</size></box>",
        "<sphere><radius>0.3</radius></sphere>",
        "<cylinder><radius>0.1</radius><length>0.6</length></cylinder>",
        "<capsule><radius>0.1</radius><length>0.4</length></capsule>",
        "<ellipsoid><radii>0.1 0.2 0.3</radii></ellipsoid>",
    )
    widths = (0.2, 0.6, 0.2, 0.2, 0.2)
    shapes = "".join(
        f'<collision name="c{k}"><pose>{k} 0 0 0 0 0</pose><geometry>{shape}</geometry></collision>'
        for k, shape in enumerate(kinds)
    )
    described(tmp_path, link("base"), joint("j", "base", "a"), link("a", shape=shapes))
    robot = build_robot(RobotSpec(urdf="robot.sdf"), tmp_path)
    points = np.vstack([each[2] for each in placed_shapes(robot, collision_model(robot))])
    for k, width in enumerate(widths):
        near = points[np.abs(points[:, 0] - k) < 0.45]
        assert np.ptp(near[:, 0]) == pytest.approx(width, rel=0.03)
        assert np.ptp(near[:, 2]) == pytest.approx(0.6, rel=0.03)


def test_what_a_urdf_cannot_hold_is_told(tmp_path: Path) -> None:
    found = described(
        tmp_path,
        link("base"),
        joint("j1", "base", "a", "<dynamics><spring_stiffness>3</spring_stiffness></dynamics>"),
        link("a"),
        joint("j3", "base", "c"),
        link("c"),
        joint("loop", "c", "a"),
        joint("ball", "a", "b", kind="ball"),
        link("b"),
        link("loose"),
        beside='<model name="table"><link name="top"/></model>',
    )
    told = " | ".join(found.notes)
    for part in (
        "a closed loop is cut between c and a",
        "ball is locked: joints of type ball are not supported",
        "joined to nothing, left out: loose",
        "not part of the robot, left out: table",
        "the spring of j1 has no place in a URDF",
    ):
        assert part in told
    assert found.loops == (Loop(("c", "a"), ("j1", "j3")),)
    assert found.xml.count("<joint") == 3


def test_friction_couplings_and_turns_without_end(tmp_path: Path) -> None:
    friction = "<dynamics><damping>0.5</damping><friction>0.25</friction></dynamics>"
    mimic = '<mimic joint="j1"><multiplier>2</multiplier><offset>0.5</offset></mimic>'
    endless = joint("j2", "a", "b", mimic).replace("-1<", "-1e16<").replace(">2<", ">1e16<", 1)
    described(tmp_path, link("base"), joint("j1", "base", "a", friction), link("a"), endless,
              link("b"))  # fmt: skip
    found = load_description(str(tmp_path / "robot.sdf"))
    assert found.mimicking == {"j2": Mimic("j1", 2.0, 0.5)}
    assert 'damping="0.5" friction="0.25"' in found.xml
    assert 'lower="-1000000000.0"' in found.xml


BASE, JOINT = link("base"), joint("j", "base", "a")


@pytest.mark.long
@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ((BASE,), "no model in it has a joint that could be moved"),
        (
            (BASE, joint("j", "base", "none")),
            "its SDF cannot be read: joint 'j' has the child 'none', no link of it",
        ),
        ((BASE, JOINT, link("a", "0 0 0")), "the pose '0 0 0' is not six numbers"),
        ((BASE, JOINT, link("a", "0 0 nan 0 0 0")), "is not finite"),
        (
            (BASE, JOINT, link("a"), "<include><uri>x</uri></include>"),
            "is made of other models .*which is not read",
        ),
        (
            (BASE, JOINT, link("a").replace("<pose>", '<pose relative_to="j">')),
            "its frames go round in a circle",
        ),
        (None, "What it includes is not read: give that file"),
    ],
)
def test_what_is_no_robot_is_refused(
    tmp_path: Path, parts: tuple[str, ...] | None, words: str
) -> None:
    if parts is None:  # nothing but an include
        path = tmp_path / "robot.sdf"
        path.write_text('<sdf version="1.6"><world name="w"><include/></world></sdf>')
    with pytest.raises(RobotError, match=rf"robot\.sdf: .*{words}"):
        described(tmp_path, *parts) if parts else load_description(str(path))
