"""Logs of real robots: no error is found in them, and what is known of them comes out."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from excite_cli.api.loading import as_recorded, load_case
from excite_cli.measurement.dataset import Dataset
from excite_cli.measurement.quality import raise_for_errors
from excite_cli.measurement.speed_lag import speed_lag

LOGS = Path(__file__).resolve().parents[2] / "data"
ROBOTS = {
    "kr300": ("kr300.h5", "kr300.urdf"),
    "tx40": ("tx40.h5", "tx40_mdh_modified.urdf"),
    "ur10_cb": ("ur10_cb.h5", "ur10.urdf"),
}


def of(robot: str, key: str) -> list[Any]:
    with h5py.File(LOGS / robot / ROBOTS[robot][0]) as file:
        return list(file.attrs[key])


def load(robot: str, name: str = "", **declared: Any) -> Dataset:
    file, urdf = ROBOTS[robot]
    spec = {"robot": {"urdf": str(LOGS / robot / urdf)}, "measurement": declared}
    return as_recorded(load_case(spec), LOGS / robot / (name or file))


@pytest.mark.parametrize("robot", ROBOTS)
def test_no_false_alarm(robot: str) -> None:
    data = load(robot)
    assert [found for found in data.findings if found.severity != "note"] == []
    raise_for_errors(data)
    assert all(run.valid is None for run in data.runs)


def test_names_and_channels() -> None:
    data = load("kr300")
    assert [run.name for run in data.runs] == ["A", "B", "C"]
    assert set(data.runs[0].extra) == {"q_link", "q_ref", "tau_motor"}
    # Its speeds come one sample (4 ms) late.
    assert [speed_lag(run) for run in data.runs] == pytest.approx([0.004] * 3, abs=5e-4)


def ratios(robot: str) -> dict[str, float]:
    names = [name.decode() for name in of(robot, "joint_names")]
    return dict(zip(names, map(float, of(robot, "gear_ratios")), strict=True))


AT_MOTORS: dict[str, dict[str, Any]] = {
    "kr300": {"torque": "motor", "channels": {"tau": "tau_motor"}},
    "tx40": {  # with encoders, and the wrist's coupled
        "torque": "motor",
        "position": "motor",
        "coupling": {"joint_5": {"joint_6": 1.0}},
        "channels": {"tau": "tau_motor", "q": "q_motor"},
    },
}


@pytest.mark.parametrize("robot", AT_MOTORS)
def test_motor_torque_leads_to_joint_torque(robot: str) -> None:
    there = load(robot, gear_ratio=ratios(robot), **AT_MOTORS[robot])
    for run, known in zip(there.runs, load(robot).runs, strict=True):
        scale = np.abs(known.tau).max(axis=0)
        assert (np.abs(run.tau - known.tau).max(axis=0) / scale).max() < 1e-4
        assert np.abs(run.q - known.q - (run.q - known.q)[0]).max() < 1e-4


def test_bag_and_hdf5_of_the_same_recording() -> None:
    (bag,), (known,) = load("ur10_cb", "ur10_exciting_trajectory.db3").runs, load("ur10_cb").runs
    np.testing.assert_allclose(bag.t, known.t, rtol=0, atol=2e-9)
    np.testing.assert_array_equal(bag.q, known.q)
    assert bag.dq is not None
    assert known.dq is not None
    np.testing.assert_allclose(bag.dq, known.dq, rtol=1e-6, atol=1e-7)  # stored in single
    np.testing.assert_allclose(bag.tau, known.tau, rtol=1e-6, atol=1e-5)
