"""Why pairs of capsules are dropped, on disk: what takes seconds is found once for a robot.

A file that is missing, damaged or foreign is the same as none; a folder that cannot be written is
no error.
"""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import coal
import numpy as np

from excite_cli.disk_cache import store_arrays, stored_arrays
from excite_cli.errors import RobotError
from excite_cli.geometry.capsule_cache import geometry_key
from excite_cli.geometry.link_shapes import collision_model
from excite_cli.geometry.reasons import LinksApart, Reason, Why
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.model import Robot

_VERSION = 3  # raise when the choice changes
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
        geometry = geometry_key(robot, collision_model(robot))
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


def stored_reasons(key: str | None, count: int) -> list[Reason | None] | None:
    """The reasons of `count` pairs stored under `key`, None where a pair is kept; or None."""
    found = stored_arrays(key) if key is not None else None
    if found is None or _REASONS not in found:
        return None
    reasons = found[_REASONS]
    if reasons.shape != (count,) or reasons.dtype.kind != "U":
        return None
    try:
        return [_reason(json.loads(str(text))) for text in reasons]
    except (ValueError, TypeError, KeyError):  # no reasons of ours
        return None


def store_reasons(key: str | None, reasons: Sequence[Reason | None]) -> None:
    """Keep `reasons` under `key`."""
    if key is not None:
        texts = [json.dumps(None if reason is None else asdict(reason)) for reason in reasons]
        store_arrays(key, {_REASONS: np.array(texts, dtype=np.str_)})


def _reason(data: dict[str, Any] | None) -> Reason | None:
    if data is None:
        return None
    distance, apart = data["distance"], tuple(LinksApart(**each) for each in data["apart"])
    return Reason(Why(data["why"]), None if distance is None else float(distance), apart)
