"""CSV: a header `t, q_<joint>, …, tau_<joint>, …[, dq_<joint>, …]` and a row per instant."""

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from excite_cli.errors import FileError, nearest
from excite_cli.measurement.arrange import listed
from excite_cli.measurement.dataset import Array, Finding
from excite_cli.measurement.reader import (
    CHANNELS,
    FIELDS,
    SENT,
    RawRun,
    Reader,
    ReadOptions,
    times_from_rate,
)
from excite_cli.measurement.text_table import NamedColumns, read_table

# Columns as other programs name them, in our names: `t`, `q_<joint>`, `dq_<joint>`, `tau_<joint>`.
#
# - `rostopic echo -p`: `%time, field.header.stamp, field.name0, …, field.position0, …`, in ns; the
#   names of the joints stand in every row.
# - PlotJuggler: `__time, /joint_states/elbow/position, …`, in s; or `/joint_states/position[0]`.
# - libfranka's `logToCSV`: `time, success_rate, state.q[0], …, state.tau_J[0], …`, in ms.
# - Units in headers, as `q_elbow [deg]` or `t (ms)`: values are converted to s, rad, m and N·m.

_FIELDS = {"position": "q", "velocity": "dq", "effort": "tau"}
_ECHOED = re.compile(r"field\.(position|velocity|effort)(\d+)$")
_PLOTTED = re.compile(r"/?(?:.*/)?([^/]+)/(position|velocity|effort)$")
_PLOTTED_NUMBER = re.compile(r"/?.*/(position|velocity|effort)\[(\d+)\]$")
_LOGGED = re.compile(r"state\.(q|dq|tau_J)\[(\d+)\]$")
_UNIT = re.compile(r"^(.*\S)\s*[\[(]\s*([^\[\]()]*[^\[\]()\d\s][^\[\]()]*)\s*[\])]$")
# In s, rad, rad/s, m, m/s, N·m and N; those that say nothing of a unit of ours are left alone.
_UNITS = {
    "s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0,
    "rad": 1.0, "deg": np.pi / 180, "°": np.pi / 180, "m": 1.0, "cm": 1e-2, "mm": 1e-3,
    "rad/s": 1.0, "deg/s": np.pi / 180, "°/s": np.pi / 180, "rpm": np.pi / 30, "m/s": 1.0,
    "mm/s": 1e-3, "nm": 1.0, "n·m": 1.0, "n*m": 1.0, "mnm": 1e-3, "mn·m": 1e-3, "ncm": 1e-2,
    "n": 1.0, "kn": 1e3, "knm": 1e3,
}  # fmt: skip


def in_our_names(
    columns: Mapping[str, Array], words: Mapping[str, str]
) -> tuple[dict[str, Array], list[Finding]]:
    """Columns (T,) by our names, and what was converted; `words`: columns that hold one word."""
    found = _echoed(columns, words) or _plotted(columns) or _logged(columns) or dict(columns)
    return _converted(found)


def _echoed(columns: Mapping[str, Array], words: Mapping[str, str]) -> dict[str, Array]:
    """Those of `rostopic echo -p`; none where it is not its table."""
    if "%time" not in columns:
        return {}
    stamp = columns.get("field.header.stamp")
    sound = stamp is not None and bool((np.diff(stamp) > 0.0).any())
    found = {"t": (stamp if sound and stamp is not None else columns["%time"]) * 1e-9}
    for name, values in columns.items():
        if match := _ECHOED.match(name):
            joint = words.get(f"field.name{match[2]}", match[2])
            found[f"{_FIELDS[match[1]]}_{joint}"] = values
    return found


def _plotted(columns: Mapping[str, Array]) -> dict[str, Array]:
    """Those of PlotJuggler; none where it is not its table."""
    if "__time" not in columns:
        return {}
    found = {"t": columns["__time"]}
    for name, values in columns.items():
        if match := _PLOTTED.match(name):
            found[f"{_FIELDS[match[2]]}_{match[1]}"] = values
        elif match := _PLOTTED_NUMBER.match(name):
            found[f"{_FIELDS[match[1]]}_{match[2]}"] = values
        elif name != "__time":
            found[name] = values
    return found


def _logged(columns: Mapping[str, Array]) -> dict[str, Array]:
    """Those of libfranka's `logToCSV`; none where it is not its table."""
    if not {"time", "state.q[0]"} <= columns.keys():
        return {}
    found = {"t [ms]" if name == "time" else name: values for name, values in columns.items()}
    return {_LOGGED.sub(r"\1_\2", name): values for name, values in found.items()}


def _converted(columns: Mapping[str, Array]) -> tuple[dict[str, Array], list[Finding]]:
    """Without units in names, their values converted."""
    found: dict[str, Array] = {}
    told = []
    for name, values in columns.items():
        match = _UNIT.match(name)
        factor = _UNITS.get(match[2].lower()) if match else None
        if match is None or factor is None or match[1] in columns:
            found[name] = values
            continue
        found[match[1]] = values if factor == 1.0 else factor * values
        if factor != 1.0:
            told.append(f"{match[1]} from {match[2]}")
    if not told:
        return found, []
    shown = ", ".join(told[:3]) + (f" and {len(told) - 3} more" if len(told) > 3 else "")
    text = f"units stand in the header: {shown} were converted to s, rad, m and N·m"
    return found, [Finding("header_units", "note", text)]


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


def run_of_table(path: Path, table: NamedColumns, wanted: ReadOptions) -> RawRun:
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
    of_joints = any((w := wanted.called(c)) and _joints(columns, w) for c in (*CHANNELS, *SENT))
    if not of_joints and not apart:
        raise FileError(
            f"{path} has no columns '{wanted.called('q') or 'q'}_<joint>'; its columns: {words}. A "
            "file holds one run: t, q_<joint>, …, tau_<joint>, … (and dq_<joint>), or some of "
            "these channels, which are joined with those of the other files. A channel of another "
            "name: measurement.channels: {q: …}."
        )
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
    """With the names of `JointState`, or of libfranka, for channels of which nothing is there.

    Of joints of the robot, or numbered: a gripper's position is none.
    """
    robot = {*wanted.joints, *wanted.names}
    found: dict[str, str | None] = {}

    def is_there(word: str) -> bool:
        return any(j in robot or j.isdigit() for j in _joints(columns, word).values())

    for channel, field in (*FIELDS.items(), ("tau", "tau_J")):
        if not (channel in wanted.channels or is_there(channel)) and is_there(field):
            found[channel] = field
    return replace(wanted, channels={**found, **wanted.channels}) if found else wanted


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
    called = {name: wanted.called(name) for name in (*CHANNELS, *SENT)}
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
