"""CSV: a header `t, q_<joint>, …, tau_<joint>, …[, dq_<joint>, …]` and a row per instant."""

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from excite_cli.errors import FileError, nearest
from excite_cli.measurement.arrange import listed
from excite_cli.measurement.csv_dialects import in_our_names
from excite_cli.measurement.csv_table import Table, read_table
from excite_cli.measurement.dataset import Array
from excite_cli.measurement.reader import (
    CHANNELS,
    FIELDS,
    RawRun,
    Reader,
    ReadOptions,
    times_from_rate,
)

_NUMBERED = re.compile(r"_?\[?(\d+)\]?$")


class CsvReader(Reader):
    """Text tables, packed or not."""

    title = "CSV"
    suffixes = (".csv", ".csv.gz", ".tsv", ".tsv.gz", ".txt", ".txt.gz")

    def read(self, path: Path, wanted: ReadOptions) -> list[RawRun]:
        """The file's only run; columns are matched by name.

        Where positions or torques are not in it, it is a part of a run (`joined_files`).
        """
        return [run_of_table(path, read_table(path), wanted)]


def run_of_table(path: Path, table: Table, wanted: ReadOptions) -> RawRun:
    """The run in a table whose columns `<channel>_<joint>` are matched by name.

    Raises
    ------
    FileError
        No column belongs to a channel, or there are no time stamps.
    """
    columns = {_bare(name): values for name, values in table.columns.items()}
    columns, noticed = in_our_names(columns, table.words)
    words, samples = listed(list(columns)), len(next(iter(columns.values())))
    apart = {name: columns.pop(name) for name in [*columns] if wanted.is_apart(name)}
    wanted = _by_fields(columns, wanted)
    of_joints = any((w := wanted.called(c)) and _joints(columns, w) for c in CHANNELS)
    if not of_joints and not apart:
        raise FileError(_no_columns(path, "q", wanted, words))
    time = wanted.called("t")
    stamped = time is not None and time in columns
    if stamped:
        t = columns.pop(str(time))
    else:
        if wanted.rate is None:
            words += nearest(time or "t", columns)
        t = times_from_rate(path, samples, wanted, words)
    channels, others = _by_channel(columns, wanted)
    numbered = all(name.isdigit() for name in channels["q"])
    others |= apart
    findings = (*table.findings, *noticed)
    return RawRun("", t, channels, others, numbered, not stamped, findings)


def _by_fields(columns: Mapping[str, Array], wanted: ReadOptions) -> ReadOptions:
    """With the names of `JointState` for channels of which nothing is said and nothing is there.

    Of joints of the robot, or numbered: a gripper's position is none.
    """
    robot = {*wanted.joints, *wanted.names}
    found: dict[str, str | None] = {}
    for channel, field in FIELDS.items():
        if channel in wanted.channels or _joints(columns, channel):
            continue
        joints = _joints(columns, field).values()
        if any(joint in robot or joint.isdigit() for joint in joints):
            found[channel] = field
    return replace(wanted, channels={**found, **wanted.channels}) if found else wanted


def _no_columns(path: Path, channel: str, wanted: ReadOptions, words: str) -> str:
    called = wanted.called(channel) or channel
    return (
        f"{path} has no columns '{called}_<joint>'; its columns: {words}. A file holds one run: "
        "t, q_<joint>, …, tau_<joint>, … (and dq_<joint>), or some of these channels, which are "
        "joined with those of the other files. A channel of another name: measurement.channels: "
        f"{{{channel}: …}}."
    )


def _joint_of(column: str, channel: str) -> str:
    """The joint in `<channel>_<joint>`, `<channel>3` or `<channel>[3]`; else ''."""
    if not column.startswith(channel):
        return ""
    rest = column[len(channel) :]
    if match := _NUMBERED.match(rest):
        return str(int(match.group(1)))
    return rest[1:] if rest.startswith("_") else ""


def _joints(columns: Mapping[str, Array], channel: str) -> dict[str, str]:
    """Columns of a channel, and their joints: `<channel>_<joint>`, else `<joint>_<channel>`."""
    found = {name: joint for name in columns if (joint := _joint_of(name, channel))}
    if found:
        return found
    end = f"_{channel}"
    return {name: name.removesuffix(end) for name in columns if name.endswith(end) and name != end}


def _bare(name: str) -> str:
    """A column's name without the dash that lists have before it."""
    return name.removeprefix("-").strip() or name


def _by_channel(
    columns: Mapping[str, Array], wanted: ReadOptions
) -> tuple[dict[str, dict[str, Array]], dict[str, Array]]:
    """Columns sorted into channel -> joint; what ends in no joint's name stands apart."""
    channels: dict[str, dict[str, Array]] = {"q": {}}
    others: dict[str, Array] = {}
    called = {name: wanted.called(name) for name in CHANNELS}
    # Longer names first, so that `tau_q_…` or `dq_…` are not taken for another channel.
    ranked = sorted(called.items(), key=lambda c: -len(c[1] or ""))
    places: dict[str, tuple[str, str]] = {}
    for channel, word in ranked:
        for name, joint in (_joints(columns, word) if word else {}).items():
            places.setdefault(name, (channel, joint))
    longest_first = sorted((joint for c, joint in places.values() if c == "q"), key=len)[::-1]
    for name, values in columns.items():
        if name in places:
            channel, joint = places[name]
            channels.setdefault(channel, {})[joint] = values
            continue
        end = next((j for j in longest_first if name.endswith(f"_{j}")), "")
        if end:
            channel = wanted.channel(name[: -len(end) - 1])
            channels.setdefault(channel, {})[end] = values
        else:
            others[wanted.channel(name)] = values
    return channels, others
