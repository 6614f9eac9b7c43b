"""Capsules that contain the robot's collision geometry, or are given by hand.

Each link gets its capsule of least volume. Links that stand still towards each other share one
where that wastes little room (the many small parts of a gripper); a link that one capsule fits
badly is cut across a main axis. Everything is in the frame of the joint that carries the link.
"""

import hashlib
import json
import os
from collections.abc import Collection, Iterable
from functools import lru_cache

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from excite_cli.config.constraints_spec import CapsuleSpec, SelfCollisionSpec
from excite_cli.disk_cache import store_arrays, stored_arrays
from excite_cli.errors import ConfigError, RobotError, nearest
from excite_cli.geometry.capsule_cover import cover
from excite_cli.geometry.capsule_fit import segment_distances
from excite_cli.geometry.link_shapes import collision_model, link_shapes, placed_shapes
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.carried_payload import check_size
from excite_cli.robot.model import Robot

# Fitted capsules on disk, under a key of all that decides the fit.

_VERSION = 3  # raise when the fit changes


def geometry_key(robot: Robot, geometry: pin.GeometryModel) -> str:
    """Hash of a robot's geometry: URDF, content of meshes, where shapes sit on their joints."""
    digest = hashlib.sha256(f"{_VERSION}|{robot.description.sha256}".encode())
    for item in geometry.geometryObjects:
        frame = robot.model.frames[item.parentFrame]
        digest.update(f"|{item.name}|{frame.name}|{item.parentJoint}|{item.meshPath}".encode())
        digest.update(np.round(item.placement.homogeneous, 9).tobytes())
        digest.update(_mesh(item))
    return digest.hexdigest()


def cover_key(
    shapes: Iterable[tuple[pin.GeometryObject, str, NDArray[np.float64]]], apart: Collection[str]
) -> str:
    """Hash of all that decides the capsules of one joint, of its `placed_shapes`."""
    digest = hashlib.sha256(f"cover {_VERSION}".encode())
    for item, link, points in shapes:
        kind = type(item.geometry).__name__
        digest.update(json.dumps([link, link in apart, kind, points.shape]).encode())
        digest.update(np.ascontiguousarray(points).tobytes())
        digest.update(_mesh(item))
    return digest.hexdigest()


def _mesh(item: pin.GeometryObject) -> bytes:
    """Hash of the file of a mesh; nothing for primitives."""
    if not os.path.isfile(item.meshPath):
        return b""
    state = os.stat(item.meshPath)
    return _content(item.meshPath, state.st_size, state.st_mtime_ns)


@lru_cache(maxsize=1024)
def _content(path: str, size: int, changed: int) -> bytes:
    """Hash of a file; its size and time only say when a process has to read it again."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").digest()


def stored_capsules(key: str, joint: int) -> list[Capsule] | None:
    """Capsules stored under `key`, on that joint; or None."""
    found = stored_arrays(key)
    if found is None:
        return None
    try:
        named = [json.loads(text) for text in found["names"].tolist()]
        numbers = zip(found["starts"], found["ends"], found["radii"], strict=True)
        return [
            Capsule(name, joint, np.array(start), np.array(end), float(radius), tuple(links))
            for (name, links), (start, end, radius) in zip(named, numbers, strict=True)
        ]
    except (KeyError, TypeError, ValueError):  # no capsules of ours
        return None


def store_capsules(key: str, capsules: Iterable[Capsule]) -> None:
    """Keep capsules of one joint under `key`."""
    all_ = list(capsules)
    store_arrays(
        key,
        {
            "names": np.array([json.dumps([c.name, c.links]) for c in all_], dtype=np.str_),
            "starts": np.array([c.start for c in all_]),
            "ends": np.array([c.end for c in all_]),
            "radii": np.array([c.radius for c in all_]),
        },
    )


__all__ = ["Capsule", "fit_capsules", "link_joints"]

Placed = tuple[pin.GeometryObject, str, NDArray[np.float64]]

_INSIDE = 1e-9  # [m], rounding of a corner that a capsule touches


def fit_capsules(
    robot: Robot, spec: SelfCollisionSpec, apart: Collection[str] = ()
) -> tuple[Capsule, ...]:
    """Capsules of all links with collision geometry, ordered by joint; `spec` may replace some.

    Links named in `spec` share their capsule with no other, so that what is said of one link is
    not said of its neighbour. So do those in `apart`. The robot's payload comes with them.

    Raises
    ------
    ConfigError
        `spec` names a link that the robot does not have, or gives a capsule larger than the robot.
    RobotError
        A mesh cannot be used, or the robot has no collision geometry.
    """
    given: dict[str, CapsuleSpec] = {} if spec.capsules == "auto" else dict(spec.capsules)
    joints = link_joints(robot)
    for link in given:
        _check_link(link, joints, f"constraints.self_collision.capsules.{link}")
    for key, pairs in (("ignore", spec.ignore), ("by_meshes", spec.by_meshes)):
        for pair in pairs:
            for link in pair:
                _check_link(link, link_names(robot), f"constraints.self_collision.{key}")
    for link in spec.without_shapes:
        _check_link(link, joints, "constraints.self_collision.without_shapes")
    by_hand = [
        Capsule(
            link, joints[link], np.array(one.start), np.array(one.end), one.radius, (link,), True
        )
        for link, one in given.items()
    ]
    for capsule in by_hand:
        check_size(robot.model, capsule, f"constraints.self_collision.capsules.{capsule.name}")
    told = {link for pair in (*spec.ignore, *spec.by_meshes) for link in pair}
    alone = told | set(given) | set(apart)
    fitted = [c for c in _fitted(robot, alone & set(joints)) if c.links[0] not in given]
    if not fitted and not by_hand:
        raise RobotError(
            f"{robot.description.path.name} has no collision geometry, so distances cannot be "
            "checked. Take its visual shapes (constraints.self_collision.shapes: visual), "
            "give capsules by link under constraints.self_collision.capsules, use a URDF with "
            "<collision> elements, or drop constraints.self_collision and "
            "constraints.surroundings."
        )
    carried = [] if robot.payload is None else [robot.payload.capsule]
    return tuple(sorted([*fitted, *by_hand, *carried], key=lambda capsule: capsule.joint))


def link_joints(robot: Robot) -> dict[str, int]:
    """Joint of `robot.model` that carries each link of the URDF (0: fixed to the world)."""
    return {
        str(frame.name): int(frame.parentJoint)
        for frame in robot.model.frames
        if frame.type == pin.FrameType.BODY
    }


def link_names(robot: Robot) -> list[str]:
    """All that can be told apart by name: the links of the URDF, and the payload if there is one.

    The payload goes by the name of its capsule.
    """
    return [*link_joints(robot), *([] if robot.payload is None else robot.payload.capsule.links)]


def _check_link(link: str, known: Collection[str], where: str) -> None:
    if link not in known:
        raise ConfigError(
            f"{where}: the robot has no link '{link}'.{nearest(link, known)} "
            f"Its links: {', '.join(sorted(known))}."
        )


def _fitted(robot: Robot, apart: set[str]) -> list[Capsule]:
    """Capsules joint by joint: stored ones where they hold all shapes, else fitted and stored."""
    geometry = collision_model(robot)
    shapes: dict[int, list[Placed]] = {}
    for item, link, points in placed_shapes(robot, geometry):
        shapes.setdefault(int(item.parentJoint), []).append((item, link, points))
    found: dict[int, list[Capsule]] = {}
    missing: dict[int, str] = {}
    for joint, on_joint in sorted(shapes.items()):
        key = cover_key(on_joint, apart)
        capsules = stored_capsules(key, joint)
        if capsules is None or not _contained(on_joint, capsules):
            capsules, missing[joint] = [], key
        found[joint] = capsules
    if missing:
        for capsule in cover(link_shapes(robot, geometry, missing), apart):
            found[capsule.joint].append(capsule)
        for joint, key in missing.items():
            store_capsules(key, found[joint])
    return [capsule for capsules in found.values() for capsule in capsules]


def _contained(shapes: Iterable[Placed], capsules: list[Capsule]) -> bool:
    """Whether every corner of every shape lies in a capsule of its link.

    What comes from disk is measured before proofs rest on it.
    """
    for _, link, points in shapes:
        of_link = [c for c in capsules if link in c.links]
        depths = [c.radius - segment_distances(points, c.start, c.end) for c in of_link]
        if not depths or np.max(depths, axis=0).min() < -_INSIDE:
            return False
    return True
