"""Why pairs of capsules are dropped, on disk: what takes seconds is found once for a robot.

A file that is missing, damaged or foreign is the same as none; a folder that cannot be written is
no error.
"""

import hashlib

import coal
import numpy as np

from excite_cli.errors import RobotError
from excite_cli.geometry.capsule_cache import capsule_key
from excite_cli.geometry.link_shapes import collision_model
from excite_cli.geometry.table_cache import store_arrays, stored_arrays
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.model import Robot

_VERSION = 1  # raise when the choice changes
_REASONS = "reasons"


def choice_key(
    robot: Robot,
    capsules: tuple[Capsule, ...],
    pairs: list[tuple[int, int]],
    margin: float,
    samples: int,
    seed: int,
) -> str | None:
    """Hash of all that decides the choice; None where the meshes cannot be read."""
    try:
        geometry = capsule_key(robot, collision_model(robot), ())
    except RobotError:
        return None
    asked = (geometry, robot.fingerprint(), pairs, margin, samples, seed, coal.__version__)
    digest = hashlib.sha256(f"{_VERSION}|{asked}".encode())
    for part in (*robot.limits.ranges(), robot.posture):
        digest.update(part.tobytes())
    for capsule in capsules:
        named = (capsule.name, capsule.joint, capsule.links, capsule.by_hand, capsule.radius)
        digest.update(f"|{named}".encode())
        digest.update(capsule.start.tobytes() + capsule.end.tobytes())
    return digest.hexdigest()


def stored_reasons(key: str | None, count: int) -> list[str] | None:
    """The reasons of `count` pairs stored under `key`, empty where a pair is kept, or None."""
    found = stored_arrays(key) if key is not None else None
    if found is None or _REASONS not in found:
        return None
    reasons = found[_REASONS]
    if reasons.shape != (count,) or reasons.dtype.kind != "U":
        return None
    return [str(reason) for reason in reasons]


def store_reasons(key: str | None, reasons: list[str]) -> None:
    """Keep `reasons` under `key`."""
    if key is not None:
        store_arrays(key, {_REASONS: np.array(reasons, dtype=np.str_)})
