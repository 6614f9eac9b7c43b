"""Inputs that describe robots and problems: YAML, and URDF with meshes in four formats.

Of a config: spoiled trees and texts of the shipped ones, bombs and depth; the entry is what every
command starts with, `load_spec`, then the problem itself for the small arm (its capsules are in the
cache after the first). Of a URDF: trees, texts, bytes, meshes, entities, paths, links; the entry is
the robot with its base parameters, its collision geometry and meshes.
"""

import copy
import struct
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from pathlib import Path

import numpy as np
import yaml

from benchmarks.trust.mutations import (
    Rng,
    chance,
    large,
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
from excite_cli.robot.mesh_paths import check_mesh_paths
from excite_cli.robot.model import build_robot, links_by_joint
from excite_cli.robot.package_search import needed_folders
from excite_cli.robot.urdf_joints import survey

_ROOT = Path(__file__).resolve().parents[2]
_ARM = str(_ROOT / "data" / "smoke_arm.urdf")
_YAML = (
    *(b": ", b"- ", b"&a ", b"!!python/name:os.system ", b"? ", b"%YAML 9.9\n", b"---\n"),
    *(b"...\n", b"<<: ", b"\t", *b"{ } [ ] *a | > ' \" #".split()),
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
        path = folder / "problem.yaml"
        way = int(rng.integers(20))
        if way < 8:
            made, data = "small tree", _dumped(spoiled_tree(rng, self._small, self._words))
        elif way < 12:
            tree = pick(rng, self._trees)
            made, data = "tree", _dumped(spoiled_tree(rng, tree, self._words))
        elif way < 15:
            made, data = "text", spoiled_text(rng, pick(rng, self._texts), _YAML)
        elif way < 17:
            made, data = "bytes", spoiled_bytes(rng, pick(rng, self._texts))
        elif way == 17:
            made, data = "any value", _dumped(odd_value(rng))
        else:
            made, data = _hostile_config(rng)
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
    found: set[str] = set()
    if isinstance(schema, dict):
        found |= set(schema.get("properties", ()))
        found = found.union(*map(_keys, schema.values()))
    elif isinstance(schema, list):
        found = found.union(*map(_keys, schema))
    return found


def _dumped(tree: object) -> bytes:
    try:
        return yaml.safe_dump(tree, allow_unicode=True, sort_keys=False).encode("utf-8", "replace")
    except yaml.YAMLError:
        return repr(tree).encode("utf-8", "replace")


def _hostile_config(rng: Rng) -> tuple[str, bytes]:
    """What is meant to run code, to fill memory or to take for ever."""
    size = large(rng, 5.5)
    ways: dict[str, Callable[[], bytes]] = {
        "bomb": lambda: b"\n".join(
            [b"a0: &a0 [x]"]
            + [b"a%d: &a%d [%s]" % (k, k, b", ".join([b"*a%d" % (k - 1)] * 9))
               for k in range(1, 10)]
        ),
        "depth": lambda: pick(rng, (b"[", b"{a: ", b"- ", b"? ")) * size,
        "depth of lines": lambda: b"".join(b" " * k + b"a:\n" for k in range(min(size, 1300))),
        "many keys": lambda: b"".join(b"k%d: 1\n" % k for k in range(min(size, 80_000))),
        "long key": lambda: b"a" * size + b": 1",
        "long number": lambda: b"seed: " + b"9" * size,
        "code": lambda: b"robot: !!python/object/apply:os.system ['touch /nowhere/x']",
        "long list": lambda: b"robot: {urdf: a, joints: [" + b"x, " * min(size, 300_000) + b"]}",
        "blank": lambda: pick(rng, (b"", b"\n" * size, b" " * size, b"\xef\xbb\xbf", b"\0" * size)),
        "recursion": lambda: pick(rng, (b"&a [*a]", b"robot: &a {urdf: *a}")),
        "merge": lambda: b"<<: {robot: {urdf: x}}\nseed: 1",
        "wide text": lambda: "robot: {urdf: ex}".encode(pick(rng, ("utf-16", "utf-32", "utf-7"))),
        "odd names": lambda: _dumped({"robot": {"urdf": odd_text(rng)}, odd_text(rng): 1}),
    }  # fmt: skip
    return one_of(rng, ways)


_OTHERS = ("ur3", "double_pendulum", "z1", "finger_edu")
_XML_WORDS = b"< > /> &lt; &#0; &#x10FFFF; &a; <!-- --> <![CDATA[ ]]> <?xml?> nan inf 1e999 ${pi}"
_XML = (
    *(b"<mimic joint='elbow'/>", b"<xacro:include filename='/etc/passwd'/>", b"xmlns:a='b'", b'"'),
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
        """A spoiled URDF, with meshes beside it."""
        path = folder / "robot.urdf"
        way = int(rng.integers(20))
        mesh = _write_meshes(rng, folder, way < 4)
        if way < 4:
            made, data = mesh, self._meshes
        elif way < 11:
            made, data = "tree", _tree(rng, pick(rng, self._texts))
        elif way < 14:
            made, data = "text", spoiled_text(rng, pick(rng, self._texts), _XML)
        elif way < 17:
            made, data = "bytes", spoiled_bytes(rng, pick(rng, self._texts))
        else:
            made, data = _hostile_urdf(rng, folder, self._meshes)
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
        elif way in (6, 7) and element in parents:
            to = pick(rng, elements) if way == 6 else parents[element]
            to.append(copy.deepcopy(element))
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


def _hostile_urdf(rng: Rng, folder: Path, meshes: bytes) -> tuple[str, bytes]:
    size = large(rng, 5)
    head, few = b'<?xml version="1.0"?>\n', min(size, 3000)

    def entities() -> bytes:
        levels = (b'<!ENTITY %c "%s">' % (98 + k, b"&%c;" % (97 + k) * 10) for k in range(9))
        first = b'<!DOCTYPE robot [<!ENTITY a "aaaaaaaaaa">'
        return head + first + b"".join(levels) + b"]><robot>&j;</robot>"

    def external() -> bytes:
        out = pick(rng, (b"file:///etc/passwd", b"/dev/zero", b"http://localhost:1/x"))
        text = head + b'<!DOCTYPE r [<!ENTITY e SYSTEM "%s">]><robot name="&e;">&e;</robot>' % out
        return text.decode().encode(pick(rng, ("utf-8", "utf-16", "utf-8-sig")))

    def links() -> bytes:
        to = pick(rng, ("/etc/passwd", "/dev/zero", "mesh.stl", "loop.stl"))
        (folder / "link.stl").symlink_to(to)
        (folder / "loop.stl").symlink_to("loop.stl")
        return meshes.replace(b"mesh.stl", pick(rng, (b"link.stl", b"loop.stl")))

    def scaled() -> bytes:
        scale = " ".join(str(odd_number(rng)) for _ in range(3)).encode()
        return meshes.replace(b"1 1 1", scale, int(rng.integers(1, 5)))

    def doubled() -> bytes:
        joint = b"<joint name='%s' type='revolute'>" % odd_text(rng).encode("utf-8", "replace")
        ends = b"<parent link='base'/><child link='tool'/></joint></robot>"
        return meshes.replace(b"</robot>", joint + ends)

    back = _joint(99, 5, 0, "revolute").encode() + b"</robot>"
    blank = (b"", b" ", b"<robot/>", b"\0", b"<robot name=''><link name=''/></robot>")
    codes = ("utf-16", "utf-32", "utf-7", "cp037")
    kinds = ("revolute", "fixed", "continuous")
    ways: dict[str, Callable[[], bytes]] = {
        "entities": entities,
        "external entity": external,
        "depth": lambda: b"<robot>%s%s</robot>" % (b"<link name='a'>" * size, b"</link>" * size),
        "chain": lambda: _joined(few, pick(rng, kinds), star=False),
        "star": lambda: _joined(few, "revolute", star=True),
        "cycle": lambda: _joined(5, "revolute", star=False).replace(b"</robot>", back),
        "wide text": lambda: meshes.decode().encode(pick(rng, codes)),
        "blank": lambda: pick(rng, blank),
        "long name": lambda: meshes.replace(b'"elbow"', b'"' + b"e" * size + b'"'),
        "symbolic link": links,
        "mesh path": lambda: meshes.replace(b"mesh.stl", pick(rng, _PATHS).encode()),
        "mesh scale": scaled,
        "doubled names": doubled,
    }
    return one_of(rng, ways)


def _joined(count: int, kind: str, star: bool) -> bytes:
    """Links one behind the other, or all at the first one."""
    links = "".join(
        f"<link name='l{k}'><inertial><mass value='1'/>"
        "<inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>"
        for k in range(count + 1)
    )
    joints = "".join(_joint(k, 0 if star else k, k + 1, kind) for k in range(count))
    return f"<robot name='c'>{links}{joints}</robot>".encode()


def _joint(number: int, parent: int, child: int, kind: str) -> str:
    return (
        f"<joint name='j{number}' type='{kind}'><parent link='l{parent}'/><child link='l{child}'/>"
        "<origin xyz='0 0 0.1'/><axis xyz='0 1 0'/>"
        "<limit lower='-1' upper='1' velocity='1' effort='1'/></joint>"
    )


_CORNERS = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
_FACES = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))


def binary_stl(claimed: int | None = None, corners: np.ndarray = _CORNERS) -> bytes:
    """STL of a tetrahedron; `claimed`: how many triangles its header says there are."""
    body = b"".join(
        struct.pack("<12fH", 0, 0, 0, *corners[list(face)].ravel(), 0) for face in _FACES
    )
    return b"\0" * 80 + struct.pack("<I", len(_FACES) if claimed is None else claimed) + body


def _text_stl() -> bytes:
    points = [[" ".join(map(str, _CORNERS[k])) for k in face] for face in _FACES]
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join(f"vertex {each}\n" for each in face)
        + "endloop\nendfacet\n"
        for face in points
    )
    return f"solid t\n{facets}endsolid t".encode()


def _obj() -> bytes:
    lines = ["v " + " ".join(map(str, corner)) for corner in _CORNERS]
    lines += ["f " + " ".join(str(k + 1) for k in face) for face in _FACES]
    return "\n".join(lines).encode()


def _ply() -> bytes:
    head = ["ply", "format ascii 1.0", "element vertex 4", "property float x", "property float y"]
    head += ["property float z", "element face 4", "property list uchar int vertex_indices"]
    lines = [*head, "end_header", *(" ".join(map(str, corner)) for corner in _CORNERS)]
    return "\n".join([*lines, *("3 " + " ".join(map(str, f)) for f in _FACES)]).encode()


def _dae() -> bytes:
    numbers = " ".join(map(str, _CORNERS.ravel()))
    faces = " ".join(str(k) for face in _FACES for k in face)
    return f"""<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="meter" meter="1"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g" name="g"><mesh>
<source id="p"><float_array id="pa" count="12">{numbers}</float_array><technique_common>
<accessor source="#pa" count="4" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><p>{faces}</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n"><instance_geometry url="#g"/></node>
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>
""".encode()


VALID = {"stl": binary_stl(), "obj": _obj(), "dae": _dae(), "ply": _ply()}


def _write_meshes(rng: Rng, folder: Path, spoil: bool) -> str:
    """`mesh.<suffix>` of every format, one of them spoiled if asked; which, and how."""
    wrong = pick(rng, list(VALID)) if spoil else ""
    made = ""
    for suffix, data in VALID.items():
        if suffix == wrong:
            made, data = _spoiled_mesh(rng, suffix, data)
        (folder / f"mesh.{suffix}").write_bytes(data)
    return f"{made} {wrong}".strip()


def _spoiled_mesh(rng: Rng, suffix: str, data: bytes) -> tuple[str, bytes]:
    number = str(odd_number(rng)).encode()

    def odd_corners() -> bytes:
        with np.errstate(all="ignore"):
            corners = _CORNERS * float(odd_number(rng)) if chance(rng, 0.7) else _CORNERS * 0
            return binary_stl(corners=np.clip(corners, -3e38, 3e38))

    names = (b"/dev/zero", b"/etc/passwd", b"../../x", b"mesh.obj", b".")
    ways: dict[str, Callable[[], bytes]] = {
        "mesh of another kind": lambda: pick(rng, list(VALID.values())),
        "blank mesh": lambda: pick(rng, (b"", b"\0" * 84, b" ", b"solid", b"<", b"ply\n")),
        "text of a mesh": lambda: spoiled_text(rng, _text_stl() if suffix == "stl" else data),
        "bytes of a mesh": lambda: spoiled_bytes(rng, data),
    }
    own: dict[str, dict[str, Callable[[], bytes]]] = {
        "stl": {
            "claims": lambda: binary_stl(int(pick(rng, (0, 5, 2**16, 2**31, 2**32 - 1)))),
            "odd corners": odd_corners,
        },
        "obj": {
            "library": lambda: b"mtllib " + pick(rng, names) + b"\n" + data,
            "odd faces": lambda: data + b"\nf " + number + b" -9 99999999/1/1",
        },
        "ply": {"claims": lambda: data.replace(b"vertex 4", b"vertex " + number)},
        "dae": {"claims": lambda: data.replace(b'count="4"', b'count="%s"' % number)},
    }
    return one_of(rng, ways | own[suffix])
