"""Inputs that describe robots and problems: YAML, and URDF with meshes in four formats.

Of a config: spoiled trees and texts of the shipped ones; the entry is what every command starts
with, `load_spec`, then the problem itself for the small arm (its capsules are in the cache after
the first). Of a URDF: trees, texts, bytes, meshes, paths, many links; the entry is the robot with
its base parameters, its collision geometry and meshes.
"""

import copy
import struct
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import yaml

from benchmarks.trust.mutations import (
    Rng,
    chance,
    odd_number,
    odd_text,
    odd_value,
    one_of,
    pick,
    spoiled_bytes,
    spoiled_text,
    spoiled_tree,
)
from benchmarks.trust.trial import Fuzzer
from excite_cli.config.load_spec import load_spec, parse_spec, spec_as_yaml
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.config.spec import Spec
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.excitation.problem import build_problem
from excite_cli.geometry.link_meshes import link_meshes
from excite_cli.robot.description import example_robots, load_description
from excite_cli.robot.mesh_paths import check_mesh_paths, needed_folders
from excite_cli.robot.model import build_robot, links_by_joint
from excite_cli.robot.urdf_joints import survey

_ROOT = Path(__file__).resolve().parents[2]
_ARM = str(_ROOT / "data" / "smoke_arm.urdf")
_YAML = (
    *(b": ", b"- ", b"&a ", b"!!python/name:os.system ", b"? ", b"%YAML 9.9\n", b"---\n", b"{a: "),
    *(b"...\n", b"<<: ", b"\t", b"k: 1\n", b"x, ", b" a:\n", *b"{ } [ ] *a | > ' \" # 9 a".split()),
)


class ConfigFuzzer(Fuzzer):
    """Configs."""

    name = "config"
    named = False  # what contradicts the robot is told by its key

    def open(self, bases: Path) -> None:
        """The shipped configs, as text and as trees; the words of the schema."""
        paths = sorted((_ROOT / "configs").glob("*.yaml"))
        self._texts = [path.read_bytes() for path in paths]
        self._trees = [yaml.safe_load(text) for text in self._texts]
        self._small = yaml.safe_load((_ROOT / "configs" / "smoke.yaml").read_bytes())
        self._small["robot"]["urdf"] = _ARM
        self._words = sorted(_keys(Spec.model_json_schema()))
        build_problem(parse_spec(yaml.safe_dump(self._small)), _ROOT / "configs")

    def make(self, rng: Rng, folder: Path) -> tuple[Path, str]:
        """A spoiled config."""
        path, text = folder / "problem.yaml", pick(rng, self._texts)
        tree = pick(rng, self._trees)
        made, data = one_of(rng, {
            "small tree": (8, lambda: _dumped(spoiled_tree(rng, self._small, self._words))),
            "tree": (4, lambda: _dumped(spoiled_tree(rng, tree, self._words))),
            "text": (5, lambda: spoiled_text(rng, text, _YAML)),
            "bytes": (2, lambda: spoiled_bytes(rng, text)),
            "any value": (1, lambda: _dumped(odd_value(rng))),
        })  # fmt: skip
        path.write_bytes(data)
        return path, made

    def enter(self, path: Path) -> None:
        """Read; what is read is the same when written and read again; build the small arm's."""
        spec = load_spec(path)
        if parse_spec(spec_as_yaml(spec)) != spec:
            raise AssertionError("written and read again, it is another problem")
        if spec.robot.urdf == _ARM:
            build_problem(spec, path.parent)


def _keys(schema: object) -> set[str]:
    """All keys that the schema knows."""
    inner = schema.values() if isinstance(schema, dict) else schema
    if not isinstance(schema, (dict, list)):
        return set()
    own = set(schema.get("properties", ())) if isinstance(schema, dict) else set()
    return own.union(*map(_keys, inner))


def _dumped(tree: object) -> bytes:
    try:
        return yaml.safe_dump(tree, allow_unicode=True, sort_keys=False).encode("utf-8", "replace")
    except yaml.YAMLError:
        return repr(tree).encode("utf-8", "replace")


_OTHERS = ("ur3", "double_pendulum", "z1", "finger_edu")
_XML_WORDS = b"< > /> &lt; &#0; &#x10FFFF; &a; <!-- --> <![CDATA[ ]]> <?xml?> nan inf 1e999 ${pi} e"
_XML = (
    *(b"<mimic joint='elbow'/>", b"<xacro:include filename='/etc/passwd'/>", b"xmlns:a='b'", b'"'),
    *(b"<link name='a'>", b'<!DOCTYPE r [<!ENTITY e SYSTEM "/dev/zero">]>', b"\0", b" "),
    *_XML_WORDS.split(),
)
_PLAIN_PATHS = """
../../../../etc/passwd package://../../etc/passwd /etc/passwd /dev/zero file:///etc/passwd
package:// package:///etc/passwd . pipe.stl http://x/y.stl mesh.stl mesh.obj mesh.dae mesh.ply
link.stl loop.stl mesh.blend mesh.STL
"""
_PATHS = ("", "mesh.stl\0", "a" * 5000 + ".stl", *_PLAIN_PATHS.split())
_JOINT_TYPES = "revolute continuous prismatic fixed floating planar spherical x"
_TYPES = ("", *_JOINT_TYPES.split())
_SHAPES = (
    '<cylinder radius="0.06" length="0.2"/>',
    '<box size="0.08 0.08 0.36"/>',
    '<cylinder radius="0.04" length="0.28"/>',
    '<sphere radius="0.045"/>',
)
_MOST_LINKS = 3000


class UrdfFuzzer(Fuzzer):
    """URDF."""

    name = "urdf"

    def open(self, bases: Path) -> None:
        """The small arm, with and without meshes, and some robots of example-robot-data."""
        arm = meshes = Path(_ARM).read_text(encoding="utf-8")
        for suffix, shape in zip(VALID, _SHAPES, strict=True):
            assert shape in meshes
            meshes = meshes.replace(shape, f'<mesh filename="mesh.{suffix}" scale="1 1 1"/>')
        known = example_robots()
        others = [_with_boxes(known[name]) for name in _OTHERS if name in known]
        self._meshes = meshes.encode()
        self._texts = [arm.encode(), arm.encode(), self._meshes, *others]

    def make(self, rng: Rng, folder: Path) -> tuple[Path, str]:
        """A spoiled URDF, with meshes beside it, one of which is spoiled in its place at times."""
        path, text = folder / "robot.urdf", pick(rng, self._texts)
        (folder / "link.stl").symlink_to(pick(rng, ("/etc/passwd", "/dev/zero", "mesh.stl")))
        (folder / "loop.stl").symlink_to("loop.stl")
        made, data = one_of(rng, {
            "mesh": (4, lambda: self._meshes),
            "tree": (8, lambda: _spoiled_urdf(rng, text)),
            "text": (4, lambda: spoiled_text(rng, text, _XML)),
            "bytes": (3, lambda: spoiled_bytes(rng, text)),
            "many links": (1, lambda: _many_links(rng)),
        })  # fmt: skip
        wrong = pick(rng, list(VALID)) if made == "mesh" else ""
        for suffix, mesh in VALID.items():
            bad = _spoiled_mesh(rng, mesh) if suffix == wrong else mesh
            (folder / f"mesh.{suffix}").write_bytes(bad)
        path.write_bytes(data)
        return path, f"{made} {wrong}".strip()

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


def _spoiled_urdf(rng: Rng, data: bytes) -> bytes:
    """Attributes changed and taken away; elements taken away, moved, doubled and renamed."""
    root = ElementTree.fromstring(data)
    for _ in range(int(rng.geometric(0.6))):
        elements = list(root.iter())
        element = pick(rng, elements)
        parents = {child: parent for parent in elements for child in parent}
        way = int(rng.integers(9))
        if way <= 4:
            named = [e for e in elements if e.tag in ("parent", "child", "link", "joint", "mesh")]
            element = pick(rng, named) if way == 4 and named else element
            key = pick(rng, list(element.attrib) or ["name"])
            element.set(key, _odd_attribute(rng, elements, key))
        elif way == 5 and element.attrib:
            del element.attrib[pick(rng, list(element.attrib))]
        elif way == 6 and element in parents:
            parents[element].remove(element)
        elif way == 7 and element in parents:
            to = pick(rng, (pick(rng, elements), parents[element]))
            to.append(copy.deepcopy(element))
        else:
            element.tag = pick(rng, elements).tag
    try:
        return ElementTree.tostring(root, encoding="utf-8")
    except (ValueError, TypeError):
        return data[: len(data) // 2]


def _odd_attribute(rng: Rng, elements: list[ElementTree.Element], key: str) -> str:
    if key in ("filename", "type"):
        return str(pick(rng, _PATHS if key == "filename" else _TYPES))
    if key in ("link", "name", "joint") and chance(rng, 0.7):
        return str(pick(rng, elements).get("name", ""))
    words = [str(odd_number(rng)) for _ in range(int(pick(rng, (1, 1, 3, 3, 2, 4))))]
    return " ".join(words) if chance(rng, 0.8) else odd_text(rng)


def _many_links(rng: Rng) -> bytes:
    """Links one behind the other, or all at the first one."""
    count, star = int(rng.integers(1, _MOST_LINKS)), chance(rng, 0.3)
    kind = pick(rng, ("revolute", "fixed", "continuous"))
    links = "".join(
        f"<link name='l{k}'><inertial><mass value='1'/>"
        "<inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>"
        for k in range(count + 1)
    )
    joints = "".join(
        f"<joint name='j{k}' type='{kind}'><parent link='l{0 if star else k}'/>"
        f"<child link='l{k + 1}'/><origin xyz='0 0 0.1'/><axis xyz='0 1 0'/>"
        "<limit lower='-1' upper='1' velocity='1' effort='1'/></joint>"
        for k in range(count)
    )
    return f"<robot name='c'>{links}{joints}</robot>".encode()


_CORNERS = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
_FACES = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))


def binary_stl(claimed: int = len(_FACES)) -> bytes:
    """STL of a tetrahedron; `claimed`: how many triangles its header says there are."""
    body = (struct.pack("<12fH", 0, 0, 0, *_CORNERS[list(face)].ravel(), 0) for face in _FACES)
    return b"\0" * 80 + struct.pack("<I", claimed) + b"".join(body)


_POINTS = [" ".join(map(str, corner)) for corner in _CORNERS]
_TRIANGLES = [" ".join(map(str, face)) for face in _FACES]
_FACETS = "".join(
    "facet normal 0 0 0\nouter loop\n{}endloop\nendfacet\n".format(
        "".join(f"vertex {_POINTS[k]}\n" for k in face)
    )
    for face in _FACES
)
_TEXT_STL = f"solid t\n{_FACETS}endsolid t".encode()
_PLY = """ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
element face 4
property list uchar int vertex_indices
end_header
"""
_DAE = f"""<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="meter" meter="1"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g" name="g"><mesh>
<source id="p"><float_array id="pa" count="12">{" ".join(_POINTS)}</float_array><technique_common>
<accessor source="#pa" count="4" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><p>{" ".join(_TRIANGLES)}</p>
</triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n"><instance_geometry url="#g"/></node>
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>
"""
_OBJ = [f"v {point}" for point in _POINTS]
_OBJ += ["f " + " ".join(str(k + 1) for k in face) for face in _FACES]
# The tetrahedron in four formats.
VALID = {
    "stl": binary_stl(),
    "obj": "\n".join(_OBJ).encode(),
    "dae": _DAE.encode(),
    "ply": (_PLY + "\n".join([*_POINTS, *(f"3 {each}" for each in _TRIANGLES)])).encode(),
}


def _spoiled_mesh(rng: Rng, data: bytes) -> bytes:
    """Of another kind, blank, or spoiled as a text or as bytes."""
    text = _TEXT_STL if data == VALID["stl"] else data
    return one_of(rng, {
        "kind": (1, lambda: pick(rng, list(VALID.values()))),
        "blank": (1, lambda: pick(rng, (b"", b"\0" * 84, b" ", b"solid", b"<", b"ply\n"))),
        "text": (3, lambda: spoiled_text(rng, text, (b"mtllib /dev/zero\n", b"9", b"nan ", b"f "))),
        "bytes": (3, lambda: spoiled_bytes(rng, data)),
    })[1]  # fmt: skip
