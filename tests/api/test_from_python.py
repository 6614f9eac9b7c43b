"""Arrays in: every function takes them as it takes the files that hold the same."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from excite_cli import (
    Dataset,
    FileError,
    diagnose,
    identify,
    inspect,
    load_data,
    replay,
    score,
    thresholds,
    write_dataset,
)
from excite_cli.errors import ConfigError
from excite_cli.shown.note import Note
from tests.api.conftest import Loop
from tests.measurement.recordings import named, write_table


@pytest.fixture(scope="module")
def tables(loop: Loop) -> dict[str, dict[str, np.ndarray]]:
    data = load_data(loop.problem, loop.data)
    joints = data.joint_names
    return {
        run.name: {"t": run.t, **named("q", run.q, joints), **named("tau", run.tau, joints)}
        for run in data.runs
    }


@pytest.fixture(scope="module")
def arrays(loop: Loop, tables: dict[str, dict[str, np.ndarray]]) -> Dataset:
    joints = loop.problem.robot.joint_names
    t, q, tau = (
        [
            each["t"] if key == "t" else np.stack([each[f"{key}_{j}"] for j in joints], axis=1)
            for each in tables.values()
        ]
        for key in ("t", "q", "tau")
    )
    return Dataset.from_arrays(joints, t, q, tau, names=list(tables))


@pytest.mark.long
def test_parameters_are_those_of_a_csv_to_the_last_digit(
    loop: Loop, tables: dict[str, dict[str, np.ndarray]], arrays: Dataset, tmp_path: Path
) -> None:
    files = [write_table(tmp_path / f"{name}.csv", table) for name, table in tables.items()]
    frames = Dataset.from_frame([pd.DataFrame(each) for each in tables.values()], names=[*tables])
    of_files, *others = (identify(loop.problem, each) for each in (files, arrays, frames))
    for other in others:
        np.testing.assert_array_equal(other.fit.values, of_files.fit.values)
        np.testing.assert_array_equal(other.fit.covariance, of_files.fit.covariance)
        assert other.error == of_files.error
        assert other.findings == of_files.findings
    found = diagnose(loop.problem, arrays)
    assert [each.effect for each in found.effects] == [
        each.effect for each in diagnose(loop.problem, files).effects
    ]
    assert inspect(loop.problem, arrays).results == inspect(loop.problem, files).results
    assert score(loop.fit, arrays).error == score(loop.fit, loop.data).error
    assert replay(loop.fit, arrays).after == replay(loop.fit, files).after
    longer = tuple(replace(run, name=f"{run.name}_{k}") for k in range(3) for run in arrays.runs)
    found_of = thresholds(loop.fit, replace(arrays, runs=longer))
    assert found_of.joint_names == arrays.joint_names


def test_what_is_noticed_is_told(loop: Loop, arrays: Dataset) -> None:
    run, joints = arrays.runs[0], arrays.joint_names
    tau = run.tau.copy()
    tau[100, 0] = np.nan
    heard: list[Note] = []
    data = load_data(loop.problem, Dataset.from_arrays(joints, run.t, run.q, tau), heard.append)
    assert not data.as_given
    assert not data.runs[0].usable()[100, 0]
    assert any("torque of elbow is NaN" in note.text for note in heard)
    assert load_data(loop.problem, data, heard.append).runs == data.runs


def test_data_that_are_read_already_or_not_yet_are_told_apart(
    loop: Loop, arrays: Dataset, tmp_path: Path
) -> None:
    with pytest.raises(FileError, match="No config has read"):
        write_dataset(tmp_path / "x.h5", arrays)
    with pytest.raises(ConfigError, match="converted already"):
        inspect(loop.problem, load_data(loop.problem, arrays))
    write_dataset(tmp_path / "x.h5", load_data(loop.problem, arrays))
    assert score(loop.fit, tmp_path / "x.h5").error == score(loop.fit, arrays).error
