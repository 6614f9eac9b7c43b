"""Motions as CSV: `t, q_<joint>, …[, dq_<joint>, …[, ddq_<joint>, …]]`, a row per instant."""

import csv
import re
from pathlib import Path

import numpy as np

from excite_cli.errors import FileError
from excite_cli.measurement.csv_reader import CsvReader
from excite_cli.measurement.dataset import Array
from excite_cli.measurement.text_table import header_of, read_table
from excite_cli.motion_formats.base import MotionFormat
from excite_cli.motion_formats.timed_motion import TimedMotion

CHANNELS = ("q", "dq", "ddq")
_COLUMN = re.compile(r"(ddq|dq|q)(?:_?\[?(?P<number>\d+)\]?|_(?P<name>.+))$")


class CsvTable(MotionFormat):
    """Text tables, as spreadsheets have them."""

    name, title = "csv", "CSV"
    suffixes = CsvReader.suffixes

    def recognises(self, path: Path, measured: tuple[str, ...] = ("tau",)) -> bool:
        """Tables without columns that only measured data have."""
        return super().recognises(path) and not any(
            column.startswith(measured) for column in header_of(path)
        )

    def read(self, path: Path) -> TimedMotion:
        """Columns are matched by name; what is none of t, q, dq and ddq is passed over."""
        columns = read_table(path).columns
        found: dict[str, dict[str, Array]] = {channel: {} for channel in CHANNELS}
        numbered = True
        for column, values in columns.items():
            if match := _COLUMN.match(column):
                number, name = match["number"], match["name"]
                numbered = numbered and number is not None
                found[match[1]][number or name] = values
        if "t" not in columns or not found["q"]:
            raise FileError(
                f"{path} has no column '{'q_<joint>' if 't' in columns else 't'}'; its columns: "
                f"{', '.join(list(columns)[:30])}. A motion has t, q_<joint>, … and, where they "
                "are known, dq_<joint>, … and ddq_<joint>, …, in s and rad."
            )
        joints = tuple(found["q"])
        matrices = [_matrix(path, channel, found[channel], joints) for channel in CHANNELS]
        q, v, a = matrices
        assert q is not None
        return TimedMotion(path.name.split(".")[0], joints, columns["t"], q, v, a, numbered)

    def fill(self, path: Path, motion: TimedMotion) -> None:
        """All digits of every number, so that it is read to the same ones."""
        names = [f"{channel}_{joint}" for channel in CHANNELS for joint in motion.joint_names]
        rows = np.column_stack([motion.t, *motion.states]).tolist()
        with path.open("w", encoding="utf-8", newline="\n") as file:
            csv.writer(file, lineterminator="\n").writerow(["t", *names])
            file.writelines(",".join(map(repr, row)) + "\n" for row in rows)


def _matrix(
    path: Path, channel: str, columns: dict[str, Array], joints: tuple[str, ...]
) -> Array | None:
    if not columns:
        return None
    missing = [joint for joint in joints if joint not in columns]
    if missing:
        raise FileError(
            f"{path} has {channel} of {', '.join(columns)}, but not of {', '.join(missing)}. Give "
            f"{channel} of every joint or of none."
        )
    return np.column_stack([columns[joint] for joint in joints])
