"""Fitted capsules on disk, under a key of all that decides the fit."""

import hashlib
import json
import os
from collections.abc import Collection, Iterable
from functools import lru_cache

import numpy as np
import pinocchio as pin

from excite_cli.geometry.disk_cache import store_arrays, stored_arrays
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.model import Robot

_VERSION = 2  # raise when the fit changes


def capsule_key(robot: Robot, geometry: pin.GeometryModel, apart: Collection[str]) -> str:
    """Hash of all that decides a fit: URDF, content of meshes, where links sit on their joints."""
    digest = hashlib.sha256(f"{_VERSION}|{sorted(apart)}|{robot.description.sha256}".encode())
    for item in geometry.geometryObjects:
        frame = robot.model.frames[item.parentFrame]
        digest.update(f"|{item.name}|{frame.name}|{item.parentJoint}|{item.meshPath}".encode())
        digest.update(np.round(item.placement.homogeneous, 9).tobytes())
        if os.path.isfile(item.meshPath):
            state = os.stat(item.meshPath)
            digest.update(_content(item.meshPath, state.st_size, state.st_mtime_ns))
    return digest.hexdigest()


@lru_cache(maxsize=1024)
def _content(path: str, size: int, changed: int) -> bytes:
    """Hash of a file; its size and time only say when a process has to read it again."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").digest()


def stored_capsules(key: str) -> list[Capsule] | None:
    """Capsules stored under `key`, or None."""
    found = stored_arrays(key)
    if found is None:
        return None
    try:
        columns = zip(*(found[name].tolist() for name in ("names", "joints")), strict=True)
        named = [(*json.loads(text), joint) for text, joint in columns]
        numbers = zip(found["starts"], found["ends"], found["radii"], strict=True)
        return [
            Capsule(name, joint, np.array(start), np.array(end), float(radius), tuple(links))
            for (name, links, joint), (start, end, radius) in zip(named, numbers, strict=True)
        ]
    except (KeyError, TypeError, ValueError):  # no capsules of ours
        return None


def store_capsules(key: str, capsules: Iterable[Capsule]) -> None:
    """Keep capsules under `key`."""
    all_ = list(capsules)
    store_arrays(
        key,
        {
            "names": np.array([json.dumps([c.name, c.links]) for c in all_], dtype=np.str_),
            "joints": np.array([c.joint for c in all_]),
            "starts": np.array([c.start for c in all_]),
            "ends": np.array([c.end for c in all_]),
            "radii": np.array([c.radius for c in all_]),
        },
    )
