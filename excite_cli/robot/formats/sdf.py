"""SDF, Gazebo's format: one model of links and joints, written as a URDF of the same robot.

Poses are in the frames that `relative_to` names, else a link's in its model's, a joint's in its
child link's. A URDF's link stands at its joint, an SDF's anywhere: each is shifted to the joint
that leads to it. What a URDF cannot hold is left out and told: joints of several axes; loops are
cut as `robot.loops` has it.
"""

import math
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pinocchio as pin

from excite_cli.arrays import Array
from excite_cli.errors import RobotError
from excite_cli.robot.formats.base import (
    ConversionRequest,
    RobotFormat,
    Urdf,
    add_inertial,
    add_origin,
    add_shape,
    capsule,
    ellipsoid,
    mesh,
    words,
)
from excite_cli.robot.loops import TAG
from excite_cli.robot.urdf_check import root_tag

Element = ElementTree.Element

_WORLD, _MODEL = "world", "__model__"
_ROOT = re.compile(r"<sdf[\s>]")
_KINDS = {"revolute": "revolute", "continuous": "continuous", "prismatic": "prismatic",
          "fixed": "fixed"}  # fmt: skip
_UNBOUNDED = 1e9


class Sdf(RobotFormat):
    """Recognised by its root element, `<sdf>`."""

    name = "SDF"

    def recognises(self, path: Path, text: str) -> bool:
        """Whether the first element is `sdf`."""
        if not _ROOT.search(text):
            return False
        return root_tag(text) == "sdf"

    def urdf(self, path: Path, text: str, asked: ConversionRequest) -> Urdf:
        """Links with inertias and shapes, joints with limits, friction and couplings."""
        root = ElementTree.fromstring(text)
        model, notes = _model(path, root)
        try:
            return _Writer(path, model, _version(root), notes).written()
        except RecursionError as error:
            raise RobotError(f"{path.name}: its frames go round in a circle.") from error
        except ValueError as error:
            raise RobotError(f"{path.name}: its SDF cannot be read: {error}.") from error

    def sources(self, path: Path, text: str, asked: ConversionRequest) -> tuple[Path, ...] | None:
        """The file alone: meshes are only named."""
        return (path,)


def _model(path: Path, root: Element) -> tuple[Element, list[str]]:
    """The model that is the robot, of a file or a world, and what is left out beside it."""
    models = [*root.findall("model"), *root.findall("world/model")]
    moving = [model for model in models if model.findall("joint")]
    if not moving:
        includes = len(root.findall(".//include"))
        advice = " What it includes is not read: give that file." if includes else ""
        raise RobotError(f"{path.name}: no model in it has a joint that could be moved.{advice}")
    model = max(moving, key=lambda each: len(each.findall("joint")))
    if model.findall("model") or model.findall("include"):
        raise RobotError(
            f"{path.name}: the model '{model.get('name')}' is made of other models (<model> or "
            "<include> in it), which is not read. Merge them into one model, or give a URDF."
        )
    left = [str(each.get("name")) for each in models if each is not model]
    return model, [f"not part of the robot, left out: {', '.join(left)}"] if left else []


def _version(root: Element) -> float:
    try:
        return float(re.sub(r"^(\d+)\.(\d)$", r"\1.0\2", root.get("version", "1.6")))
    except ValueError:
        return 1.06


class _Writer:
    """One model as XML."""

    def __init__(self, path: Path, model: Element, version: float, notes: list[str]) -> None:
        self.path, self.model, self.version, self.notes = path, model, version, notes
        self.links = {link.get("name", ""): link for link in model.findall("link")}
        self.joints = {joint.get("name", ""): joint for joint in model.findall("joint")}
        self.frames = {frame.get("name", ""): frame for frame in model.findall("frame")}
        self.robot = ElementTree.Element("robot", name=model.get("name") or path.stem)
        self.meshes: set[str] = set()
        self.leading: dict[str, str] = {}  # joint by the link that it leads to

    def written(self) -> Urdf:
        root = self._tree()
        if root == _WORLD:
            ElementTree.SubElement(self.robot, "link", name=_WORLD)
        below = [root] if root != _WORLD else []
        below += self._below(root)
        for name in below:
            self._link(name)
        for name in below:
            if name in self.leading:
                self._joint(self.leading[name], name)
        if left := [name for name in self.links if name not in below]:
            self.notes.append(f"joined to nothing, left out: {', '.join(left)}")
        folders = {str(Path(made).parent) for made in self.meshes}
        text = ElementTree.tostring(self.robot, encoding="unicode")
        return Urdf(text, tuple(sorted(folders)), tuple(self.notes), tuple(sorted(self.meshes)))

    def _tree(self) -> str:
        """The link that carries most others, once every link is led to by one joint."""
        for name, joint in self.joints.items():
            child, parent = self._end(joint, "child"), self._end(joint, "parent")
            if child == _WORLD or child in self.leading or self._above(parent, child):
                loop = ElementTree.SubElement(self.robot, TAG, name=name)
                ElementTree.SubElement(loop, "link1", link=parent)
                ElementTree.SubElement(loop, "link2", link=child)
            else:
                self.leading[child] = name
        roots = [name for name in self.links if name not in self.leading]
        if any(self._parent(name) == _WORLD for name in self.leading):
            roots.append(_WORLD)
        if not roots:
            raise ValueError("it has no link")
        return max(roots, key=lambda name: len(self._below(name)))

    def _end(self, joint: Element, end: str) -> str:
        """The link at an end of a joint; a frame stands for the link it is attached to."""
        name = (joint.findtext(end) or "").strip()
        seen = set()
        while name in self.frames and name not in seen:
            seen.add(name)
            name = self.frames[name].get("attached_to", "")
        if name != _WORLD and name not in self.links:
            raise ValueError(f"joint '{joint.get('name')}' has the {end} '{name}', no link of it")
        return name

    def _parent(self, link: str) -> str:
        return self._end(self.joints[self.leading[link]], "parent")

    def _above(self, link: str, other: str) -> bool:
        """Whether `other` is `link` or carries it."""
        while link != other:
            if link not in self.leading:
                return False
            link = self._parent(link)
        return True

    def _below(self, root: str) -> list[str]:
        """Links that a link carries, nearest first."""
        found: list[str] = []
        todo = [root]
        while todo:
            at = todo.pop(0)
            todo += [name for name in self.leading if self._parent(name) == at]
            found += [name for name in self.leading if self._parent(name) == at]
        return found

    def _frame(self, name: str) -> pin.SE3:
        """A named frame in that of the model."""
        if name in ("", _MODEL):
            return pin.SE3.Identity()
        if name == _WORLD:
            return _pose(self.model).inverse()
        for known, default in ((self.links, _MODEL), (self.joints, None), (self.frames, None)):
            if name in known:
                element = known[name]
                if default is None:
                    default = element.get("attached_to", _MODEL)
                    if element.tag == "joint":
                        default = (element.findtext("child") or "").strip()
                pose = element.find("pose")
                given = None if pose is None else pose.get("relative_to") or pose.get("frame")
                return self._frame(given or default) * _pose(element)
        raise ValueError(f"there is no frame '{name}'")

    def _place(self, link: str) -> pin.SE3:
        """Where the URDF's link stands in the model: at the joint that leads to it."""
        return self._frame(self.leading.get(link, link))

    def _link(self, name: str) -> None:
        element, link = self.links[name], ElementTree.SubElement(self.robot, "link", name=name)
        inward = self._place(name).inverse() * self._frame(name)
        inertial = element.find("inertial")
        if inertial is not None:
            place = inward * _pose(inertial)
            mass = _number(inertial, "mass", 1.0)
            inertia = place.rotation @ _inertia(inertial) @ place.rotation.T
            add_inertial(link, mass, place.translation, inertia)
        for kind in ("collision", "visual"):
            for item in element.findall(kind):
                pose = item.find("pose")
                given = None if pose is None else pose.get("relative_to")
                own = self._place(name).inverse() * self._frame(given) if given else inward
                at = own * _pose(item)
                for height, shape in self._shapes(item, name):
                    lifted = at.translation + height * at.rotation[:, 2]
                    add_shape(link, kind, lifted, at.rotation, shape)

    def _shapes(self, item: Element, link: str) -> Iterator[tuple[float, Element]]:
        """Shapes of a URDF, with their heights [m] along the axis of the one they stand for."""
        for shape in item.findall("geometry/*"):
            radius, length = _number(shape, "radius", 1.0), _number(shape, "length", 1.0)
            if shape.tag == "box":
                yield 0.0, ElementTree.Element("box", size=words(_numbers(shape, "size", 3)))
            elif shape.tag == "sphere":
                yield 0.0, ElementTree.Element("sphere", radius=repr(radius))
            elif shape.tag in ("cylinder", "capsule"):
                parts = list(capsule(radius, length))
                yield from parts if shape.tag == "capsule" else parts[:1]
            elif shape.tag == "ellipsoid":
                yield 0.0, mesh(*ellipsoid(_numbers(shape, "radii", 3)), self.meshes)
            elif shape.tag == "mesh":
                name = (shape.findtext("uri") or "").strip()
                scale = words(_numbers(shape, "scale", 3))
                yield 0.0, ElementTree.Element("mesh", filename=name, scale=scale)
            elif shape.tag not in ("empty", "plane"):
                self.notes.append(f"a shape of {link} is left out, of kind {shape.tag}")

    def _joint(self, name: str, child: str) -> None:
        element, parent = self.joints[name], self._parent(child)
        kind = _KINDS.get(element.get("type", ""), "")
        if not kind:
            self.notes.append(
                f"{name} is locked: joints of type {element.get('type')} are not supported"
            )
            kind = "fixed"
        axis = element.find("axis")
        limit = None if axis is None else axis.find("limit")
        lower = _number(limit, "lower", -math.inf)
        upper = _number(limit, "upper", math.inf)
        if kind == "revolute" and lower <= -_UNBOUNDED and upper >= _UNBOUNDED:
            kind = "continuous"
        joint = ElementTree.SubElement(self.robot, "joint", name=name, type=kind)
        above = self._frame(_WORLD) if parent == _WORLD else self._place(parent)
        place = above.inverse() * self._frame(name)
        add_origin(joint, place.translation, place.rotation)
        ElementTree.SubElement(joint, "parent", link=parent)
        ElementTree.SubElement(joint, "child", link=child)
        if kind == "fixed" or axis is None:
            return
        ElementTree.SubElement(joint, "axis", xyz=words(self._axis(name, axis)))
        figures = {key: repr(max(_number(limit, key, 0.0), 0.0)) for key in ("effort", "velocity")}
        if kind != "continuous":
            bounds = (max(lower, -_UNBOUNDED), min(upper, _UNBOUNDED))
            figures |= {"lower": repr(bounds[0]), "upper": repr(bounds[1])}
        ElementTree.SubElement(joint, "limit", figures)
        self._more(joint, axis)

    def _axis(self, name: str, axis: Element) -> Array:
        """Direction (3,) of a joint's axis in the joint's frame."""
        given = axis.find("xyz")
        direction = _numbers(axis, "xyz", 3, (0.0, 0.0, 1.0))
        frame = None if given is None else given.get("expressed_in")
        in_model = (axis.findtext("use_parent_model_frame") or "").strip() in ("1", "true")
        if frame is None and (in_model or self.version < 1.05):
            frame = _MODEL
        if frame is None:
            return direction
        turn = self._frame(name).rotation.T @ self._frame(frame).rotation
        return np.asarray(turn @ direction)

    def _more(self, joint: Element, axis: Element) -> None:
        """Friction and coupling."""
        dynamics, mimic = axis.find("dynamics"), axis.find("mimic")
        figures = {key: _number(dynamics, key, 0.0) for key in ("damping", "friction")}
        if any(figures.values()):
            told = {key: repr(value) for key, value in figures.items()}
            ElementTree.SubElement(joint, "dynamics", told)
        if _number(dynamics, "spring_stiffness", 0.0):
            self.notes.append(
                f"the spring of {joint.get('name')} has no place in a URDF: declare it with "
                "effects: [{kind: spring}]"
            )
        if mimic is not None:
            multiplier = _number(mimic, "multiplier", 1.0)
            offset = _number(mimic, "offset", 0.0) - multiplier * _number(mimic, "reference", 0.0)
            of = {"multiplier": repr(multiplier), "offset": repr(offset)}
            ElementTree.SubElement(joint, "mimic", {"joint": mimic.get("joint", ""), **of})


def _pose(element: Element) -> pin.SE3:
    """The <pose> of an element, as it is written."""
    pose = element.find("pose")
    text = "" if pose is None else (pose.text or "")
    figures = [float(word) for word in text.split()] or [0.0] * 6
    if pose is not None and pose.get("rotation_format") == "quat_xyzw" and len(figures) == 7:
        turn = pin.Quaternion(np.array(figures[3:])).normalized().matrix()
    elif len(figures) == 6:
        scale = math.pi / 180 if pose is not None and pose.get("degrees") == "true" else 1.0
        turn = pin.rpy.rpyToMatrix(*(scale * angle for angle in figures[3:]))
    else:
        raise ValueError(f"the pose '{text.strip()[:60]}' is not six numbers")
    if not np.isfinite(figures).all():
        raise ValueError(f"the pose '{text.strip()[:60]}' is not finite")
    return pin.SE3(np.asarray(turn), np.array(figures[:3]))


def _inertia(inertial: Element) -> Array:
    inertia = inertial.find("inertia")
    xx, yy, zz = (_number(inertia, f"i{key}", 1.0) for key in ("xx", "yy", "zz"))
    xy, xz, yz = (_number(inertia, f"i{key}", 0.0) for key in ("xy", "xz", "yz"))
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _number(element: Element | None, key: str, default: float) -> float:
    text = None if element is None else element.findtext(key)
    return default if text is None else float(text)


def _numbers(
    element: Element, key: str, count: int, default: tuple[float, ...] = (1.0, 1.0, 1.0)
) -> Array:
    text = element.findtext(key)
    figures = np.array(default if text is None else [float(word) for word in text.split()])
    if len(figures) != count:
        raise ValueError(f"<{key}> '{(text or '').strip()[:60]}' is not {count} numbers")
    return figures
