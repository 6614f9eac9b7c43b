"""Positions, speeds and torques in files of their own."""

from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.errors import FileError
from excite_cli.measurement.catalogue import read_dataset
from excite_cli.measurement.dataset import Dataset
from tests.measurement.recordings import JOINTS, recorded

CHANNELS = {"q": "position", "dq": "velocity", "tau": "effort"}
RUN = recorded(seconds=2.0)


def written(folder: Path, *channels: str, late: str = "") -> list[Path]:
    """Files as a logger wrote them: `t,- shoulder_position,…`; stamps of `late` are others."""
    paths = []
    for channel in channels:
        word = CHANNELS[channel]
        header = ",".join(["t", *(f"- {joint}_{word}" for joint in JOINTS)])
        t = RUN.t + (0.001 if channel == late else 0.0)
        table = np.column_stack([t, getattr(RUN, channel)])
        paths.append(folder / f"robot_{word}.csv")
        np.savetxt(paths[-1], table, "%.17g", ",", header=header, comments="")
    return paths


def read(*paths: Path) -> Dataset:
    return read_dataset(paths, MeasurementSpec(channels=CHANNELS), JOINTS)


def test_channels_of_one_recording_are_joined_in_any_order(tmp_path: Path) -> None:
    for order in (("q", "dq", "tau"), ("tau", "q", "dq")):
        (run,) = read(*written(tmp_path, *order)).runs
        assert run.name == "robot"
        np.testing.assert_array_equal(run.q, RUN.q)
        np.testing.assert_array_equal(run.dq, RUN.dq)
        np.testing.assert_array_equal(run.tau, RUN.tau)


def test_fields_of_joint_states_need_no_declaration(tmp_path: Path) -> None:
    files = written(tmp_path, "q", "dq", "tau")
    (run,) = read_dataset(files, MeasurementSpec(), JOINTS).runs
    np.testing.assert_array_equal(run.tau, RUN.tau)
    np.testing.assert_array_equal(run.dq, RUN.dq)
    spec = MeasurementSpec(channels={"dq": None})
    (run,) = read_dataset([files[0], files[2]], spec, JOINTS).runs
    assert run.dq is None
    spec = MeasurementSpec(channels={"tau": "effort"})  # of the others nothing is said
    (run,) = read_dataset(files, spec, JOINTS).runs
    np.testing.assert_array_equal(run.q, RUN.q)
    with pytest.raises(FileError, match=r"no columns 'angle_<joint>'"):
        read_dataset(files, MeasurementSpec(channels={"q": "angle", "tau": "torque", "dq": None}),
                     JOINTS)  # fmt: skip


def test_the_position_of_something_else_is_no_part_of_the_run(tmp_path: Path) -> None:
    path = tmp_path / "gripper.csv"
    path.write_text("t,temperature,gripper_position\n0,20,1\n0.01,20,1\n")
    with pytest.raises(FileError, match=r"no columns 'q_<joint>'"):
        read_dataset([path], MeasurementSpec(), JOINTS)


def test_other_stamps_a_missing_channel_and_one_twice_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"position.csv and robot_effort.csv.*other time stamps"):
        read(*written(tmp_path, "q", "tau", late="tau"))
    with pytest.raises(FileError, match=r"no columns 'effort_<joint>'.*channels: \{tau: …\}"):
        read(*written(tmp_path, "q", "dq"))
    (path,) = written(tmp_path, "q")
    again = tmp_path / "again.csv"
    again.write_bytes(path.read_bytes())
    with pytest.raises(FileError, match=r"'q' of .* more than one"):
        read(path, again, *written(tmp_path, "tau"))
