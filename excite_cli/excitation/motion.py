"""Records that travel from the optimiser to the file and the terminal."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from enum import StrEnum
from typing import Any

import numpy as np

from excite_cli.constraints.base import Array
from excite_cli.excitation.progress import Status
from excite_cli.proof.certificate import Worst
from excite_cli.shown.answer import Shown

# Why what a result says of a motion may not hold for it.


class Doubt(StrEnum):
    """Why a motion does not count as proved, whatever its verdict; empty where it may."""

    NONE = ""
    CHANGED = "changed since it was proved"
    EARLIER = "written by an earlier version"
    OTHER_ROBOT = "proved for another robot than its file describes now"


@dataclass(frozen=True)
class Outcome:
    """What a solver returns: the best admissible point it saw, as free variables x.

    With `last` (where it was when it stopped) and `memory` (its estimate of the curvature) it can
    go on. `way`: points that it came by, each with more room to the limits than the next.
    """

    x: Array
    status: Status
    iterations: int
    evaluations: int
    last: Array | None = None
    memory: Array | None = None
    way: tuple[Array, ...] = ()


@dataclass(frozen=True, repr=False)
class Motion(Shown):
    """One generated motion that keeps all constraints.

    `condition_number` is that of the motion alone, `stacked_condition_number` that of the motion
    with all earlier data, both on the samples of the cost, and `dense_condition_number` the latter
    on eight times as many (None in files of before). `predicted_deviation`: where motions are
    planned for torques of the work, the RMS standard deviation of such a torque after this motion
    and all before, in units of the noise of a sample. `improved` tells whether the stack became
    better by it; `note` says what else one should know; `certified` which constraints are proved
    at every instant. With a `doubt`, none counts as proved: the motion is another one than that
    which was. `digest` is that of all this (`motion_digest`), from when the motion was finished.
    """

    index: int
    coefficients: Array
    condition_number: float
    stacked_condition_number: float
    improved: bool
    status: Status
    seconds: float
    iterations: int
    evaluations: int
    margins: dict[str, Worst]
    note: str = ""
    certified: dict[str, bool] = field(default_factory=dict)
    dense_condition_number: float | None = None
    predicted_deviation: float | None = None
    digest: str = ""
    doubt: Doubt = Doubt.NONE

    def doubted(self, doubt: Doubt) -> "Motion":
        """The motion of which nothing counts as proved, and why."""
        return replace(self, doubt=doubt, certified=dict.fromkeys(self.certified, False))


# A digest of a motion and of all that is said of it, by which a change of either is seen.
#
# It covers the coefficients, the verdicts with their margins, the condition numbers, and what they
# speak of: the config (with trajectory and constraints), the robot's hash and the order of its
# joints. It guards against accidents and careless editing, and is no signature: who edits a motion
# can compute it anew.

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
    if motion.predicted_deviation is not None:
        about["predicted_deviation"] = float(motion.predicted_deviation)
    return hashlib.sha256(json.dumps(about, sort_keys=True).encode()).hexdigest()


def digest_of_array(array: Array) -> str:
    """Of numbers in their order and shape, the same on every machine."""
    plain = np.ascontiguousarray(array, dtype="<f8")
    return hashlib.sha256(f"{plain.shape}|".encode() + plain.tobytes()).hexdigest()


def _as_stored(worst: Worst) -> dict[str, Any]:
    """As it comes back from a file, where whole numbers may have become others."""
    numbers = {key: float(getattr(worst, key)) for key in ("margin", "time", "share")}
    return {**asdict(worst), **numbers, "violations": int(worst.violations)}
