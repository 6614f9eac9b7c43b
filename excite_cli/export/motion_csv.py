"""CSV: `t, q_<joint>, …, dq_<joint>, …, ddq_<joint>, …`, all digits of every number."""

import csv
from pathlib import Path

import numpy as np

from excite_cli.export.motion_exporter import MotionExporter, states_of
from excite_cli.measurement.motion_csv import CHANNELS
from excite_cli.measurement.timed_motion import TimedMotion


class CsvExporter(MotionExporter):
    """Text that spreadsheets, and this program, read to the same numbers."""

    name, suffix = "csv", ".csv"

    def _write(self, path: Path, motion: TimedMotion) -> None:
        names = [f"{channel}_{joint}" for channel in CHANNELS for joint in motion.joint_names]
        rows = np.column_stack([motion.t, *states_of(motion)]).tolist()
        with path.open("w", encoding="utf-8", newline="\n") as file:
            csv.writer(file, lineterminator="\n").writerow(["t", *names])
            file.writelines(",".join(map(repr, row)) + "\n" for row in rows)
