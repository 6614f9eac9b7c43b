"""Fitted capsules on disk, under a key of all that decides the fit."""

import hashlib
import json
import os
from collections.abc import Collection, Iterable
from functools import lru_cache

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from excite_cli.disk_cache import store_arrays, stored_arrays
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.model import Robot

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
