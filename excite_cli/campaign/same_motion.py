"""Whether a log is complete, and that of the motion that was to be played.

Planned and measured positions are laid on each other at the lag at which they agree best. Joints
are judged whose planned positions deviate by more than `_MOVES` from their mean; what they are off
is told as a share of that deviation. Another motion has all joints elsewhere. One joint that lags
behind, as a light wrist with much dry friction does, makes no log of another motion: the data hold
where it was.
"""

import hashlib
import json
import os
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import correlate

from excite_cli.atomic import write_text_atomically
from excite_cli.errors import FileError
from excite_cli.robot.model import Array

_RATE = 100.0  # Hz
_MOVES = 5e-3  # rad or m, RMS: less may be hidden by how well a robot holds still
# Of a joint's deviation: arms that swing, and gears that give, are off by a tenth. Over all joints
# more is another motion (joints that have nothing to do with each other are off by 1.4). A MuJoCo
# UR10 with 1.6 N·m of Stribeck friction on its last joint was 35 % off there, and on no other.
_OFF = 0.3
_NOT_PLAYED = 0.7  # of one joint: it stood still, or went its own way
_WHOLE = 0.95  # of the motion's duration


@dataclass(frozen=True)
class MotionMatch:
    """Lag of the log [s]; of every joint that moves, how far it is off, as a share; what is wrong.

    `reason` is empty where the log is that of the motion; `doubt` says which joints could not
    follow it.
    """

    lag: float
    off: dict[str, float]
    reason: str = ""
    doubt: str = ""


def compared(
    planned: tuple[Array, Array], measured: tuple[Array, Array], joint_names: Sequence[str]
) -> MotionMatch:
    """Times (T,) and positions (T, n) that were planned and measured."""
    (t, q), (t_log, q_log) = (_resampled(*each) for each in (planned, measured))
    seconds, logged = t[-1] - t[0], t_log[-1] - t_log[0]
    away = q - q.mean(axis=0)
    deviation = np.sqrt(np.square(away).mean(axis=0))
    moving = np.flatnonzero(deviation > _MOVES)
    if not len(moving):
        return MotionMatch(0.0, {})
    if logged < _WHOLE * seconds:
        reason = f"it lasts {logged:.1f} s, and the motion {seconds:.1f} s: it is not whole"
        return MotionMatch(0.0, {}, reason)
    first = _best_start(q[:, moving], q_log[:, moving], deviation[moving])
    at = np.clip(first + np.arange(len(q)), 0, len(q_log) - 1)
    difference = q_log[at] - q
    off = {
        joint_names[j]: float(np.sqrt(np.square(difference[:, j]).mean()) / deviation[j])
        for j in moving.tolist()
    }
    worst = max(off, key=lambda name: off[name])
    every = float(np.sqrt(np.mean(np.square(list(off.values())))))
    far = {name: share for name, share in off.items() if share > _OFF}
    reason = doubt = ""
    if every > _OFF or off[worst] > _NOT_PLAYED:
        index = list(joint_names).index(worst)
        held = np.ptp(q_log[at, index]) < 0.1 * np.ptp(q[:, index])
        reason = (
            f"{len(far)} of {len(off)} joints are not where the motion has them, most {worst}: off "
            f"by {off[worst]:.0%} of its deviation"
            + (", it stood still" if held else "")
            + f" (allowed: {_OFF:.0%} over all joints, {_NOT_PLAYED:.0%} for one). "
            + (
                "The log is of another motion, or was played at another speed"
                if len(far) == len(off)
                else "The log is of another motion, or the robot could not follow"
            )
        )
    elif far:
        shares = ", ".join(f"{name} by {share:.0%}" for name, share in far.items())
        doubt = (
            f"the robot could not follow the motion: off by more than {_OFF:.0%} of a joint's "
            f"deviation: {shares}. The log holds what it did instead, and is used"
        )
    return MotionMatch(float(first) / _RATE, off, reason, doubt)


def _resampled(t: Array, q: Array) -> tuple[Array, Array]:
    """On a grid of `_RATE`; instants may have gaps."""
    grid = np.arange(t[0], t[-1] + 0.5 / _RATE, 1.0 / _RATE)
    return grid, np.column_stack([np.interp(grid, t, each) for each in q.T])


def _best_start(q: Array, log: Array, deviation: Array) -> int:
    """Sample of the log at which the motion begins: the least sum of squares of all joints.

    A log may begin late or end early by a twentieth of the motion: there the robot is at rest.
    """
    spare = int((1.0 - _WHOLE) * len(q))
    wide = np.pad(log, ((spare, spare), (0, 0)), mode="edge") / deviation
    plan = q / deviation
    count = len(wide) - len(plan) + 1
    if count < 1:
        return -spare
    squares = np.concatenate([[0.0], np.cumsum(np.square(wide).sum(axis=1))])
    own = squares[len(plan) :] - squares[:count]
    mixed = sum(correlate(wide[:, j], plan[:, j], mode="valid") for j in range(q.shape[1]))
    return int(np.argmin(own - 2.0 * np.asarray(mixed))) - spare


# That a log is one: what measured it has ended well, which is recorded beside the log.
#
# A file alone says nothing of that: it is there while a program still writes it, and after one that
# failed. The record holds a digest of the log, so that it is about no other.


def digest_of(log: Path) -> str:
    """SHA-256 of a file, or of all files of a folder and their names."""
    whole = hashlib.sha256()
    for path in _files(log):
        with path.open("rb") as file:
            found = hashlib.file_digest(file, "sha256").hexdigest()
        if path == log:
            return found
        whole.update(f"{path.relative_to(log)}\n{found}\n".encode(errors="surrogateescape"))
    return whole.hexdigest()


def size_of(log: Path) -> int:
    """Bytes of a file, or of all files of a folder."""
    return sum(path.stat().st_size for path in _files(log))


def same_file(log: Path, others: Iterable[Path]) -> Path | None:
    """One of `others` that holds the same bytes as `log`."""
    with suppress(OSError):
        size = size_of(log)
        alike = [each for each in others if each.exists() and size_of(each) == size]
        found = digest_of(log) if alike else ""
        return next((each for each in alike if digest_of(each) == found), None)
    return None


def record_measured(log: Path) -> None:
    """Record that `log` is whole, once it is on the disk.

    Raises
    ------
    FileError
        It cannot be read, or its folder cannot be written to.
    """
    try:
        for path in _files(log):
            with path.open("rb") as file:
                os.fsync(file.fileno())
        text = json.dumps({"log": log.name, "sha256": digest_of(log)})
    except OSError as error:
        raise FileError(f"{log} cannot be read: {error.strerror}.") from error
    write_text_atomically(record_of(log), text + "\n")


def is_measured(log: Path) -> bool:
    """Whether it is recorded that `log`, as it is now, is whole."""
    with suppress(OSError, ValueError, KeyError, TypeError):
        return bool(json.loads(record_of(log).read_bytes())["sha256"] == digest_of(log))
    return False


def record_of(log: Path) -> Path:
    """Where it is recorded that `log` is whole."""
    return log.with_name(f"{log.stem}.measured.json")


def _files(log: Path) -> list[Path]:
    return sorted(path for path in log.rglob("*") if path.is_file()) if log.is_dir() else [log]
