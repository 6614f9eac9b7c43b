"""Positions, speeds, torques and wrenches in files of their own."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.errors import FileError
from excite_cli.measurement.catalogue import read_dataset
from excite_cli.measurement.dataset import Dataset
from tests.measurement.recordings import JOINTS, named, recorded, write_table

CHANNELS = {"q": "position", "dq": "velocity", "tau": "effort"}
RUN = recorded(seconds=2.0)


def written(folder: Path, *channels: str, late: str = "") -> list[Path]:
    """Files as a logger wrote them: `t,- shoulder_position,…`; stamps of `late` are others."""
    paths = []
    for channel in channels:
        word = CHANNELS[channel]
        columns = {"t": RUN.t + (0.001 if channel == late else 0.0)}
        columns |= {f"- {j}_{word}": getattr(RUN, channel)[:, k] for k, j in enumerate(JOINTS)}
        paths.append(write_table(folder / f"robot_{word}.csv", columns))
    return paths


def read(*paths: Path, channels: Any = CHANNELS) -> Dataset:
    return read_dataset(paths, MeasurementSpec(channels=channels), JOINTS)


def test_channels_of_one_recording_are_joined_in_any_order(tmp_path: Path) -> None:
    """Fields of joint states need no declaration, nor do the others beside one of them."""
    files = written(tmp_path, "q", "dq", "tau")
    for order, channels in ((files, CHANNELS), (files[::-1], CHANNELS), (files, {}),
                            (files, {"tau": "effort"})):  # fmt: skip
        (run,) = read(*order, channels=channels).runs
        assert run.name == "robot"
        for name in CHANNELS:
            np.testing.assert_array_equal(getattr(run, name), getattr(RUN, name))
    (run,) = read(files[0], files[2], channels={"dq": None}).runs
    assert run.dq is None
    with pytest.raises(FileError, match=r"no columns 'angle_<joint>'"):
        read(*files, channels={"q": "angle", "tau": "torque", "dq": None})


def test_what_is_no_part_of_the_run_is_refused(tmp_path: Path) -> None:
    """The position of something else, other stamps, a missing channel and one twice."""
    path = tmp_path / "gripper.csv"
    path.write_text("t,temperature,gripper_position\n0,20,1\n0.01,20,1\n")
    with pytest.raises(FileError, match=r"no columns 'q_<joint>'"):
        read(path, channels={})
    with pytest.raises(FileError, match=r"position.csv and robot_effort.csv.*other time stamps"):
        read(*written(tmp_path, "q", "tau", late="tau"))
    with pytest.raises(FileError, match=r"no columns 'effort_<joint>'.*channels: \{tau: …\}"):
        read(*written(tmp_path, "q", "dq"))
    path.write_bytes((tmp_path / "robot_position.csv").read_bytes())
    with pytest.raises(FileError, match=r"'q' of .* more than one"):
        read(path, *written(tmp_path, "q", "tau"))


FOOT = ("fx", "fy", "fz", "mx", "my", "mz")
WRENCH = np.random.default_rng(5).normal(size=(len(RUN.t), 6))


def table(path: Path, **columns: np.ndarray) -> Path:
    """Positions of the joints, where nothing else is said."""
    return write_table(path, {"t": RUN.t, **(columns or named("q", RUN.q))})


def standing(*paths: Path, joints: tuple[str, ...] = JOINTS, channel: str = "foot") -> Dataset:
    spec = MeasurementSpec(wrench=[{"channel": channel}])
    return read_dataset(paths, spec, joints, rows=("base",))


def foot(factor: float = 1.0) -> dict[str, np.ndarray]:
    return named("foot", factor * WRENCH, FOOT)


@pytest.fixture
def parts(tmp_path: Path) -> list[Path]:
    return [table(tmp_path / "log_q.csv"), table(tmp_path / "log_f.csv", **foot())]


def test_a_wrench_in_a_file_of_its_own_is_joined(parts: list[Path]) -> None:
    for order in (parts, parts[::-1]):
        data = standing(*order)
        assert data.findings == ()  # and no word of further columns
        (run,) = data.runs
        assert run.name == "log"
        np.testing.assert_array_equal(run.q, RUN.q)
        for name, values in foot().items():
            np.testing.assert_array_equal(run.extra[name], values)


def test_a_whole_recording_beside_parts_of_another_stays(parts: list[Path], tmp_path: Path) -> None:
    whole = table(tmp_path / "whole.csv", **named("q", RUN.q), **foot(2.0))
    data = standing(parts[0], whole, parts[1])
    assert [run.name for run in data.runs] == ["log", "whole"]
    for run, factor in zip(data.runs, (1, 2), strict=True):
        np.testing.assert_array_equal(run.extra["foot_mz"], factor * WRENCH[:, 5])
    again = table(tmp_path / "again_f.csv", **foot())
    with pytest.raises(FileError, match=r"log_f.csv, again_f.csv: 'foot_fx' is in more than one"):
        standing(*parts, again)


def test_recordings_without_their_wrench_stay_apart(tmp_path: Path) -> None:
    files = [table(tmp_path / f"{name}.csv") for name in ("a", "b")]
    data = standing(*files)  # what holds the robot says which channel is missing
    assert [run.name for run in data.runs] == ["a", "b"]
    assert [run.origin.file for run in data.runs] == [str(file) for file in files]


def test_columns_of_a_wrench_are_never_those_of_a_joint(tmp_path: Path) -> None:
    """Joints are called as parts of a wrench are, a channel as ours is."""
    joints = ("fx", "fy", "mz")
    path = table(tmp_path / "log.csv", **named("q", RUN.q, joints), **foot())
    (run,) = standing(path, joints=joints).runs
    np.testing.assert_array_equal(run.q, RUN.q)
    np.testing.assert_array_equal(run.extra["foot_fx"], WRENCH[:, 0])
    path = table(tmp_path / "tau.csv", **named("q", RUN.q), **named("tau", WRENCH, FOOT))
    (run,) = standing(path, channel="tau").runs
    np.testing.assert_array_equal(run.extra["tau_mz"], WRENCH[:, 5])
    assert not run.tau.any()
