"""Parquet: a table with a column per channel, named as in a CSV, or a dataset of LeRobot."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from excite_cli.errors import ExciteError, FileError, MissingExtraError
from excite_cli.measurement.arrange import listed
from excite_cli.measurement.csv_reader import run_of_table
from excite_cli.measurement.dataset import Array, Finding
from excite_cli.measurement.memory_limit import is_shortage, limited_memory, short_of_memory
from excite_cli.measurement.reader import (
    RawRun,
    Reader,
    ReadOptions,
    check_size,
    check_unpacked,
    check_values,
)
from excite_cli.measurement.text_table import NamedColumns

# LeRobot's datasets: their files, and their columns in our names.
#
# `data/chunk-000/` has a file per episode (`episode_000000.parquet`, 2.1) or of several
# (`file-000`, 3.0); `meta/info.json` names the entries of a column, as `elbow.pos`,
# `elbow.torque` or `elbow`.

STATE = "observation.state"
EPISODE = "episode_index"
_COUNTS = (EPISODE, "frame_index", "index", "task_index")
# Of the joints of the state; the other columns keep their names.
_FEATURES = {"velocity": "dq", "effort": "tau", "torque": "tau", "current": "current"}
_ENDINGS = {
    "pos": "q", "q": "q", "vel": "dq", "dq": "dq", "torque": "tau", "effort": "tau", "tau": "tau",
    "current": "current",
}  # fmt: skip
_MAX_INFO = 2**24  # bytes


def files_of(folder: Path) -> list[Path]:
    """Files of a dataset's folder, in the order of its episodes; none where it is no dataset."""
    is_dataset = (folder / "meta" / "info.json").is_file()
    return sorted(folder.glob("data/*/*.parquet")) if is_dataset else []


def in_our_names(path: Path, columns: Mapping[str, Array]) -> dict[str, Array]:
    """Columns (T,) as `t` [s], `q_<joint>`, `dq_<joint>`, `tau_<joint>`, and what else there is."""
    features = _features(path)
    found: dict[str, Array] = {}
    for feature, values in columns.items():
        if feature == "timestamp" and values.ndim == 1:
            found["t"] = values
        elif feature not in _COUNTS and not feature.startswith("next."):
            matrix = values.reshape(len(values), -1)
            names = _entries(features, feature, matrix.shape[1])
            for name, column in zip(names, matrix.T, strict=True):
                found[name if name not in found else f"{feature}.{name}"] = column
    return found


def _entries(features: Mapping[str, Any], feature: str, width: int) -> Iterator[str]:
    """What the entries of a column are called; they carry numbers where nothing names them."""
    short = feature.removeprefix("observation.")
    sources = (feature, STATE) if short in _FEATURES else (feature,)
    named = (_listed(features.get(source)) for source in sources)
    numbers = [str(k + 1) for k in range(width)]
    for entry in next((names for names in named if len({*names}) == len(names) == width), numbers):
        joint, _, ending = entry.rpartition(".")
        if not joint or ending not in _ENDINGS:
            joint, ending = entry, "pos"
        channel = _ENDINGS[ending] if feature == STATE else _FEATURES.get(short, short)
        yield f"{channel}_{joint}"


def _listed(feature: Any) -> list[str]:
    """Names of a feature: a list, one in a list, `{"motors": […]}`, or `{name: its number}`."""
    names = feature.get("names") if isinstance(feature, dict) else None
    if isinstance(names, dict) and all(isinstance(each, int) for each in names.values()):
        names = sorted(names, key=names.__getitem__)
    elif isinstance(names, dict):
        names = list(names.values())
    while isinstance(names, list) and len(names) == 1 and isinstance(names[0], list):
        names = names[0]
    good = isinstance(names, list) and all(isinstance(each, str) for each in names)
    return names if isinstance(names, list) and good else []


def _features(path: Path) -> Mapping[str, Any]:
    """What `meta/info.json` says of the columns; nothing where it is not beside `data`."""
    beside = (folder / "meta" / "info.json" for folder in path.absolute().parents[:3])
    info = next((each for each in beside if each.is_file()), None)
    if info is None:
        return {}
    try:
        if info.stat().st_size > _MAX_INFO:
            raise ValueError(f"more than {_MAX_INFO // 2**20} MiB")
        return dict(json.loads(info.read_text(encoding="utf-8"))["features"])
    except (OSError, ValueError, TypeError, KeyError, RecursionError) as error:
        raise FileError(
            f"{info} does not describe LeRobot's columns ({error!s:.200}). Restore it; without it "
            "columns carry numbers, which stand for the moved joints in their order."
        ) from error


# Tables of parquet: columns of numbers, and lists of numbers of one length, which are matrices.


@dataclass(frozen=True)
class ParquetTable:
    """Columns (T,) or (T, n), NaN where a value was missing; `skipped`: names of all others."""

    columns: dict[str, Array]
    skipped: tuple[str, ...]


def read_parquet(path: Path) -> ParquetTable:
    """Read all numbers of a parquet file; dates are seconds since 1970.

    Raises
    ------
    FileError
        It is damaged, too large, has no rows, or a column twice.
    MissingExtraError
        The library for parquet is not installed.
    """
    parquet = _library()
    check_size(path)
    try:
        with limited_memory(path), parquet.ParquetFile(path) as file:
            return _read(path, file)
    except ExciteError:
        raise
    # Damaged bytes lead the library to whatever error: of its own, of memory, of encodings.
    except Exception as error:
        if is_shortage(error):
            raise short_of_memory(path) from error
        raise FileError(
            f"{path} is not a readable parquet file ({error!s:.300}). If it was being written when "
            "the program ended, it is lost."
        ) from error


def _library() -> Any:
    try:
        import pyarrow.parquet
    except ImportError as error:
        raise MissingExtraError(
            "Reading parquet needs the library pyarrow: pip install 'excite-cli[parquet]'"
        ) from error
    # Its allocator reserves a gibibyte of addresses when it is first used, and `limited_memory`,
    # within which that fails, counts addresses.
    pyarrow.allocate_buffer(2**20)
    return pyarrow.parquet


def _read(path: Path, file: Any) -> ParquetTable:
    names = [field.name for field in file.schema_arrow]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise FileError(f"{path}: column '{twice}' is there twice. Give each its own name.")
    kinds = {field.name: field.type for field in file.schema_arrow if _is_read(field.type)}
    # Not the parts' own metadata: where they are damaged, looking at them ends the process.
    count = file.metadata.num_rows * sum(getattr(k, "list_size", 1) for k in kinds.values())
    check_values(path, count)
    check_unpacked(path, 8 * count)
    with limited_memory(path, 8 * count):
        # Several threads would each reserve addresses, which the limit counts.
        table = file.read(columns=[*kinds], use_threads=False)
        found = {name: _numbers(table.column(name).combine_chunks()) for name in kinds}
    columns = {name: values for name, values in found.items() if values is not None}
    if not columns or not table.num_rows:
        raise FileError(f"{path} has no rows of numbers; its columns: {listed(names)}.")
    return ParquetTable(columns, tuple(name for name in names if name not in columns))


def _is_read(kind: Any) -> bool:
    from pyarrow import types

    if types.is_list(kind) or types.is_large_list(kind) or types.is_fixed_size_list(kind):
        return types.is_integer(kind.value_type) or types.is_floating(kind.value_type)
    number = types.is_integer(kind) or types.is_floating(kind) or types.is_boolean(kind)
    return number or types.is_timestamp(kind)


def _numbers(values: Any) -> Array | None:
    """The column as (T,) or (T, n) doubles; None of lists that are missing or differ in length."""
    from pyarrow import compute, types

    if not types.is_nested(values.type):
        return _doubles(values)
    lengths = compute.unique(compute.list_value_length(values)).to_pylist()
    if len(lengths) != 1 or not lengths[0] or values.null_count:
        return None
    return _doubles(values.flatten()).reshape(len(values), -1)


def _doubles(values: Any) -> Array:
    import pyarrow

    factor = 1.0
    if pyarrow.types.is_timestamp(values.type):
        values = values.cast(pyarrow.timestamp("us"), safe=False).cast(pyarrow.int64())
        factor = 1e-6
    doubles = values.cast(pyarrow.float64(), safe=False).to_numpy(zero_copy_only=False)
    return factor * np.asarray(doubles, float)


_MOST_EPISODES = 1000


class ParquetReader(Reader):
    """Tables of one run, and LeRobot's files and folders, of which every episode is a run."""

    title = "parquet (also LeRobot folders)"
    suffixes = (".parquet",)

    def recognises(self, path: Path) -> bool:
        """Files by their suffix; folders that hold a dataset of LeRobot."""
        return bool(files_of(path)) if path.is_dir() else super().recognises(path)

    def read(self, path: Path, wanted: ReadOptions) -> list[RawRun]:
        """The runs, in the order of the files."""
        runs: list[RawRun] = []
        count = 0
        for file in files_of(path) if path.is_dir() else [path]:
            table = read_parquet(file)
            count += sum(values.size for values in table.columns.values())
            check_values(path, count)
            for run in _runs(file, table, wanted):
                runs.append(run)
                if len(runs) > _MOST_EPISODES:
                    raise FileError(
                        f"{path} holds more than {_MOST_EPISODES:,} episodes. Give some of its "
                        "files (data/chunk-…/….parquet), or fewer episodes."
                    )
        return runs


def _runs(path: Path, table: ParquetTable, wanted: ReadOptions) -> Iterator[RawRun]:
    text = f"not numbers per sample, left out: {listed(table.skipped)}"
    findings = (Finding("left_out", "note", text),) if table.skipped else ()
    if STATE not in table.columns:
        yield run_of_table(path, NamedColumns(dict(_flat(table.columns)), findings), wanted)
        return
    columns = in_our_names(path, table.columns)
    episodes = table.columns.get(EPISODE, np.zeros(len(next(iter(columns.values())))))
    if episodes.ndim > 1 or not np.isfinite(episodes).all():
        raise FileError(f"{path}: '{EPISODE}' must be a number in every row.")
    for number in np.unique(episodes):
        rows = episodes == number
        own = {name: values[rows] for name, values in columns.items()}
        run = run_of_table(path, NamedColumns(own, findings), wanted)
        if any(not run.columns.get(channel) for channel in wanted.needed):
            raise FileError(
                f"{path} is of LeRobot and has no torques; it has: {listed([*columns])}. Torques "
                "are entries <joint>.torque or <joint>.effort of observation.state, or all of "
                "observation.effort or observation.torque; currents: measurement.channels: "
                "{tau: current}. Record them with the positions."
            )
        name = f"episode_{int(number):06d}"
        yield replace(run, name=name, place=f"{EPISODE} {number:.0f}", seconds=True)


def _flat(columns: dict[str, Array]) -> Iterator[tuple[str, Array]]:
    """A column for each entry of a list, with its number."""
    for name, values in columns.items():
        if values.ndim == 1:
            yield name, values
        else:
            yield from ((f"{name}_{k + 1}", column) for k, column in enumerate(values.T))
