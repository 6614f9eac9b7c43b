"""Capsules on disk, so that a robot is fitted once.

One JSON file per robot in the user's cache folder. A file that is missing, damaged or foreign is
the same as none; a folder that cannot be written is no error.
"""

import hashlib
import json
import os
from collections.abc import Collection, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from excite_cli.atomic import write_text_atomically
from excite_cli.errors import FileError
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.model import Robot

_VERSION = 1  # raise when the fit changes


def cache_folder() -> Path:
    """Folder of the program's cache: `$XDG_CACHE_HOME/excite` or `~/.cache/excite`."""
    given = os.environ.get("XDG_CACHE_HOME", "")
    root = Path(given) if Path(given).is_absolute() else Path("~/.cache").expanduser()
    return root / "excite"


def capsule_key(robot: Robot, geometry: pin.GeometryModel, apart: Collection[str]) -> str:
    """Hash of all that decides a fit: URDF, meshes on disk, where links sit on their joints."""
    digest = hashlib.sha256(f"{_VERSION}|{sorted(apart)}|{robot.description.sha256}".encode())
    for item in geometry.geometryObjects:
        frame = robot.model.frames[item.parentFrame]
        digest.update(f"|{item.name}|{frame.name}|{item.parentJoint}|{item.meshPath}".encode())
        digest.update(np.round(item.placement.homogeneous, 9).tobytes())
        if os.path.isfile(item.meshPath):
            state = os.stat(item.meshPath)
            digest.update(f"|{state.st_size}|{state.st_mtime_ns}".encode())
    return digest.hexdigest()


def stored_capsules(key: str) -> list[Capsule] | None:
    """Capsules stored under `key`, or None."""
    try:
        content = json.loads(_path(key).read_text(encoding="utf-8"))
        if content["key"] != key:
            return None
        return [_capsule(record) for record in content["capsules"]]
    except (OSError, RuntimeError, ValueError, KeyError, TypeError, RecursionError):
        return None


def store_capsules(key: str, capsules: Iterable[Capsule]) -> None:
    """Write capsules under `key`, whole or not at all."""
    records = [
        {
            "name": capsule.name,
            "joint": capsule.joint,
            "start": capsule.start.tolist(),
            "end": capsule.end.tolist(),
            "radius": capsule.radius,
            "links": list(capsule.links),
        }
        for capsule in capsules
    ]
    text = json.dumps({"key": key, "capsules": records})
    try:
        write_text_atomically(_path(key), text)
    except (FileError, RuntimeError):
        return


def _path(key: str) -> Path:
    return cache_folder() / f"capsules-{key[:32]}.json"


def _capsule(record: Any) -> Capsule:
    start = np.array(record["start"], dtype=float)
    end = np.array(record["end"], dtype=float)
    radius = float(record["radius"])
    if start.shape != (3,) or end.shape != (3,) or not np.isfinite([*start, *end, radius]).all():
        raise ValueError("not a capsule")
    links = tuple(str(link) for link in record["links"])
    return Capsule(str(record["name"]), int(record["joint"]), start, end, radius, links)
