"""HDF5: flat `{t, q, tau[, dq]}` or `/runs/<name>/{…}`, attribute `joint_names` for the columns.

A foreign file is not trusted: only numbers in the file itself are read, no links, no data kept in
other files, no shapes beyond a limit, and no deeper than `/runs/<name>/<part>`.
"""

from pathlib import Path
from typing import Any

import h5py
import numpy as np

from excite_cli.errors import FileError
from excite_cli.measurement.arrange import listed
from excite_cli.measurement.dataset import Array, Finding
from excite_cli.measurement.foreign_hdf5 import attribute, member, opened
from excite_cli.measurement.memory_limit import limited_memory
from excite_cli.measurement.reader import (
    RawRun,
    Reader,
    ReadOptions,
    check_unpacked,
    check_values,
    times_from_rate,
)

_MOST_RUNS = 1000
_DEPTH = 2  # groups below /runs: a run, and the parts it was split into
_EXAMPLE = "h5py.File(path, 'a').attrs['joint_names'] = ['joint_1', …]"


class Hdf5Reader(Reader):
    """Flat files and files of several runs."""

    title = "HDF5"
    suffixes = (".h5", ".hdf5", ".hdf")

    def read(self, path: Path, wanted: ReadOptions) -> list[RawRun]:
        """All runs, in the file's order; columns carry the names of `joint_names`."""
        with opened(path) as file:
            return _runs(path, file, wanted)


def _runs(path: Path, file: Any, wanted: ReadOptions) -> list[RawRun]:
    if "runs" in file:
        group = member(path, file, "runs")
        if not isinstance(group, h5py.Group):
            raise FileError(f"{path}: 'runs' is not a group; runs lie in /runs/<name>/.")
        found = _groups(path, group, wanted, "", _DEPTH)
        if len(found) > _MOST_RUNS:
            raise FileError(
                f"{path} holds {len(found):,} runs; up to {_MOST_RUNS:,} are read. Join them, or "
                "give several files."
            )
        if not found:
            raise FileError(f"{path}: /runs has no group with {_needed(wanted)}.")
        return _all(path, file, found, wanted)
    kind = str(attribute(file, "kind", attribute(file, "content", "")))
    if kind in ("fit", "diagnosis"):
        raise FileError(
            f"{path} holds a {kind}, not measured data. Give the recordings that it was made from."
        )
    if "motions" in file and "q" not in file:
        raise FileError(
            f"{path} holds planned motions, not measured data. Play them on the robot, or with "
            "`excite simulate`."
        )
    return _all(path, file, [("", file)], wanted)


def _all(path: Path, file: Any, found: list[tuple[str, Any]], wanted: ReadOptions) -> list[RawRun]:
    count = sum(_count(group) for _, group in found)
    check_values(path, count)
    check_unpacked(path, 8 * count)
    with limited_memory(path, 8 * count):
        return [_run(path, file, group, name, wanted) for name, group in found]


def _needed(wanted: ReadOptions) -> str:
    return ", ".join(wanted.called(name) or name for name in ("t", *wanted.needed))


def _groups(
    path: Path, group: Any, wanted: ReadOptions, prefix: str, depth: int
) -> list[tuple[str, Any]]:
    """Groups that hold positions, with their names: `run`, or `run/1`."""
    found: list[tuple[str, Any]] = []
    for name in group:
        lower = member(path, group, name)
        if not isinstance(lower, h5py.Group):
            continue
        inner = f"{prefix}{name}"
        if (wanted.called("q") or "q") in lower or depth == 1:
            found.append((inner, lower))
        else:
            found += _groups(path, lower, wanted, f"{inner}/", depth - 1) or [(inner, lower)]
    return found


def _datasets(group: Any) -> list[str]:
    hard = (name for name in group if isinstance(group.get(name, getlink=True), h5py.HardLink))
    return [name for name in hard if group.get(name, getclass=True) is h5py.Dataset]


def _count(group: Any) -> int:
    return sum(int(np.prod(group[name].shape or (0,), dtype=float)) for name in _datasets(group))


def _run(path: Path, file: Any, group: Any, name: str, wanted: ReadOptions) -> RawRun:
    where = f"{path}: {group.name}" if name else str(path)
    for channel in wanted.needed:
        called = wanted.called(channel) or channel
        if called not in group:
            raise FileError(
                f"{where} has no dataset '{called}'; it has: {listed(list(group))}. "
                f"Needed: {_needed(wanted)}; one of another name: measurement.channels: "
                f"{{{channel}: …}}."
            )
    for channel in ("t", "q", "dq", "tau"):
        if (wanted.called(channel) or "") in group:
            member(path, group, wanted.called(channel) or "")
    names = _joint_names(where, file, group)
    q = _values(path, group, wanted.called("q") or "q")
    samples = len(q)
    if q.shape[1:] != (len(names),) and (q.ndim == 2 or len(names) > 1):
        turned = q.shape[-1] if q.shape[:1] == (len(names),) else samples
        raise FileError(_wrong_shape(where, wanted.called("q") or "q", q.shape, len(names), turned))
    for channel in ("tau", "dq"):
        key = wanted.called(channel) or ""
        if key in group and group[key].shape[:1] != (samples,):
            raise FileError(_wrong_shape(where, key, group[key].shape, len(names), samples))
    arrays: dict[str, Array] = {}
    skipped = []
    for key in group:
        if isinstance(group.get(key, getlink=True), h5py.HardLink):
            if not isinstance(group[key], h5py.Dataset):
                continue
            if _fits(group[key], samples) and not (group[key].is_virtual or group[key].external):
                arrays[key] = _values(path, group, key)
                continue
        skipped.append(key)
    time = wanted.called("t")
    stamped = time is not None and time in arrays
    if stamped:
        t = arrays.pop(str(time)).reshape(samples, -1)[:, 0]
    else:
        t = times_from_rate(path, samples, wanted, listed(list(group)))
    columns, others = _by_channel(where, arrays, names, wanted)
    text = f"not numbers per sample, left out: {', '.join(skipped)}"
    findings = (Finding("left_out", "note", text),) if skipped else ()
    epoch = attribute(group, "epoch")  # as written beside simulated data
    known = isinstance(epoch, float) and np.isfinite(epoch)
    return RawRun(
        name, t, columns, others, False, not stamped, findings, group.name,
        float(epoch) if known else None,
    )  # fmt: skip


def _by_channel(
    where: str, arrays: dict[str, Array], names: tuple[str, ...], wanted: ReadOptions
) -> tuple[dict[str, dict[str, Array]], dict[str, Array]]:
    """Arrays with a column per joint as channel -> joint -> (T,); all others as they are."""
    columns: dict[str, dict[str, Array]] = {}
    others: dict[str, Array] = {}
    for key, array in arrays.items():
        channel = wanted.channel(key)
        matrix = array[:, None] if array.ndim == 1 and len(names) == 1 else array
        if wanted.is_apart(key):
            others[key] = array
        elif matrix.ndim == 2 and matrix.shape[1] == len(names):
            columns[channel] = dict(zip(names, matrix.T, strict=True))
        elif channel in ("q", "dq", "tau"):
            raise FileError(_wrong_shape(where, key, array.shape, len(names), len(array)))
        else:
            others[channel] = array
    return columns, others


def _wrong_shape(where: str, key: str, shape: Any, joints: int, samples: int) -> str:
    turned = " It looks transposed." if tuple(shape)[:1] == (joints,) else ""
    return (
        f"{where}: '{key}' has shape {tuple(shape)}; expected (samples, joints) = "
        f"({samples}, {joints}): one row per instant, one column per name in joint_names.{turned}"
    )


def _fits(dataset: Any, samples: int) -> bool:
    shape = dataset.shape
    number = dataset.dtype.kind in "fiub"
    return bool(shape) and shape[0] == samples and len(shape) <= 2 and number


def _values(path: Path, group: Any, name: str) -> Array:
    dataset = member(path, group, name)
    if not isinstance(dataset, h5py.Dataset) or dataset.dtype.kind not in "fiub":
        raise FileError(f"{path}: '{group.name.rstrip('/')}/{name}' does not hold numbers.")
    if dataset.ndim not in (1, 2) or not dataset.size:
        raise FileError(
            f"{path}: '{dataset.name}' has shape {dataset.shape}; expected (samples, joints)."
        )
    return np.asarray(dataset[()], dtype=float)


def _joint_names(where: str, file: Any, group: Any) -> tuple[str, ...]:
    """Names of the columns, from the run, from /runs or from the root."""
    for holder in (group, file.get("runs", file), file):
        found = attribute(holder, "joint_names")
        if found is not None:
            value = np.atleast_1d(np.asarray(found, dtype=object))
            names = [_text(item) for item in value.ravel()]
            if not names or not all(names) or len(set(names)) != len(names):
                raise FileError(
                    f"{where}: the attribute joint_names must list different names, as text, "
                    f"one per column; it holds {value.tolist()!r:.200}."
                )
            return tuple(names)
    raise FileError(
        f"{where} has no attribute 'joint_names'. Columns are matched by name, never by position "
        f"alone; add the names in the order of the columns: {_EXAMPLE}"
    )


def _text(item: Any) -> str:
    if isinstance(item, bytes):
        return item.decode("utf-8", "replace").strip()
    return item.strip() if isinstance(item, str) else ""
