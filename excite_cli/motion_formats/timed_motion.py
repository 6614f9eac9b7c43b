"""A motion as files hold it: positions, speeds and accelerations of named joints at instants.

Units: s, rad, rad/s, rad/s² (m for prismatic joints). What comes from a file is checked before it
is used: increasing instants, finite numbers, and columns matched to joints by name.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from excite_cli.errors import FileError, nearest

if TYPE_CHECKING:
    from excite_cli.measurement.dataset import Array

_LARGEST = 1e12  # of any number, as of measured data: squares of larger ones overflow
_CHANNELS = {"q": "position", "v": "speed", "a": "acceleration"}
_LISTED = 12
# Share by which changes and rates may differ; the change below which nothing is compared, and the
# number of instants.
_DISAGREE, _STILL, _SAMPLED = 0.3, 1e-3, 50


@dataclass(frozen=True)
class TimedMotion:
    """t (T,) and q, v, a (T, n), columns in the order of `joint_names`; v or a may be unknown.

    `numbered`: the file has numbers in place of the joints' names.
    """

    name: str
    joint_names: tuple[str, ...]
    t: Array
    q: Array
    v: Array | None = None
    a: Array | None = None
    numbered: bool = False

    @property
    def duration(self) -> float:
        """[s]."""
        return float(self.t[-1] - self.t[0])

    @property
    def states(self) -> tuple[Array, Array, Array]:
        """q, v, a (T, n) of a motion that has them all; FileError if it has not."""
        if self.v is None or self.a is None:
            raise FileError(
                f"{self.name}: only a motion with speeds and accelerations is exported."
            )
        return self.q, self.v, self.a


def checked(path: Path, motion: TimedMotion) -> TimedMotion:
    """`motion` as it is, once it is sure that it can be played.

    Raises
    ------
    FileError
        Fewer than two instants, instants that do not increase, or a value that is no number.
    """
    names, t = motion.joint_names, motion.t
    twice = sorted(name for name, count in Counter(names).items() if count > 1)
    if twice:
        raise FileError(f"{path} has joint '{twice[0]}' twice. Give every joint once.")
    if len(t) < 2 or not names:
        raise FileError(
            f"{path} has {len(t)} instants of {len(names)} joints; a motion needs at least two "
            "instants of one joint."
        )
    if not (good := np.abs(t) <= _LARGEST).all():
        row = int(np.argmin(good))
        raise FileError(f"{path}: instant {row + 1} of {len(t)} is not a number.")
    if not (np.diff(t) > 0).all():
        row = int(np.argmax(np.diff(t) <= 0))
        raise FileError(
            f"{path}: time does not increase: {t[row + 1]:.9g} s comes after {t[row]:.9g} s "
            f"(instants {row + 1} and {row + 2}). Sort the instants, and give each once."
        )
    for channel, words in _CHANNELS.items():
        values = getattr(motion, channel)
        if values is not None and not (good := np.abs(values) <= _LARGEST).all():
            row, joint = np.argwhere(~good)[0].tolist()
            raise FileError(
                f"{path}: the {words} of '{names[joint]}' at {t[row]:.6g} s (instant {row + 1}) "
                "is missing, or no number of a robot."
            )
    _check_agreement(path, motion, "position", motion.q, motion.v)
    if motion.v is not None:
        _check_agreement(path, motion, "speed", motion.v, motion.a)
    return motion


def _check_agreement(
    path: Path, motion: TimedMotion, words: str, x: Array, rate: Array | None
) -> None:
    """Refuse rates (T, n) that are not those of x (T, n): wrong units of time, or another signal.

    Between samples x changes by about the mean of both rates times the step; what differs, summed
    over the motion, is compared with the change itself. A few way points, or stops at each of them
    (rates of zero), say nothing about what is between.
    """
    if rate is None or len(motion.t) < _SAMPLED:
        return
    step = np.diff(motion.t)[:, None]
    change = np.diff(x, axis=0)
    off = np.abs(change - step * (rate[1:] + rate[:-1]) / 2).sum(axis=0)
    size = np.maximum(np.abs(change), step * np.abs(rate[1:] + rate[:-1]) / 2).sum(axis=0)
    share = off / np.where(size > 0, size, 1.0)
    share[(size < _STILL) | ~rate.any(axis=0)] = 0.0
    worst = int(np.argmax(share))
    if share[worst] > _DISAGREE:
        what = {"position": "speeds", "speed": "accelerations"}[words]
        raise FileError(
            f"{path}: the {what} of '{motion.joint_names[worst]}' are not those of its {words}s "
            f"(they differ by {100 * share[worst]:.0f} %). Give time in s, angles in rad and "
            f"speeds in rad/s, or leave the {what} out."
        )


def arranged(path: Path, motion: TimedMotion, joints: tuple[str, ...]) -> tuple[TimedMotion, str]:
    """`motion` with the columns of `joints`, in their order, and what should be said about it.

    Raises
    ------
    FileError
        A joint has no column.
    """
    names = motion.joint_names
    note = ""
    if motion.numbered and len(names) == len(joints):
        pairs = zip(sorted(names, key=int), joints, strict=True)
        led = dict(pairs)
        names = tuple(led[name] for name in names)
        order = ", ".join(f"{number} is {joint}" for number, joint in led.items())
        note = f"columns carry numbers, not names; taken in the robot's order: {order}"
    missing = [joint for joint in joints if joint not in names]
    if missing:
        there = ", ".join(names[:_LISTED]) + (", …" if len(names) > _LISTED else "")
        rest = f" (nor {', '.join(missing[1:])})" if len(missing) > 1 else ""
        raise FileError(
            f"{path} does not move joint '{missing[0]}'{rest}.{nearest(missing[0], names)} It "
            f"moves: {there}. Rename its columns, or leave the joint out of robot.joints."
        )
    others = [name for name in names if name not in joints]
    if others:
        note = f"joints that the robot does not move are left out: {', '.join(others[:_LISTED])}"
    columns = [names.index(joint) for joint in joints]
    v, a = (None if x is None else x[:, columns] for x in (motion.v, motion.a))
    q = motion.q[:, columns]
    return replace(motion, joint_names=joints, q=q, v=v, a=a, numbered=False), note
