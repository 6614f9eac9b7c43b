"""From several files to one data set: names of runs, readers, messages."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.errors import FileError
from excite_cli.measurement import reader as reading
from excite_cli.measurement.catalogue import read_dataset
from excite_cli.measurement.dataset import Dataset
from excite_cli.measurement.hdf5_writer import write_dataset
from excite_cli.measurement.run_identity import Origin
from tests.measurement.recordings import JOINTS, read, recorded, write_csv


def test_run_names_are_unique(tmp_path: Path) -> None:
    paths = []
    for folder in ("x", "y"):
        (tmp_path / folder).mkdir()
        runs = (recorded(name="A"), recorded(name="B", seed=1))
        for stem in ("first", "second"):
            paths.append(tmp_path / folder / f"{stem}.h5")
            write_dataset(paths[-1], Dataset(JOINTS, runs), {})
        paths.append(write_csv(tmp_path / folder / "log.csv", recorded()))
    data = read_dataset(paths, MeasurementSpec(), JOINTS)
    names = [run.name for run in data.runs]
    assert names == [
        "A", "B", "second:A", "second:B", "log", "first:A", "first:B", "second:A_2", "second:B_2",
        "log_2",
    ]  # fmt: skip
    assert data.sources == tuple(map(str, paths))


def test_time_from_1970_keeps_its_digits(tmp_path: Path) -> None:
    run = recorded()
    path = write_csv(tmp_path / "log.csv", replace(run, t=1.7e12 + run.t * 1e3))
    data = read(path, time="ms")
    assert data.findings == ()
    np.testing.assert_allclose(data.runs[0].t, run.t, atol=1e-6)
    assert data.runs[0].epoch == pytest.approx(1.7e9, abs=1e-6)


def test_where_a_run_came_from_and_its_absolute_time_stay_with_it(tmp_path: Path) -> None:
    path = tmp_path / "log.h5"
    runs = (replace(recorded(name="A"), epoch=1.7e9), recorded(name="B", seed=1))
    write_dataset(path, Dataset(JOINTS, runs), {})
    first, second = read(path).runs
    assert first.origin == Origin(str(path), "/runs/A")
    assert (first.epoch, second.epoch) == (1.7e9, None)
    (counted,) = read(write_csv(tmp_path / "late.csv", replace(runs[1], t=2e6 + runs[1].t))).runs
    assert counted.epoch is None  # a clock that counts from its own start
    assert counted.origin == Origin(str(tmp_path / "late.csv"))


@pytest.mark.parametrize("recorded_too", [True, False])
def test_a_joint_without_torque_needs_no_column_and_none_of_it_counts(
    tmp_path: Path, recorded_too: bool
) -> None:
    run = recorded()
    stuck = replace(run, tau=run.tau * [1.0, 1.0, 0.0])
    path = write_csv(tmp_path / "log.csv", stuck)
    if not recorded_too:
        rows = [line.rsplit(",", 1)[0] for line in path.read_text().splitlines()]
        path.write_text("\n".join(rows) + "\n")
        with pytest.raises(FileError, match=r"no torque of joint 'wrist'.*without_torque: \[wrist"):
            read(path)
    data = read(path, without_torque=["wrist"])
    assert data.findings == ()
    np.testing.assert_allclose(data.runs[0].q, run.q)
    assert data.runs[0].usable().mean(axis=0).tolist() == [1.0, 1.0, 0.0]


def test_files_that_cannot_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "data.npy").write_bytes(b"x")
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder.h5").mkdir()
    for name, part in (
        ("none.csv", "There is no file"),
        ("data.npy", "pickles are never opened"),
        ("folder", "is a folder without a bag"),
        ("folder.h5", "is a folder without a bag"),
    ):
        with pytest.raises(FileError) as caught:
            read(tmp_path / name)
        assert part in str(caught.value)
    with pytest.raises(FileError, match="No measured file"):
        read_dataset([], MeasurementSpec(), JOINTS)
    path = write_csv(tmp_path / "log.csv", recorded())
    monkeypatch.setattr(reading, "MAX_VALUES", 1000)
    with pytest.raises(FileError, match="holds 16,000 numbers; up to 1,000"):
        read(path)
    monkeypatch.setattr(reading, "MAX_BYTES", 1000)
    with pytest.raises(FileError, match="GiB; measured files of up to"):
        read(path)
