"""URDFs: spoiled text, bytes and trees of robots with shapes and meshes; entities, paths, size.

The entry is what `excite robots FILE`, `init` and `check` do: the description, what it says of
joints and packages, the model, its base parameters, its collision geometry and meshes.
"""

import copy
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np

from benchmarks.trust.fuzz_meshes import SUFFIXES, write_meshes
from benchmarks.trust.fuzz_mutations import (
    Rng,
    chance,
    odd_number,
    odd_text,
    pick,
    spoiled_bytes,
    spoiled_text,
)
from benchmarks.trust.fuzz_trial import Fuzzer
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.geometry.link_meshes import link_meshes
from excite_cli.robot.description import example_robots, load_description
from excite_cli.robot.mesh_paths import check_mesh_paths
from excite_cli.robot.model import build_robot, links_by_joint
from excite_cli.robot.package_search import needed_folders
from excite_cli.robot.urdf_joints import survey

_ARM = Path(__file__).resolve().parents[2] / "data" / "smoke_arm.urdf"
_OTHERS = ("ur3", "double_pendulum", "z1", "finger_edu")
_WORDS = (
    b"<",
    b">",
    b"/>",
    b"&lt;",
    b"&#0;",
    b"&#x10FFFF;",
    b"&a;",
    b"<!--",
    b"-->",
    b"<![CDATA[",
    b"]]>",
    b"<?xml?>",
    b"nan",
    b"inf",
    b"1e999",
    b'"',
    b"<mimic joint='elbow'/>",
    b"<xacro:include filename='/etc/passwd'/>",
    b"${pi}",
    b"xmlns:a='b'",
)
_PATHS = (
    "../../../../etc/passwd",
    "/etc/passwd",
    "/dev/zero",
    "package://../../etc/passwd",
    "file:///etc/passwd",
    "package://",
    "package:///etc/passwd",
    "http://x/y.stl",
    "mesh.stl",
    "mesh.obj",
    "mesh.dae",
    "mesh.ply",
    "link.stl",
    "loop.stl",
    ".",
    "",
    "mesh.blend",
    "mesh.STL",
    "mesh.stl\0",
    "a" * 5000 + ".stl",
    "pipe.stl",
)
_TYPES = (
    "revolute",
    "continuous",
    "prismatic",
    "fixed",
    "floating",
    "planar",
    "spherical",
    "",
    "x",
)


class UrdfFuzzer(Fuzzer):
    """URDF."""

    name = "urdf"

    def open(self, bases: Path) -> None:
        """The small arm, with and without meshes, and some robots of example-robot-data."""
        arm = _ARM.read_text(encoding="utf-8")
        meshes = arm
        for suffix, shape in zip(
            SUFFIXES,
            (
                '<cylinder radius="0.06" length="0.2"/>',
                '<box size="0.08 0.08 0.36"/>',
                '<cylinder radius="0.04" length="0.28"/>',
                '<sphere radius="0.045"/>',
            ),
            strict=True,
        ):
            assert shape in meshes
            meshes = meshes.replace(shape, f'<mesh filename="mesh.{suffix}" scale="1 1 1"/>')
        known = example_robots()
        others = [_with_boxes(known[name]) for name in _OTHERS if name in known]
        self._arm, self._meshes = arm.encode(), meshes.encode()
        self._texts = [self._arm, self._arm, self._meshes, *others]

    def make(self, rng: np.random.Generator, folder: Path) -> tuple[Path, str]:
        """A spoiled URDF, with meshes beside it."""
        path = folder / "robot.urdf"
        way = int(rng.integers(20))
        spoil = way in (0, 1, 2, 3)
        mesh = write_meshes(rng, folder, spoil)
        if spoil:
            made, data = mesh, self._meshes
        elif way < 11:
            made, data = "tree", _tree(rng, pick(rng, self._texts))
        elif way < 14:
            made, data = "text", spoiled_text(rng, pick(rng, self._texts), _WORDS)
        elif way < 17:
            made, data = "bytes", spoiled_bytes(rng, pick(rng, self._texts))
        else:
            made, data = _hostile(rng, folder, self._meshes)
        path.write_bytes(data)
        return path, made

    def enter(self, path: Path) -> None:
        """As the commands: description, joints, packages, model, base parameters, geometry."""
        description = load_description(str(path), relative_to=path.parent)
        survey(description)
        needed_folders(description)
        robot = build_robot(RobotSpec(urdf=str(path)), path.parent)
        links_by_joint(robot)
        if robot.n <= 12:
            find_base_parameters(robot)
        link_meshes(robot)
        check_mesh_paths(description, "visual")


def _with_boxes(path: Path) -> bytes:
    """A robot whose collision meshes, which are large, are boxes."""
    root = ElementTree.fromstring(path.read_text(encoding="utf-8"))
    for geometry in root.findall("link/collision/geometry"):
        for mesh in geometry.findall("mesh"):
            geometry.remove(mesh)
            ElementTree.SubElement(geometry, "box", {"size": "0.1 0.1 0.1"})
    for link in root.findall("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
    return ElementTree.tostring(root)


def _tree(rng: Rng, data: bytes) -> bytes:
    root = ElementTree.fromstring(data)
    for _ in range(int(rng.geometric(0.6))):
        elements = list(root.iter())
        element = pick(rng, elements)
        parents = {child: parent for parent in elements for child in parent}
        way = int(rng.integers(10))
        if way <= 3 and element.attrib:
            key = pick(rng, list(element.attrib))
            element.set(key, _attribute(rng, elements, key))
        elif way == 4 and element.attrib:
            del element.attrib[pick(rng, list(element.attrib))]
        elif way == 5 and element in parents:
            parents[element].remove(element)
        elif way == 6 and element in parents:
            pick(rng, elements).append(copy.deepcopy(element))
        elif way == 7 and element in parents:
            parents[element].append(copy.deepcopy(element))
        elif way == 8:
            element.tag = pick(rng, elements).tag
        else:
            links = [e for e in elements if e.tag in ("parent", "child", "link", "joint", "mesh")]
            if links:
                chosen = pick(rng, links)
                key = pick(rng, list(chosen.attrib) or ["name"])
                chosen.set(key, _attribute(rng, elements, key))
    try:
        return ElementTree.tostring(root, encoding="utf-8")
    except (ValueError, TypeError):
        return data[: len(data) // 2]


def _attribute(rng: Rng, elements: list[ElementTree.Element], key: str) -> str:
    if key == "filename":
        return str(pick(rng, _PATHS))
    if key == "type":
        return str(pick(rng, _TYPES))
    if key in ("link", "name", "joint") and chance(rng, 0.7):
        return str(pick(rng, elements).get("name", ""))
    words = [str(odd_number(rng)) for _ in range(int(pick(rng, (1, 1, 3, 3, 2, 4))))]
    return " ".join(words) if chance(rng, 0.8) else odd_text(rng)


def _hostile(rng: Rng, folder: Path, meshes: bytes) -> tuple[str, bytes]:
    size = int(10 ** rng.uniform(1, 5))
    way = int(rng.integers(14))
    head = b'<?xml version="1.0"?>\n'
    if way == 0:
        entities = b'<!ENTITY a "aaaaaaaaaa">' + b"".join(
            b'<!ENTITY %c "%s">' % (98 + k, b"&%c;" % (97 + k) * 10) for k in range(9)
        )
        return "entities", head + b"<!DOCTYPE robot [" + entities + b"]><robot>&j;</robot>"
    if way == 1:
        out = pick(rng, (b"file:///etc/passwd", b"/dev/zero", b"http://localhost:1/x"))
        text = head + b'<!DOCTYPE r [<!ENTITY e SYSTEM "%s">]><robot name="&e;">&e;</robot>' % out
        return "external entity", text.decode().encode(pick(rng, ("utf-8", "utf-16", "utf-8-sig")))
    if way == 2:
        return "depth", b"<robot>" + b"<link name='a'>" * size + b"</link>" * size + b"</robot>"
    if way in (3, 4):
        return "chain", _chain(min(size, 3000), pick(rng, ("revolute", "fixed", "continuous")))
    if way == 5:
        back = _joint(99, 5, 0, "revolute").encode()
        return "cycle", _chain(5, "revolute").replace(b"</robot>", back + b"</robot>")
    if way == 6:
        return "wide text", meshes.decode().encode(
            pick(rng, ("utf-16", "utf-32", "utf-7", "cp037"))
        )
    if way == 7:
        return "blank", pick(
            rng,
            (
                b"",
                b" ",
                b"<robot/>",
                b"<robot></robot>",
                b"\0",
                b"<robot name=''><link name=''/></robot>",
            ),
        )
    if way == 8:
        return "long name", meshes.replace(b'"elbow"', b'"' + b"e" * size + b'"')
    if way == 9:
        (folder / "link.stl").symlink_to(
            pick(rng, ("/etc/passwd", "/dev/zero", "mesh.stl", "loop.stl"))
        )
        (folder / "loop.stl").symlink_to("loop.stl")
        return "symbolic link", meshes.replace(b"mesh.stl", pick(rng, (b"link.stl", b"loop.stl")))
    if way == 10:
        return "mesh path", meshes.replace(b"mesh.stl", pick(rng, _PATHS).encode())
    if way == 11:
        scale = " ".join(str(odd_number(rng)) for _ in range(3)).encode()
        return "mesh scale", meshes.replace(b"1 1 1", scale, int(rng.integers(1, 5)))
    if way == 12:
        return "star", _star(min(size, 3000))
    joint = b"<joint name='%s' type='revolute'>" % odd_text(rng).encode("utf-8", "replace")
    return "doubled names", meshes.replace(
        b"</robot>", joint + b"<parent link='base'/><child link='tool'/></joint></robot>"
    )


def _chain(count: int, kind: str) -> bytes:
    links = "".join(_link(k) for k in range(count + 1))
    joints = "".join(_joint(k, k, k + 1, kind) for k in range(count))
    return f"<robot name='c'>{links}{joints}</robot>".encode()


def _star(count: int) -> bytes:
    links = "".join(_link(k) for k in range(count + 1))
    joints = "".join(_joint(k, 0, k + 1, "revolute") for k in range(count))
    return f"<robot name='s'>{links}{joints}</robot>".encode()


def _link(number: int) -> str:
    return (
        f"<link name='l{number}'><inertial><mass value='1'/>"
        "<inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>"
    )


def _joint(number: int, parent: int, child: int, kind: str) -> str:
    return (
        f"<joint name='j{number}' type='{kind}'><parent link='l{parent}'/><child link='l{child}'/>"
        "<origin xyz='0 0 0.1'/><axis xyz='0 1 0'/>"
        "<limit lower='-1' upper='1' velocity='1' effort='1'/></joint>"
    )
