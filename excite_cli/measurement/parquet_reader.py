"""Parquet: a table with a column per channel, named as in a CSV, or a dataset of LeRobot."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from excite_cli.errors import FileError
from excite_cli.measurement import lerobot
from excite_cli.measurement.arrange import listed
from excite_cli.measurement.csv_reader import run_of_table
from excite_cli.measurement.csv_table import Table
from excite_cli.measurement.dataset import Array, Finding
from excite_cli.measurement.parquet_table import ParquetTable, read_parquet
from excite_cli.measurement.reader import RawRun, Reader, ReadOptions, check_values

_MOST_EPISODES = 1000


class ParquetReader(Reader):
    """Tables of one run, and LeRobot's files and folders, of which every episode is a run."""

    title = "parquet, also a LeRobot dataset's folder"
    suffixes = (".parquet",)

    def recognises(self, path: Path) -> bool:
        """Files by their suffix; folders that hold a dataset of LeRobot."""
        return bool(lerobot.files_of(path)) if path.is_dir() else super().recognises(path)

    def read(self, path: Path, wanted: ReadOptions) -> list[RawRun]:
        """The runs, in the order of the files."""
        runs: list[RawRun] = []
        count = 0
        for file in lerobot.files_of(path) if path.is_dir() else [path]:
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
    if lerobot.STATE not in table.columns:
        yield run_of_table(path, Table(dict(_flat(table.columns)), findings), wanted)
        return
    columns = lerobot.in_our_names(path, table.columns)
    episodes = table.columns.get(lerobot.EPISODE, np.zeros(len(next(iter(columns.values())))))
    if episodes.ndim > 1 or not np.isfinite(episodes).all():
        raise FileError(f"{path}: '{lerobot.EPISODE}' must be a number in every row.")
    for number in np.unique(episodes):
        rows = episodes == number
        own = {name: values[rows] for name, values in columns.items()}
        run = run_of_table(path, Table(own, findings), wanted)
        if any(not run.columns.get(channel) for channel in wanted.needed):
            raise FileError(_no_torques(path, columns))
        name = f"episode_{int(number):06d}"
        yield replace(run, name=name, place=f"{lerobot.EPISODE} {number:.0f}", seconds=True)


def _flat(columns: dict[str, Array]) -> Iterator[tuple[str, Array]]:
    """A column for each entry of a list, with its number."""
    for name, values in columns.items():
        if values.ndim == 1:
            yield name, values
        else:
            yield from ((f"{name}_{k + 1}", column) for k, column in enumerate(values.T))


def _no_torques(path: Path, columns: dict[str, Array]) -> str:
    return (
        f"{path} is of LeRobot and has no torques; it has: {listed([*columns])}. Torques are "
        "entries <joint>.torque or <joint>.effort of observation.state, or all of "
        "observation.effort or observation.torque; currents: measurement.channels: {tau: current}. "
        "Record them with the positions."
    )
