"""A digest of a motion and of all that is said of it, by which a change of either is seen.

It covers the coefficients, the verdicts with their margins, the condition numbers, and what they
speak of: the config (with trajectory and constraints), the robot's hash and the order of its
joints. It guards against accidents and careless editing, and is no signature: who edits a motion
can compute it anew.
"""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from excite_cli.constraints.base import Array
from excite_cli.excitation.motion import Motion
from excite_cli.proof.worst_margin import Worst

_FORM = 1  # of what the digest is taken; another one after a change of it


def digest_of(motion: Motion, config: str, robot: str, joints: Sequence[str]) -> str:
    """Of a motion of these `joints`, planned with `config` for the robot of this hash.

    Seconds and iterations that the search took are left out: they say nothing of the motion.
    """
    numbers = (
        motion.condition_number,
        motion.stacked_condition_number,
        motion.dense_condition_number,
    )
    about = {
        "form": _FORM,
        "config": config,
        "robot": robot,
        "joints": list(joints),
        "index": int(motion.index),
        "coefficients": digest_of_array(motion.coefficients),
        "condition_numbers": [None if number is None else float(number) for number in numbers],
        "improved": bool(motion.improved),
        "status": str(motion.status),
        "note": motion.note,
        "certified": {name: bool(proved) for name, proved in motion.certified.items()},
        "margins": {name: _as_stored(worst) for name, worst in motion.margins.items()},
    }
    return hashlib.sha256(json.dumps(about, sort_keys=True).encode()).hexdigest()


def digest_of_array(array: Array) -> str:
    """Of numbers in their order and shape, the same on every machine."""
    plain = np.ascontiguousarray(array, dtype="<f8")
    return hashlib.sha256(f"{plain.shape}|".encode() + plain.tobytes()).hexdigest()


def _as_stored(worst: Worst) -> dict[str, Any]:
    """As it comes back from a file, where whole numbers may have become others."""
    numbers = {key: float(getattr(worst, key)) for key in ("margin", "time", "share")}
    return {**asdict(worst), **numbers, "violations": int(worst.violations)}
