"""Robots whose files name others outside their own folder, each way for every format."""

import json
import os
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from pathlib import Path

import pytest

from benchmarks.trust.robot_files import VALID
from excite_cli.errors import RobotError
from excite_cli.proposal.propose import Request, propose
from excite_cli.proposal.shapes import srdf_near
from excite_cli.robot.allowed_files import OutsideError, needed, own_folder
from excite_cli.robot.description import load_description
from excite_cli.robot.mesh_paths import Kind, check_mesh_paths, load_with_folders, located
from tests.trust.conftest import XACRO

STL = VALID["stl"]
SECRET = '<robot><link name="secret"/></robot>'


def xacro(more: str) -> str:
    return XACRO.format(mass=1, more=more)


@pytest.fixture
def outside(tmp_path: Path) -> Path:
    return tmp_path / "outside"


@pytest.fixture
def robot(tmp_path: Path, outside: Path) -> Path:
    """A robot's folder, beside one that it may not read; links lead there."""
    own = tmp_path / "robots" / "arm"
    (outside / "meshes").mkdir(parents=True)
    own.mkdir(parents=True)
    (outside / "package.xml").write_text("<package><name>other</name></package>")
    (outside / "s.xacro").write_text(SECRET)
    (outside / "s.yaml").write_text("password: secret\n")
    (outside / "s.xml").write_text("<mujocoinclude><body/></mujocoinclude>")
    (outside / "m.xml").write_text("<mujoco><worldbody><body name='m'/></worldbody></mujoco>")
    for folder in (outside, outside / "meshes"):
        (folder / "s.stl").write_bytes(STL)
        (folder / "s.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    (own / "linked").symlink_to(outside)
    (own / "linked.stl").symlink_to(outside / "s.stl")
    (own / "linked.yaml").symlink_to(outside / "s.yaml")
    return own


OF_XACRO = {
    "include above": '<xacro:include filename="../../outside/s.xacro"/>',
    "include by an absolute path": '<xacro:include filename="{outside}/s.xacro"/>',
    "include by a link": '<xacro:include filename="linked/s.xacro"/>',
    "include by a pattern": '<xacro:include filename="../../outside/*.xacro"/>',
    "include by a property": (
        '<xacro:property name="p" value="{outside}"/><xacro:include filename="${{p}}/s.xacro"/>'
    ),
    "include in a namespace": '<xacro:include filename="{outside}/s.xacro" ns="n"/>',
    "include that is optional": '<xacro:include filename="{outside}/s.xacro" optional="true"/>',
    "include of a package": '<xacro:include filename="$(find other)/s.xacro"/>',
    "include above its own package": '<xacro:include filename="$(cwd)/../outside/s.xacro"/>',
    "old include": '<include filename="{outside}/s.xacro"/>',
    "table above": "<a b=\"${{xacro.load_yaml('../../outside/s.yaml')}}\"/>",
    "table by an absolute path": "<a b=\"${{load_yaml('{outside}/s.yaml')}}\"/>",
    "table by a link": "<a b=\"${{xacro.load_yaml('linked.yaml')['password']}}\"/>",
    "table of the system": "<a b=\"${{xacro.load_yaml('/etc/hostname')}}\"/>",
    "table of a process": "<a b=\"${{xacro.load_yaml('/proc/self/environ')}}\"/>",
    "table of a package": "<a b=\"${{xacro.load_yaml('$(find other)/s.yaml')}}\"/>",
    "variable": '<a b="$(env HOME)"/>',
}


@pytest.mark.parametrize("text", OF_XACRO.values(), ids=OF_XACRO)
def test_a_xacro_reads_its_own_folder_only(text: str, robot: Path, outside: Path) -> None:
    path = robot / "arm.xacro"
    path.write_text(xacro(text.format(outside=outside)))
    with pytest.raises(RobotError) as caught:
        load_description(str(path))
    words = str(caught.value)
    assert "outside its own folder" in words or "is not read" in words or "no file" in words, words
    assert "secret" not in words


def test_a_variable_that_is_not_read_has_its_default(
    robot: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SECRET", "sesame")
    path = robot / "arm.xacro"
    path.write_text(xacro('<a b="$(optenv SECRET none)" c="$(optenv ROS_DISTRO none)"/>'))
    monkeypatch.setenv("ROS_DISTRO", "jazzy")
    assert '<a b="none" c="jazzy"' in load_description(str(path)).urdf


MESH = '<asset><mesh name="m" file="{0}"/></asset>'
OF_MJCF = {
    "include above": '<include file="../../outside/s.xml"/>',
    "include by an absolute path": '<include file="{outside}/s.xml"/>',
    "include by a link": '<include file="linked/s.xml"/>',
    "include of an include": '<include file="own.xml"/>',
    "mesh by an absolute path": MESH.format("{outside}/s.stl"),
    "mesh above": MESH.format("../../outside/s.stl"),
    "mesh by a link": MESH.format("linked.stl"),
    "mesh above what is not there": MESH.format("none/../../../outside/s.stl"),
    "mesh with backslashes": MESH.format("..\\..\\outside\\s.stl"),
    "include with backslashes": '<include file="..\\..\\outside\\s.xml"/>',
    "include in a namespace": '<include xmlns="u" file="own.xml"/>',
    "folder of meshes": '<compiler meshdir="../../outside"/>' + MESH.format("s.stl"),
    "absolute folder of meshes": '<compiler meshdir="{outside}"/>' + MESH.format("s.stl"),
    "folder of assets": '<compiler assetdir="{outside}"/>' + MESH.format("meshes/s.stl"),
    "folder that an include names": '<include file="folder.xml"/>' + MESH.format("s.stl"),
    "texture": '<asset><texture type="2d" file="{outside}/s.png"/></asset>',
    "sky": '<asset><texture type="skybox" fileright="{outside}/s.png"/></asset>',
    "height field": '<asset><hfield name="h" size="1 1 1 1" file="{outside}/s.png"/></asset>',
    "attached model": '<asset><model name="o" file="{outside}/m.xml"/></asset>',
    "skin": '<deformable><skin name="s" file="{outside}/s.stl"/></deformable>',
}


@pytest.mark.parametrize("text", OF_MJCF.values(), ids=OF_MJCF)
def test_an_mjcf_reads_its_own_folder_only(text: str, robot: Path, outside: Path) -> None:
    included = "<mujocoinclude>{}</mujocoinclude>"
    (robot / "own.xml").write_text(included.format(f'<include file="{outside}/s.xml"/>'))
    (robot / "folder.xml").write_text(included.format(f'<compiler meshdir="{outside}"/>'))
    path = robot / "arm.xml"
    body = '<worldbody><body><joint/><geom size="0.1" mass="1"/></body></worldbody>'
    path.write_text(f"<mujoco>{text.format(outside=outside)}{body}</mujoco>")
    with pytest.raises(OutsideError, match="which is outside its own folder"):
        load_description(str(path))
    read = load_description(str(path), (str(outside),)) if "mesh " in text else None
    assert read is None or "<joint" in read.xml


OF_MESHES = {
    "above": "../../outside/s.stl",
    "absolute": "{outside}/s.stl",
    "a URI": "file://{outside}/s.stl",
    "a link to a file": "linked.stl",
    "a link to a folder": "linked/s.stl",
    "percent signs": "..%2f..%2foutside%2fs.stl",
    "backslashes": "..\\..\\outside\\s.stl",
    "out of a package": "package://arm/../../outside/s.stl",
    "another package": "package://other/s.stl",
    "another package by its folder": "package://outside/s.stl",
    "three slashes": "package:///other/s.stl",
    "a model": "model://other/s.stl",
    "its own folder and out": "../arm/../../outside/s.stl",
}


def urdf(robot: Path, kind: Kind, name: str) -> Path:
    path = robot / "arm.urdf"
    shape = f'<{kind}><geometry><mesh filename="{name}"/></geometry></{kind}></link>'
    plain = xacro("").replace(' xmlns:xacro="http://www.ros.org/wiki/xacro"', "")
    path.write_text(plain.replace("</link>", shape, 1))
    return path


def sdf(robot: Path, kind: Kind, name: str) -> Path:
    path = robot / "arm.sdf"
    shape = f"<{kind} name='s'><geometry><mesh><uri>{name}</uri></mesh></geometry></{kind}>"
    inertia = "<inertial><mass>1</mass></inertial>"
    path.write_text(
        f"<sdf version='1.9'><model name='a'><link name='base'>{inertia}</link><link name='l'>"
        f"{inertia}{shape}</link><joint name='j' type='revolute'><parent>base</parent>"
        "<child>l</child><axis><xyz>0 1 0</xyz><limit><lower>-1</lower><upper>1</upper>"
        "<velocity>1</velocity><effort>9</effort></limit></axis></joint></model></sdf>"
    )
    return path


@pytest.mark.parametrize("write", [urdf, sdf])
@pytest.mark.parametrize("kind", ["collision", "visual"])
@pytest.mark.parametrize("name", OF_MESHES.values(), ids=OF_MESHES)
def test_a_mesh_outside_is_neither_read_nor_allowed_by_init(
    name: str, kind: Kind, write: Callable[[Path, Kind, str], Path], robot: Path, outside: Path
) -> None:
    path = write(robot, kind, name.format(outside=outside))
    with pytest.raises(RobotError, match=r"leaves the robot's own folders|was not found"):
        check_mesh_paths(load_description(str(path)), kind)
    with pytest.raises(OutsideError, match="which is outside its own folder"):
        load_with_folders(path.name, (), robot)


def test_what_a_mesh_names_is_not_read_outside(robot: Path, outside: Path) -> None:
    (outside / "m.mtl").write_text("newmtl a\n")
    (outside / "b.bin").write_bytes(bytes(100))
    (robot / "m.obj").write_bytes(b"mtllib ../../outside/m.mtl\n" + VALID["obj"])
    (robot / "m.gltf").write_text(
        json.dumps({"asset": {"version": "2.0"}, "buffers": [{"uri": "../../outside/b.bin"}]})
    )
    kinds: tuple[tuple[str, Kind], ...] = (("m.obj", "collision"), ("m.gltf", "visual"))
    for name, kind in kinds:
        description = load_description(str(urdf(robot, kind, name)))
        with pytest.raises(RobotError, match=r"names .*, outside the robot's own folders"):
            check_mesh_paths(description, kind)


@pytest.mark.parametrize(
    "name", [".hidden", "..", ".", "etc", "tmp", "a/b", "*", "", "-x", "a\x1b]0;b"]
)
def test_no_odd_name_of_a_package_is_allowed_with_all_that_was_found(
    name: str, robot: Path
) -> None:
    for parent in robot.parents[:2]:
        (parent / ".hidden").mkdir(exist_ok=True)
    path = robot / "arm.xacro"
    path.write_text(xacro(f'<xacro:include filename="$(find {name.replace(chr(27), "")})/x"/>'))
    with pytest.raises(RobotError) as caught:
        load_description(str(path))
    assert not isinstance(caught.value, OutsideError) or not caught.value.needed.near


def test_what_holds_everything_is_never_proposed_as_near(robot: Path) -> None:
    (robot / "arm.urdf").touch()
    for folder in (Path("/"), Path("/etc"), Path.home(), Path.home().parent):
        assert not needed("a mesh", folder, robot / "arm.urdf").near
    assert needed("a mesh", robot.parent / "hand", robot / "arm.urdf").near is False  # not there
    (robot.parent / "hand").mkdir()
    assert needed("a mesh", robot.parent / "hand", robot / "arm.urdf").near


def test_what_a_terminal_is_asked_cannot_be_forged(robot: Path) -> None:
    said = str(needed("x\x1b]0;\n" + 200 * "y", robot, robot / "arm.urdf"))
    assert "\x1b" not in said
    assert "\n" not in said
    assert said.endswith(f"yyy in {robot}")
    assert len(said) < 100 + len(str(robot))


def test_mjcf_files_above_each_other_in_one_package_are_read(tmp_path: Path) -> None:
    """As scenes that include robots that include defaults."""
    texts = {
        "scenes/scene.xml": '<mujoco><include file="../robots/arm.xml"/></mujoco>',
        "robots/arm.xml": (
            '<mujocoinclude><include file="../common/defaults.xml"/><worldbody><body><joint/>'
            '<geom size="0.1" mass="1"/></body></worldbody></mujocoinclude>'
        ),
        "common/defaults.xml": "<mujocoinclude><option timestep='0.01'/></mujocoinclude>",
    }
    (tmp_path / "package.xml").write_text("<package><name>scenes</name></package>")
    for name, text in texts.items():
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).write_text(text)
    assert "<joint" in load_description(str(tmp_path / "scenes" / "scene.xml")).xml


@pytest.mark.parametrize("line", ["mtllib s.mtl", "mtllib \\\ns.mtl", "\x0cmtllib s.mtl"])
def test_this_process_reads_copies_of_meshes_only(line: str, robot: Path, outside: Path) -> None:
    (robot / "s.mtl").symlink_to(outside / "s.yaml")
    (robot / "s.obj").write_bytes(line.encode() + b"\n" + VALID["obj"])
    description = load_description(str(urdf(robot, "collision", "s.obj")))
    try:
        check_mesh_paths(description)
    except RobotError:
        return
    (mesh,) = ElementTree.fromstring(located(description, "collision")).iter("mesh")
    copy = Path(mesh.get("filename", ""))
    assert copy.suffix == ".stl"
    assert not copy.is_relative_to(robot)


def test_nothing_waits_for_a_pipe(robot: Path) -> None:
    os.mkfifo(robot / "arm.srdf")
    os.mkfifo(robot / "pipe.mtl")
    (robot / "m.obj").write_bytes(b"mtllib pipe.mtl\n" + VALID["obj"])
    assert srdf_near(robot / "arm.urdf") == []
    with pytest.raises(RobotError, match="no regular file"):
        check_mesh_paths(load_description(str(urdf(robot, "collision", "m.obj"))))


def test_init_says_what_it_would_allow_and_writes_what_was_allowed(
    robot: Path, outside: Path
) -> None:
    (robot / "linked").unlink()
    path = urdf(robot, "collision", "package://other/s.stl")
    asked: list[str] = []
    found = propose(Request(path.name, robot, allow=lambda needed: not asked.append(str(needed))))
    assert asked == [f"the package 'other' in {outside}"]
    assert "package_dirs: [../../outside]" in found.text
    assert f"allowed to read {asked[0]}" in found.notes


def test_a_path_that_may_lead_anywhere_is_not_allowed_with_all_that_was_found(
    robot: Path, outside: Path
) -> None:
    path = urdf(robot, "collision", str(outside / "s.stl"))
    with pytest.raises(OutsideError) as caught:
        propose(Request(path.name, robot))
    assert caught.value.needed.near
    path.write_text(path.read_text().replace("s.stl", "none.stl"))
    (robot / "arm.xacro").write_text(xacro(OF_XACRO["table of the system"].format()))
    with pytest.raises(OutsideError) as caught:
        load_description(str(robot / "arm.xacro"))
    assert not caught.value.needed.near
    assert "--allow-found" not in str(caught.value)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="chown needs root")
def test_folders_of_another_user_are_passed_over(tmp_path: Path) -> None:
    folder = tmp_path / "home" / "mine"
    folder.mkdir(parents=True)
    planted = tmp_path / "home" / "planted"
    planted.mkdir()
    (planted / "s.stl").write_bytes(STL)
    (tmp_path / "package.xml").write_text("<package><name>all</name></package>")
    os.chown(tmp_path / "package.xml", 12345, 12345)
    os.chown(planted, 12345, 12345)
    path = urdf(folder, "collision", "package://planted/s.stl")
    assert own_folder(path) == folder
    with pytest.raises(RobotError, match="was not found"):
        check_mesh_paths(load_description(str(path)))
    assert "package_dirs" not in propose(Request(path.name, folder)).text
    os.chown(planted, os.geteuid(), os.geteuid())
    with pytest.raises(OutsideError, match="the package 'planted'"):
        propose(Request(path.name, folder))
