"""Recordings made up for tests: three joints in a smooth motion, torque with noise."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.errors import FileError
from excite_cli.measurement.catalogue import read_dataset
from excite_cli.measurement.dataset import Dataset, Finding, Run
from excite_cli.measurement.quality import checked
from excite_cli.measurement.recording_limits import RecordingLimits

JOINTS = ("shoulder", "elbow", "wrist")
BOUNDS = (np.full(3, -3.0), np.full(3, 3.0), np.full(3, 4.0), np.full(3, 50.0))
LIMITS = RecordingLimits(*BOUNDS, np.ones(3, bool))


def motion(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions and speeds (T, 3) that keep BOUNDS."""
    rate, phase = np.array([2.0, 2.9, 3.7]), np.array([0.0, 0.7, 1.9])
    angle = np.outer(t, rate) + phase
    q = 0.6 * np.sin(angle) + 0.3 * np.cos(2 * angle) + np.array([0.2, -0.5, 0.1])
    return q, rate * (0.6 * np.cos(angle) - 0.6 * np.sin(2 * angle))


def recorded(seconds: float = 8.0, rate: float = 200.0, name: str = "run", seed: int = 0) -> Run:
    """A clean run with noisy speeds and torques."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(seconds * rate)) / rate
    q, dq = motion(t)
    tau = 12 * np.cos(q) + 3 * np.tanh(dq / 0.05) + 0.4 * dq + rng.normal(0, 0.1, q.shape)
    return Run(name, t, q, tau, dq + rng.normal(0, 0.01, q.shape))


def without_speed(run: Run) -> Run:
    return replace(run, dq=None)


def check(*runs: Run, **declared: Any) -> tuple[list[Run], list[Finding]]:
    return checked(runs, MeasurementSpec(**declared), JOINTS, LIMITS)


def only(findings: list[Finding] | tuple[Finding, ...], kind: str) -> Finding:
    """The one finding there is, and it is of `kind`."""
    assert [found.kind for found in findings] == [kind], findings
    return findings[0]


def read(path: Path, *joints: str, **declared: Any) -> Dataset:
    return read_dataset([path], MeasurementSpec(**declared), joints or JOINTS)


def refused(path: Path, *parts: str, **declared: Any) -> None:
    """A file that is not read: the message names it, and has these parts."""
    with pytest.raises(FileError) as caught:
        read(path, **declared)
    for part in (str(path), *parts):
        assert part in str(caught.value)


def write_table(path: Path, columns: Mapping[str, np.ndarray], separator: str = ",") -> Path:
    """A CSV of columns (T,) with all digits."""
    table = np.column_stack(list(columns.values()))
    header = separator.join(columns)
    np.savetxt(path, table, "%.17g", separator, header=header, comments="", encoding="utf-8")
    return path


def named(channel: str, values: np.ndarray, joints: tuple[str, ...] = JOINTS) -> dict[str, Any]:
    """Columns `channel_joint` of values (T, n)."""
    return {f"{channel}_{joint}": values[:, k] for k, joint in enumerate(joints)}


def write_csv(path: Path, run: Run, joints: tuple[str, ...] = JOINTS, separator: str = ",") -> Path:
    """`t, q_…, dq_…, tau_…`."""
    columns = {"t": run.t}
    for channel in ("q", "dq", "tau"):
        values = getattr(run, channel)
        columns |= {} if values is None else named(channel, values, joints)
    return write_table(path, columns, separator)
