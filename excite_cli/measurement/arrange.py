"""From a file's columns to the robot's joints: matched by name, never by position alone."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from excite_cli.errors import ConfigError, FileError, nearest
from excite_cli.measurement.dataset import Array, Finding, Run
from excite_cli.measurement.reader import CHANNELS, RawRun


class OtherJointsError(FileError):
    """A file has positions of joints, and of none that the robot moves."""


_LISTED, _LONGEST = 40, 60  # names that are reported; characters of each
_CHANNEL_WORDS = {
    "q": "position", "tau": "torque", "dq": "speed", "q_cmd": "position set point",
    "voltage": "voltage", "duty": "duty cycle",
}  # fmt: skip


def check_names(names: Mapping[str, str], joints: Sequence[str], key: str = "names") -> None:
    """Raise ConfigError where a `key` of `measurement` leads to no joint, or twice to one."""
    for column, joint in names.items():
        if joint not in joints:
            raise ConfigError(
                f"measurement.{key}: '{column}' is mapped to '{joint}', which the robot does not "
                f"move.{nearest(joint, joints)} Moved joints: {', '.join(joints)}."
            )
    twice = sorted(joint for joint, count in Counter(names.values()).items() if count > 1)
    if twice:
        raise ConfigError(f"measurement.{key} maps two columns to '{twice[0]}'; each joint once.")


def arrange(
    raw: RawRun,
    joints: tuple[str, ...],
    names: Mapping[str, str],
    source: str,
    without_torque: Sequence[str] = (),
    torque_names: Mapping[str, str] = MappingProxyType({}),
    beside: Sequence[str] = ("tau",),
) -> tuple[Run, list[Finding]]:
    """The run with columns in the order of `joints`; what belongs to no moved joint is `extra`.

    No torque of joints `without_torque` is valid: it is 0, whether it was recorded or not.
    `torque_names` go before `names` where torques are concerned. Channels `beside` the positions
    are needed of all joints; without torques among them, these are 0.

    Raises
    ------
    FileError
        A joint of the robot is missing in a channel that is needed, or numbered columns are not
        as many as joints.
    """
    findings = [replace(found, run=raw.name) for found in raw.findings]
    positions = list(raw.columns["q"])
    matched = any(names.get(name, name) in joints for name in positions)
    if raw.numbered and not matched:
        names = _numbered(positions, joints, source)
        order = ", ".join(f"{number} is {joint}" for number, joint in names.items())
        text = f"columns carry numbers, not names; taken in the robot's order: {order}"
        findings.append(Finding("numbered", "note", text, raw.name))
    extra: dict[str, Array] = dict(raw.others)
    matrices: dict[str, Array] = {}
    for channel, columns in raw.columns.items():
        own = {**names, **torque_names} if channel == "tau" else names
        by_joint = {own.get(column, column): values for column, values in columns.items()}
        if channel in ("tau", *beside):
            by_joint |= {joint: np.zeros(len(raw.t)) for joint in without_torque}
        missing = [joint for joint in joints if joint not in by_joint]
        if not missing:
            matrices[channel] = np.column_stack([by_joint[joint] for joint in joints])
        elif channel in ("q", *beside):
            other = channel == "q" and bool(columns) and len(missing) == len(joints)
            kind = OtherJointsError if other else FileError
            raise kind(_missing(source, raw.name, channel, missing, list(columns)))
        elif channel == "dq":
            text = f"speed of {', '.join(missing)} is missing; recorded speeds are not used"
            findings.append(Finding("no_speed", "note", text, raw.name, tuple(missing)))
        left = [j for j in by_joint if j not in joints or missing]
        extra.update({f"{channel}_{joint}": by_joint[joint] for joint in left})
    lacking = [channel for channel in beside if channel not in matrices]
    if lacking and not set(without_torque) >= set(joints):
        raise FileError(_missing(source, raw.name, lacking[0], list(joints), []))
    for channel in ("tau", *lacking):
        matrices.setdefault(channel, np.zeros((len(raw.t), len(joints))))
    others = sorted({names.get(column, column) for column in positions} - set(joints))
    if others:
        text = f"joints that the robot does not move, kept as further channels: {listed(others)}"
        findings.append(Finding("other_joints", "note", text, raw.name))
    valid = matrices.pop("valid", None)
    if without_torque:
        known = np.array([joint not in without_torque for joint in joints])
        valid = known * (np.ones_like(matrices["tau"]) if valid is None else valid)
    kept = {name: matrix for name, matrix in matrices.items() if name not in CHANNELS}
    run = Run(
        name=raw.name,
        t=np.asarray(raw.t, dtype=float),
        q=matrices["q"],
        tau=matrices["tau"],
        dq=matrices.get("dq"),
        valid=None if valid is None else valid > 0.5,
        extra={**kept, **extra},
    )
    return run, findings


def _numbered(columns: list[str], joints: tuple[str, ...], source: str) -> dict[str, str]:
    numbers = sorted(int(column) for column in columns)
    first = numbers[0]
    if first not in (0, 1) or numbers != list(range(first, first + len(joints))):
        raise FileError(
            f"{source}: its columns are numbered {listed([str(x) for x in numbers])}, and the "
            f"robot moves {len(joints)} joints ({', '.join(joints)}). Numbers 1 to {len(joints)} "
            "are taken in this order; else name the columns by joint, or say which is which: "
            f"measurement.names: {{'{numbers[0]}': {joints[0]}, …}}."
        )
    return {str(number): joint for number, joint in zip(numbers, joints, strict=True)}


def listed(names: Sequence[str]) -> str:
    """Names of a file for a message: the first of them, and what a person reads of each."""
    told = [name if len(name) <= _LONGEST else f"{name[:_LONGEST]}…" for name in names[:_LISTED]]
    return ", ".join([*told, *(["…"] if len(names) > _LISTED else [])]) or "none"


def _missing(source: str, run: str, channel: str, missing: list[str], columns: list[str]) -> str:
    joint = missing[0]
    where = f"{source}, run {run}" if run else source
    rest = f" (nor of {', '.join(missing[1:])})" if len(missing) > 1 else ""
    moves = f", or, if it moved, measurement.without_torque: [{', '.join(missing)}]"
    if not columns:
        return (
            f"{where}: there is no {_CHANNEL_WORDS.get(channel, channel)} of any joint: no columns "
            f"'{channel}_<joint>'. A channel of another name: measurement.channels: "
            f"{{{channel}: …}}; where torques come from: measurement.torque."
        )
    return (
        f"{where}: there is no {_CHANNEL_WORDS.get(channel, channel)} of joint '{joint}'{rest}."
        f"{nearest(joint, columns, 0.5)} The file names: {listed(columns)}. Say "
        f"which is which: measurement.names: {{<name in the file>: {joint}}}, or leave the joint "
        f"out of robot.joints{moves if channel != 'q' else ''}."
    )
