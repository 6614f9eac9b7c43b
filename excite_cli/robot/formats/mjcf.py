"""MJCF, MuJoCo's own format, compiled by MuJoCo and written as a URDF of the same robot.

Includes, defaults and classes are MuJoCo's to resolve; what it has compiled is one tree of bodies.
A joint of MJCF may lie anywhere in its body, so a link's frame is the body's, shifted to the last
of its joints: X = T(p) R Π_i T(p_i) Rot(a_i, q_i − ref_i) T(−p_i), with the reference angle in the
joint's origin, so that positions are MuJoCo's.
"""

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from excite_cli.arrays import Array
from excite_cli.errors import RobotError, optional_module
from excite_cli.robot.allowed_files import allowed_files
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
from excite_cli.robot.formats.mjcf_sources import Ranges, compiled, mjcf_sources
from excite_cli.robot.loops import TAG
from excite_cli.robot.urdf_check import root_tag

Element = ElementTree.Element

_HELD = 1e6  # [N·m·s/rad or N·s/m] damping beyond which a joint stands still
_FREE, _BALL, _SLIDE, _HINGE = range(4)  # mjtJoint
_SITE = 6  # mjtObj
_PLANE, _HFIELD, _SPHERE, _CAPSULE, _ELLIPSOID, _CYLINDER, _BOX, _MESH = range(8)  # mjtGeom


class Mjcf(RobotFormat):
    """Recognised by its root element, `<mujoco>`."""

    name = "MJCF"

    def recognises(self, path: Path, text: str) -> bool:
        """Whether the root element is `mujoco` (a URDF may have such an element within)."""
        if "<mujoco" not in text:
            return False
        return root_tag(text) == "mujoco"

    def load_library(self) -> None:
        """MuJoCo."""
        _library()

    def urdf(self, path: Path, text: str, asked: ConversionRequest) -> Urdf:
        """Bodies as links with inertias, shapes, joints, limits, efforts, friction, couplings."""
        mujoco = _library()
        try:
            model, ranges = compiled(mujoco.MjSpec.from_file(str(path)))
        except Exception as error:
            reason = " ".join(str(error).split())
            raise RobotError(f"{path.name}: MuJoCo cannot compile it: {reason[:400]}") from error
        return _Writer(model, path, ranges).written()

    def sources(self, path: Path, text: str, asked: ConversionRequest) -> tuple[Path, ...] | None:
        """Includes, meshes, textures and height fields."""
        return mjcf_sources(path, text, allowed_files(path, asked.package_dirs))


def _library() -> Any:
    return optional_module(
        "mujoco",
        "Files of MJCF need mujoco, which is not installed. Run: pip install "
        "'excite-cli[formats]'.",
    )


class _Writer:
    """One compiled model as XML."""

    def __init__(self, model: Any, path: Path, ranges: Ranges) -> None:
        self.m, self.path, self.ranges = model, path, ranges
        self.root = 0
        self.robot = ElementTree.Element("robot", name=path.stem)
        self.notes: list[str] = []
        self.meshes: set[str] = set()
        self.efforts = self._efforts()
        self.followed = self._couplings()

    def written(self) -> Urdf:
        self.root, kept = self._root()
        if self.root == 0:
            ElementTree.SubElement(self.robot, "link", name=self._body(0))
        for body in kept:
            self._link(body, is_root=body == self.root)
        self._told()
        text = ElementTree.tostring(self.robot, encoding="unicode")
        folders = {str(Path(mesh).parent) for mesh in self.meshes}
        return Urdf(
            text,
            tuple(sorted(folders)),
            tuple(self.notes),
            tuple(sorted(self.meshes)),
            self._excluded(kept),
        )

    def _excluded(self, kept: list[int]) -> tuple[tuple[str, str], ...]:
        """Pairs of links that <contact> excludes."""
        signatures = [int(each) for each in self.m.exclude_signature]
        pairs = ((each >> 16, each & 0xFFFF) for each in signatures)
        there = {*kept, self.root}
        return tuple(
            (self._body(one), self._body(other))
            for one, other in pairs
            if one in there and other in there
        )

    def _root(self) -> tuple[int, list[int]]:
        """The body that becomes the URDF's root (0: the world), and the bodies that are kept.

        Bodies that float are things about, unless nothing else moves: then the one with the most
        joints is the robot.
        """
        trees: dict[int, list[int]] = {}
        for body in range(1, self.m.nbody):
            trees.setdefault(int(self.m.body_rootid[body]), []).append(body)
        floating = {root for root in trees if _FREE in self._types(root)}
        joints = {
            root: sum(len(self._types(body)) for body in trees[root]) - (root in floating)
            for root in trees
        }
        if not any(joints.values()):
            raise RobotError(f"{self.path.name}: no body has a joint that could be moved.")
        fixed = [root for root in trees if root not in floating]
        if any(joints[root] for root in fixed):
            left = sorted(floating)
            kept = [body for root in sorted(fixed) for body in trees[root]]
            found = 0
        else:
            found = max(floating, key=lambda root: joints[root])
            left = sorted(set(trees) - {found})
            kept = trees[found]
        if left:
            names = ", ".join(self._body(root) for root in left)
            self.notes.append(f"not part of the robot, left out: {names}")
        return found, kept

    def _types(self, body: int) -> list[int]:
        return [int(self.m.jnt_type[j]) for j in self._joints(body)]

    def _joints(self, body: int) -> range:
        first = int(self.m.body_jntadr[body])
        return range(first, first + int(self.m.body_jntnum[body])) if first >= 0 else range(0)

    def _movable(self, body: int) -> list[int]:
        single = [j for j in self._joints(body) if self.m.jnt_type[j] in (_SLIDE, _HINGE)]
        return [j for j in single if not self._is_held(j)]

    def _is_held(self, j: int) -> bool:
        """Whether nothing moves a joint, for all its damping: some authors lock joints so."""
        return bool(self.m.dof_damping[int(self.m.jnt_dofadr[j])] > _HELD)

    def _offset(self, body: int) -> Array:
        """Origin (3,) of a body's link in the body's frame: its last joint."""
        joints = self._movable(body)
        return np.array(self.m.jnt_pos[joints[-1]]) if joints else np.zeros(3)

    def _link(self, body: int, is_root: bool) -> None:
        link = ElementTree.SubElement(self.robot, "link", name=self._body(body))
        shift = self._offset(body)
        mass = float(self.m.body_mass[body])
        if mass > 0.0:
            turn = _matrix(self.m.body_iquat[body])
            inertia = turn @ np.diag(self.m.body_inertia[body]) @ turn.T
            add_inertial(link, mass, self.m.body_ipos[body] - shift, inertia)
        self._shapes(link, body, shift)
        if not is_root:
            self._connected(body)

    def _connected(self, body: int) -> None:
        """The joints from the parent's link to the body's, through links without mass."""
        m, parent = self.m, int(self.m.body_parentid[body])
        place = np.array(m.body_pos[body]) - self._offset(parent)
        turn, before = _matrix(m.body_quat[body]), np.zeros(3)
        joints, above = self._movable(body), self._body(parent)
        if any(kind == _BALL for kind in self._types(body)):
            name = self._body(body)
            self.notes.append(f"the ball joint of {name} is locked: one angle per joint")
        if not joints:
            self._joint(f"{self._body(body)}_fixed", "fixed", above, self._body(body), place, turn)
            return
        for j in joints:
            last = j == joints[-1]
            below = self._body(body) if last else f"{self._body(body)}__{self._name(j)}"
            if not last:
                ElementTree.SubElement(self.robot, "link", name=below)
            axis, ref = np.array(m.jnt_axis[j]), float(m.qpos0[m.jnt_qposadr[j]])
            place = place + turn @ (np.array(m.jnt_pos[j]) - before)
            if m.jnt_type[j] == _SLIDE:
                kind = "prismatic"
                place = place - ref * (turn @ axis)
            else:
                kind = "revolute" if j in self.ranges else "continuous"
                turn = turn @ pin.exp3(-ref * axis)
            joint = self._joint(self._name(j), kind, above, below, place, turn)
            ElementTree.SubElement(joint, "axis", xyz=words(axis))
            self._limit(joint, j)
            self._dynamics(joint, j)
            before, place, turn, above = np.array(m.jnt_pos[j]), np.zeros(3), np.eye(3), below

    def _joint(
        self, name: str, kind: str, parent: str, child: str, place: Array, turn: Array
    ) -> Element:
        joint = ElementTree.SubElement(self.robot, "joint", name=name, type=kind)
        add_origin(joint, place, turn)
        ElementTree.SubElement(joint, "parent", link=parent)
        ElementTree.SubElement(joint, "child", link=child)
        return joint

    def _limit(self, joint: Element, j: int) -> None:
        effort = self.efforts.get(j, 0.0)  # 0: not known, as for the velocity, which MJCF lacks
        limit = {"effort": repr(effort), "velocity": "0"}
        if j in self.ranges:
            lower, upper = self.ranges[j]
            limit |= {"lower": repr(lower), "upper": repr(upper)}
        elif self.m.jnt_type[j] == _SLIDE:
            limit |= {"lower": "-1e9", "upper": "1e9"}
        ElementTree.SubElement(joint, "limit", limit)
        if j in self.followed:
            driver, multiplier, offset = self.followed[j]
            figures = {"multiplier": repr(multiplier), "offset": repr(offset)}
            ElementTree.SubElement(joint, "mimic", {"joint": self._name(driver), **figures})

    def _dynamics(self, joint: Element, j: int) -> None:
        dof = int(self.m.jnt_dofadr[j])
        damping, friction = float(self.m.dof_damping[dof]), float(self.m.dof_frictionloss[dof])
        if damping or friction:
            ElementTree.SubElement(
                joint, "dynamics", damping=repr(damping), friction=repr(friction)
            )

    def _efforts(self) -> dict[int, float]:
        """The largest torque [N·m or N] of joints whose actuators, or whose joint, limit it."""
        m, found = self.m, {}
        for actuator in range(m.nu):
            if m.actuator_trntype[actuator] != 0:  # of a joint
                continue
            j, gear = int(m.actuator_trnid[actuator, 0]), abs(float(m.actuator_gear[actuator, 0]))
            if m.actuator_forcelimited[actuator]:
                force = float(np.abs(m.actuator_forcerange[actuator]).max())
            elif m.actuator_ctrllimited[actuator] and m.actuator_biastype[actuator] == 0:
                gain = abs(float(m.actuator_gainprm[actuator, 0]))
                force = gain * float(np.abs(m.actuator_ctrlrange[actuator]).max())
            else:
                continue
            found[j] = force * gear
        for j in range(m.njnt):
            if m.jnt_actfrclimited[j]:
                most = float(np.abs(m.jnt_actfrcrange[j]).max())
                found[j] = min(most, found.get(j, most))
        return found

    def _couplings(self) -> dict[int, tuple[int, float, float]]:
        """Joints that follow another one: that one, multiplier and offset."""
        m, found = self.m, {}
        for k in range(m.neq):
            if m.eq_type[k] != 2 or int(m.eq_obj2id[k]) < 0:  # no coupling of two joints
                continue
            follower, driver = int(m.eq_obj1id[k]), int(m.eq_obj2id[k])
            constant, slope, *rest = map(float, m.eq_data[k, :5])
            at, of = (float(m.qpos0[m.jnt_qposadr[j]]) for j in (follower, driver))
            if any(rest):
                self.notes.append(
                    f"{self._name(follower)} follows {self._name(driver)} by a curve; its slope "
                    "at the reference position is taken"
                )
            found[follower] = (driver, slope, at + constant - slope * of)
        return found

    def _cut(self, k: int) -> None:
        """What closes a loop, beside the tree; between bodies, or between sites of bodies."""
        m = self.m
        ends = [int(m.eq_obj1id[k]), int(m.eq_obj2id[k])]
        if m.eq_objtype[k] == _SITE:
            ends = [int(m.site_bodyid[site]) for site in ends]
        if any(m.body_mocapid[body] >= 0 for body in ends):  # a handle to drag the robot by
            return
        loop = ElementTree.SubElement(self.robot, TAG, name=f"loop_{k}")
        for tag, body in zip(("link1", "link2"), ends, strict=True):
            ElementTree.SubElement(loop, tag, link=self._body(body))

    def _told(self) -> None:
        m = self.m
        held = [self._name(j) for j in range(m.njnt) if self._is_held(j)]
        if held:
            self.notes.append(f"their damping holds these joints: {', '.join(held)}")
        closed = [k for k in range(m.neq) if m.eq_type[k] in (0, 1) and m.eq_active0[k]]
        for k in closed:
            self._cut(k)
        if m.ntendon:
            self.notes.append(f"{m.ntendon} tendon(s) are left out: their forces are not modelled")
        if bool((np.asarray(m.dof_armature) > 0).any()):
            self.notes.append(
                "armature (inertia of rotors) has no place in a URDF: declare it with "
                "effects: [{kind: armature}]"
            )

    def _shapes(self, link: Element, body: int, shift: Array) -> None:
        first, count = int(self.m.body_geomadr[body]), int(self.m.body_geomnum[body])
        geoms = range(first, first + count) if first >= 0 else range(0)
        solid = [g for g in geoms if self.m.geom_contype[g] or self.m.geom_conaffinity[g]]
        shown = [g for g in geoms if g not in solid] or solid
        for kind, chosen in (("collision", solid), ("visual", shown)):
            for g in chosen:
                for place, turn, shape in self._geometry(g):
                    item = add_shape(link, kind, place - shift, turn, shape)
                    if kind == "visual":
                        material = ElementTree.SubElement(item, "material", name=f"colour_{g}")
                        ElementTree.SubElement(material, "color", rgba=words(self._colour(g)))

    def _colour(self, g: int) -> Array:
        material = int(self.m.geom_matid[g])
        return np.array(self.m.mat_rgba[material] if material >= 0 else self.m.geom_rgba[g])

    def _geometry(self, g: int) -> Iterator[tuple[Array, Array, Element]]:
        m = self.m
        place, turn = np.array(m.geom_pos[g]), _matrix(m.geom_quat[g])
        kind, size = int(m.geom_type[g]), np.array(m.geom_size[g])
        if kind == _SPHERE:
            yield place, turn, ElementTree.Element("sphere", radius=repr(float(size[0])))
        elif kind in (_CYLINDER, _CAPSULE):
            parts = list(capsule(float(size[0]), 2 * float(size[1])))
            for height, part in parts if kind == _CAPSULE else parts[:1]:
                yield place + height * turn[:, 2], turn, part
        elif kind == _BOX:
            yield place, turn, ElementTree.Element("box", size=words(2 * size))
        elif kind == _ELLIPSOID:
            yield place, turn, mesh(*ellipsoid(size), self.meshes)
        elif kind == _MESH:
            number = int(m.geom_dataid[g])
            vertices = slice(int(m.mesh_vertadr[number]), None)
            points = m.mesh_vert[vertices][: int(m.mesh_vertnum[number])]
            faces = m.mesh_face[int(m.mesh_faceadr[number]) :][: int(m.mesh_facenum[number])]
            # As MuJoCo has it: scaled, recentred.
            both = np.array(points, dtype=float), np.array(faces, dtype=np.intp)
            yield place, turn, mesh(*both, self.meshes)
        elif kind not in (_PLANE, _HFIELD):
            self.notes.append(f"a shape of {self._body(int(m.geom_bodyid[g]))} is left out")

    def _body(self, body: int) -> str:
        return str(self.m.body(body).name) or f"body_{body}"

    def _name(self, j: int) -> str:
        return str(self.m.joint(j).name) or f"{self._body(int(self.m.jnt_bodyid[j]))}_joint_{j}"


def _matrix(quaternion: Array) -> Array:
    w, x, y, z = map(float, quaternion)
    return np.asarray(pin.Quaternion(w, x, y, z).normalized().matrix())
