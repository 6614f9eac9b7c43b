"""Positions, speeds, torques and wrenches in files of their own."""

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


FOOT = ("fx", "fy", "fz", "mx", "my", "mz")
WRENCH = np.random.default_rng(5).normal(size=(len(RUN.t), 6))


def table(path: Path, **columns: np.ndarray) -> Path:
    """A CSV of columns (T,), with their stamps."""
    columns = {"t": RUN.t, **columns}
    rows = np.column_stack(list(columns.values()))
    np.savetxt(path, rows, "%.17g", ",", header=",".join(columns), comments="")
    return path


def positions(joints: tuple[str, ...] = JOINTS) -> dict[str, np.ndarray]:
    return {f"q_{joint}": RUN.q[:, k] for k, joint in enumerate(joints)}


def foot(values: np.ndarray = WRENCH) -> dict[str, np.ndarray]:
    return {f"foot_{part}": values[:, k] for k, part in enumerate(FOOT)}


def standing(*paths: Path, joints: tuple[str, ...] = JOINTS, **more: object) -> Dataset:
    spec = MeasurementSpec(wrench=[{"channel": "foot"}], **more)
    return read_dataset(paths, spec, joints, rows=("base",))


def test_a_wrench_in_a_file_of_its_own_is_joined(tmp_path: Path) -> None:
    files = [table(tmp_path / "log_q.csv", **positions()), table(tmp_path / "log_f.csv", **foot())]
    for order in (files, files[::-1]):
        data = standing(*order)
        assert data.findings == ()  # and no word of further columns
        (run,) = data.runs
        assert run.name == "log"
        np.testing.assert_array_equal(run.q, RUN.q)
        for k, part in enumerate(FOOT):
            np.testing.assert_array_equal(run.extra[f"foot_{part}"], WRENCH[:, k])


def test_a_whole_recording_beside_parts_of_another_stays(tmp_path: Path) -> None:
    whole = table(tmp_path / "whole.csv", **positions(), **foot(2 * WRENCH))
    parts = [table(tmp_path / "log_q.csv", **positions()), table(tmp_path / "log_f.csv", **foot())]
    data = standing(parts[0], whole, parts[1])
    assert [run.name for run in data.runs] == ["log", "whole"]
    for run, factor in zip(data.runs, (1, 2), strict=True):
        np.testing.assert_array_equal(run.extra["foot_mz"], factor * WRENCH[:, 5])


def test_recordings_without_their_wrench_stay_apart(tmp_path: Path) -> None:
    files = [table(tmp_path / f"{name}.csv", **positions()) for name in ("a", "b")]
    data = standing(*files)  # what holds the robot says which channel is missing
    assert [run.name for run in data.runs] == ["a", "b"]
    assert [run.origin.file for run in data.runs] == [str(file) for file in files]


def test_a_wrench_that_is_there_twice_is_refused(tmp_path: Path) -> None:
    files = [
        table(tmp_path / "log_q.csv", **positions()),
        table(tmp_path / "log_f.csv", **foot()),
        table(tmp_path / "again_f.csv", **foot()),
    ]
    with pytest.raises(FileError, match=r"log_f.csv, again_f.csv: 'foot_fx' is in more than one"):
        standing(*files)


def test_columns_of_a_wrench_are_never_those_of_a_joint(tmp_path: Path) -> None:
    """Joints are called as parts of a wrench are, a channel as ours is."""
    joints = ("fx", "fy", "mz")
    path = table(tmp_path / "log.csv", **positions(joints), **foot())
    (run,) = standing(path, joints=joints).runs
    np.testing.assert_array_equal(run.q, RUN.q)
    np.testing.assert_array_equal(run.extra["foot_fx"], WRENCH[:, 0])
    torques = {f"tau_{part}": WRENCH[:, k] for k, part in enumerate(FOOT)}
    path = table(tmp_path / "tau.csv", **positions(), **torques)
    spec = MeasurementSpec(wrench=[{"channel": "tau"}])
    (run,) = read_dataset([path], spec, JOINTS, rows=("base",)).runs
    np.testing.assert_array_equal(run.extra["tau_mz"], WRENCH[:, 5])
    assert not run.tau.any()
