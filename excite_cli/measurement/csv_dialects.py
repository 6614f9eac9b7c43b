"""Columns as other programs name them, in our names: `t`, `q_<joint>`, `dq_<joint>`, `tau_<joint>`.

- `rostopic echo -p`: `%time, field.header.stamp, field.name0, …, field.position0, …`, in ns; the
  names of the joints stand in every row.
- PlotJuggler: `__time, /joint_states/elbow/position, …`, in s; or `/joint_states/position[0]`.
- Units in headers, as `q_elbow [deg]` or `t (ms)`: values are converted to s, rad, m and N·m.
"""

import re
from collections.abc import Mapping

import numpy as np

from excite_cli.measurement.dataset import Array, Finding

_FIELDS = {"position": "q", "velocity": "dq", "effort": "tau"}
_ECHOED = re.compile(r"field\.(position|velocity|effort)(\d+)$")
_PLOTTED = re.compile(r"/?(?:.*/)?([^/]+)/(position|velocity|effort)$")
_PLOTTED_NUMBER = re.compile(r"/?.*/(position|velocity|effort)\[(\d+)\]$")
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
    found = _echoed(columns, words) or _plotted(columns) or dict(columns)
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
