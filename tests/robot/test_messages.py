"""What is told about a URDF that is wrong, and what is refused for safety."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excite_cli.config.constraints_spec import ConstraintsSpec, SelfCollisionSpec
from excite_cli.config.robot_spec import JointLimits, RobotSpec
from excite_cli.config.spec import Spec
from excite_cli.config.trajectory_spec import GridSpec, SamplingSpec
from excite_cli.errors import ConfigError, RobotError
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.robot.model import Robot, build_robot
from tests import urdf_elements

LIMITS = 'lower="-1" upper="1" velocity="2" effort="10"'
LIMIT = f"<limit {LIMITS}/>"
CYLINDER = '<collision><geometry><cylinder radius="0.05" length="0.2"/></geometry></collision>'
# A mesh of one tetrahedron.
OBJ = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


def link(name: str, collision: str = CYLINDER) -> str:
    return urdf_elements.link(name, 1, "0.1 0.1 0.1", "0.1 0 0.1", collision)


def joint(name: str, parent: str, child: str, kind: str = "revolute", inside: str = LIMIT) -> str:
    return urdf_elements.joint(
        name, (parent, child), "0 0 0.5", "0 1 0", limits="", kind=kind, more=inside
    )


def urdf(kind: str = "revolute", inside: str = LIMIT, collision: str = CYLINDER) -> str:
    """Base, arm and hand; the first joint, `elbow`, and the hand's shape as given."""
    links = link("base"), link("arm"), link("hand", collision)
    joints = joint("elbow", "base", "arm", kind, inside), joint("wrist", "arm", "hand")
    return urdf_elements.robot_text("arm", *links, *joints)


def built(folder: Path, text: str, **robot: Any) -> Robot:
    (folder / "arm.urdf").write_text(text, encoding="utf-8")
    return build_robot(RobotSpec(urdf="arm.urdf", **robot), folder)


def problem(folder: Path, text: str, checked: bool = True, **robot: Any) -> Problem:
    """A problem with self-collision `checked`."""
    (folder / "arm.urdf").write_text(text, encoding="utf-8")
    few = SamplingSpec(cost=GridSpec(samples=20), constraints=GridSpec(samples=20))
    kept = ConstraintsSpec(self_collision=SelfCollisionSpec() if checked else None)
    spec = RobotSpec(urdf="arm.urdf", **robot)
    return build_problem(Spec(robot=spec, sampling=few, constraints=kept), folder)


@pytest.mark.parametrize(("wrong", "nearest"), [("talso", "talos"), ("ur1", "ur10")])
def test_unknown_example_robot(wrong: str, nearest: str) -> None:
    with pytest.raises(RobotError, match=f"no robot '{wrong}'. Did you mean '{nearest}'") as caught:
        build_robot(RobotSpec(urdf=f"example-robot-data:{wrong}"))
    assert "robot.urdf" in str(caught.value)
    assert "excite robots" in str(caught.value)


@pytest.mark.parametrize("name", ["none.urdf", "", "."])
def test_missing_urdf(tmp_path: Path, name: str) -> None:
    with pytest.raises(RobotError, match=r"robot.urdf: there is no file .*config relative to it"):
        build_robot(RobotSpec(urdf=name), tmp_path)


NO_URDF = r"arm.urdf is not a URDF that can be used"
NO_XML = r"arm.urdf is not well-formed XML"
UNMOVED = urdf("fixed", "").replace('name="wrist" type="revolute"', 'name="wrist" type="fixed"')


@pytest.mark.parametrize(
    ("text", "words"),
    [
        *((text, NO_XML) for text in ("", "an arm", urdf()[:-3], "<robot>&arm;</robot>")),
        ("<html/>", "its root is <html>, not <robot>"),
        ("<robot/>", NO_URDF),
        (urdf().replace('child link="arm"', 'child link="none"'), NO_URDF),
        (urdf().replace(link("hand"), link("arm")), NO_URDF),
        (urdf("hinge"), NO_URDF),
        (urdf(inside=LIMIT.replace('"-1"', '"low"')), NO_URDF),
        (urdf().replace(joint("wrist", "arm", "hand"), ""), NO_URDF),
        ('<!DOCTYPE robot [<!ENTITY a "b">]>' + urdf(), "document type or entities"),
        ('<!DOCTYPE robot SYSTEM "file:///etc/hostname">' + urdf(), "document type or entities"),
        ('<?xml version="1.0"?>\n<!DOCTYPE robot>' + urdf(), "document type or entities"),
        # Such a joint moves nothing; every number that follows would be about another robot.
        (urdf().replace('xyz="0 1 0"', 'xyz="0 0 0"', 1), "axis"),
        (urdf(inside=""), "joint 'elbow' is revolute and has no <limit>"),
        (urdf("planar"), r"(?s)joint 'elbow' is of type .* prismatic and fixed"),
        (urdf("floating"), r"(?s)arm.urdf.*joint 'elbow' is of type .* prismatic and fixed"),
        (UNMOVED, "has no movable joint"),
    ],
)
def test_what_is_no_urdf_of_a_robot(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(RobotError, match=words):
        built(tmp_path, text)


def test_files_that_are_not_there_or_no_text(tmp_path: Path) -> None:
    with pytest.raises(RobotError, match=r"robot.package_dirs: there is no folder meshes"):
        built(tmp_path, urdf(), package_dirs=("meshes",))
    with pytest.raises(RobotError, match="has no movable joint"):
        built(tmp_path, UNMOVED, base="floating")
    (tmp_path / "arm.urdf").write_bytes(b"<robot name='\xff'/>")
    with pytest.raises(RobotError, match="cannot be read as text"):
        build_robot(RobotSpec(urdf="arm.urdf"), tmp_path)


def mesh(path: str) -> str:
    return f'<collision><geometry><mesh filename="{path}"/></geometry></collision>'


@pytest.mark.parametrize("name", ["none.stl", "package://none/none.stl", "../none.stl"])
def test_missing_mesh_matters_where_collisions_are_checked(tmp_path: Path, name: str) -> None:
    text = urdf(collision=mesh(name))
    with pytest.raises(RobotError, match="was not found") as caught:
        problem(tmp_path, text)
    assert name in str(caught.value)
    assert "robot.package_dirs" in str(caught.value)
    assert not problem(tmp_path, text, checked=False).constraints[0].name.startswith("self")


@pytest.mark.parametrize(
    "path",
    [
        "../mesh.obj",
        "../../secret/mesh.obj",
        "file://{outside}/mesh.obj",
        "{outside}/mesh.obj",
        "package://../mesh.obj",
        "link.obj",
    ],
)
def test_mesh_paths_must_not_leave_the_robots_folders(tmp_path: Path, path: str) -> None:
    folder = tmp_path / "secret" / "robot"
    folder.mkdir(parents=True)
    (folder.parent / "mesh.obj").write_text(OBJ, encoding="utf-8")
    (folder / "link.obj").symlink_to(folder.parent / "mesh.obj")
    path = path.format(outside=folder.parent)
    with pytest.raises(RobotError, match="leaves the robot's own folders"):
        problem(folder, urdf(collision=mesh(path)))


def test_a_mesh_inside_or_in_a_named_folder_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    folder, shapes = tmp_path / "robot", tmp_path / "shapes"
    for place in (folder / "meshes", shapes / "arm_shapes"):
        place.mkdir(parents=True)
        (place / "hand.obj").write_text(OBJ, encoding="utf-8")
    assert problem(folder, urdf(collision=mesh("meshes/hand.obj")))
    packaged = urdf(collision=mesh("package://arm_shapes/hand.obj"))
    assert problem(folder, packaged, package_dirs=("../shapes",))
    with pytest.raises(RobotError, match="was not found"):
        problem(folder, packaged)


def test_shapes_that_are_missing_or_none(tmp_path: Path) -> None:
    with pytest.raises(RobotError, match="no collision geometry") as caught:
        problem(tmp_path, urdf().replace(CYLINDER, ""))
    assert "constraints.self_collision.capsules" in str(caught.value)
    (tmp_path / "hand.stl").write_text("no mesh", encoding="utf-8")
    with pytest.raises(RobotError, match="cannot be loaded"):
        problem(tmp_path, urdf(collision=mesh("hand.stl")))


@pytest.mark.parametrize(
    ("where", "given"),
    [
        ("joints", ("wrist", "elbw")),
        ("posture", {"elbw": 0.0}),
        ("limits", {"elbw": JointLimits(velocity=1.0)}),
    ],
)
def test_unknown_joint(tmp_path: Path, where: str, given: Any) -> None:
    told = rf"^robot\.{where}: the robot has no joint 'elbw'. Did you mean 'elbow'\?(?s:.)*"
    with pytest.raises(ConfigError, match=told + "Its joints: elbow, wrist"):
        built(tmp_path, urdf(), **{where: given})


def test_posture_outside_limits(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"robot.posture.elbow: 1.5 is outside .*\[-1, 1\]"):
        built(tmp_path, urdf(), posture={"elbow": 1.5})
    wider = {"elbow": JointLimits(position=(-2.0, 2.0))}
    assert built(tmp_path, urdf(), posture={"elbow": 1.5}, limits=wider).posture[0] == 1.5
    narrower = {"elbow": JointLimits(position=(-0.5, 0.5))}
    with pytest.raises(ConfigError, match=r"\[-0.5, 0.5\]"):
        built(tmp_path, urdf(), posture={"elbow": 0.7}, limits=narrower)


@pytest.mark.parametrize("posture", [{}, {"elbow": 0.0}])
def test_empty_limits(tmp_path: Path, posture: dict[str, float]) -> None:
    text = urdf(inside='<limit lower="0" upper="0" velocity="2" effort="10"/>')
    with pytest.raises(ConfigError, match=r"elbow' has no position .*robot.limits.elbow.position"):
        built(tmp_path, text, posture=posture)
    assert built(tmp_path, text, joints=("wrist",)).joint_names == ("wrist",)
    mended = {"elbow": JointLimits(position=(-1.0, 1.0))}
    assert built(tmp_path, text, limits=mended).limits.lower[0] == -1.0
    crossed = urdf(inside='<limit lower="1" upper="-1" velocity="2" effort="10"/>')
    assert built(tmp_path, crossed, posture=posture).limits.lower[0] == -1.0


@pytest.mark.parametrize("inside", ["", '<limit velocity="3" effort="7"/>', LIMIT])
def test_a_continuous_joint_is_one_without_position_limits(tmp_path: Path, inside: str) -> None:
    robot = built(tmp_path, urdf("continuous", inside), posture={"elbow": 12.0})
    assert robot.model.nq == robot.model.nv == 2
    assert robot.limits.lower[0] == -np.inf
    assert robot.limits.upper[0] == np.inf
    assert robot.limits.velocity[0] == {"": np.inf, LIMIT: 2.0}.get(inside, 3.0)
    assert robot.posture[0] == 12.0
    bounds = next(c for c in problem(tmp_path, urdf("continuous", inside), False).constraints)
    assert bounds.labels == ("wrist lower", "wrist upper")
