"""From several files to one data set: names of runs, readers, messages, when each was recorded."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.errors import FileError
from excite_cli.measurement import reader as reading
from excite_cli.measurement.campaign_clock import on_campaign_clock
from excite_cli.measurement.catalogue import read_dataset
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.measurement.hdf5_writer import write_dataset
from excite_cli.measurement.run_identity import Origin, Part
from tests.measurement.recordings import JOINTS, read, recorded, refused, write_csv


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
        refused(path, "no torque of joint 'wrist'", "without_torque: [wrist")
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
        refused(tmp_path / name, part)
    with pytest.raises(FileError, match="No measured file"):
        read_dataset([], MeasurementSpec(), JOINTS)
    path = write_csv(tmp_path / "log.csv", recorded())
    monkeypatch.setattr(reading, "MAX_VALUES", 1000)
    refused(path, "holds 16,000 numbers; up to 1,000")
    monkeypatch.setattr(reading, "MAX_BYTES", 1000)
    refused(path, "GiB; measured files of up to")


NOON = 1.7e9


def began(name: str, epoch: float | None = None, first: float = 0.0, part: Part = Part()) -> Run:
    t = first + np.arange(101) * 0.1
    return Run(name, t, np.zeros((101, 1)), np.zeros((101, 1)), epoch=epoch, part=part)


@pytest.mark.parametrize(
    ("runs", "starts"),
    [
        # Stamps count from the earliest recording, whatever the order of the files.
        ([began("b", NOON + 3600.0), began("a", NOON)], [3600.0, 0.0]),
        # A first sample later than zero is where the campaign begins.
        ([began("a", NOON, 5.0), began("b", NOON + 60.0)], [-5.0, 55.0]),
        # A clock that starts anew gives all recordings one epoch; one may also be missing, or
        # overlap: the order counts.
        *(
            ([began("a", NOON), began("b", epoch), began("c", NOON + 900.0)], [0.0, 10.0, 20.0])
            for epoch in (None, NOON, NOON + 8.0)
        ),
        ([began("a", first=5.0), began("b", first=1.0)], [-5.0, 9.0]),
        # Clocks that are set while they run may cross a little.
        ([began("a", NOON), began("b", NOON + 9.5)], [0.0, 9.5]),
        # Stretches of a recording share its beginning.
        ([*(began("a", first=20.0 * k, part=Part(k + 1, start=20.0 * k)) for k in range(2)),
          began("b")], [0.0, 0.0, 30.0]),
    ],
)  # fmt: skip
def test_when_recordings_began_on_the_campaigns_clock(runs: list[Run], starts: list[float]) -> None:
    assert [each.start for each in on_campaign_clock(runs)] == pytest.approx(starts)
