"""Exports from Python."""

from pathlib import Path

import h5py
import numpy as np
import pytest

from excite_cli import (
    ConfigError,
    FileError,
    check,
    export_file,
    load_problem,
    motions_of,
    plan,
    read_result,
)
from tests.api.conftest import SMALL, SMOKE, Loop


def test_what_the_format_cannot_hold_is_one_sentence(loop: Loop, tmp_path: Path) -> None:
    target = tmp_path / "x.csv"
    with pytest.raises(FileError, match=r"fit\.h5 is a model: it cannot be exported as csv"):
        export_file(loop.fit, "csv", target)
    with pytest.raises(ConfigError, match=r"--format cvs: unknown\. Did you mean 'csv'"):
        export_file(loop.result, "cvs", target)
    with pytest.raises(ConfigError, match="--periods 0: a motion is played once or more"):
        export_file(loop.result, "csv", target, periods=0)
    assert not list(tmp_path.iterdir())


def test_motions_are_written_with_their_numbers(loop: Loop, tmp_path: Path) -> None:
    found = export_file(loop.result, "npz", str(tmp_path / "arm.npz"), rate=100.0)
    assert found.paths == (tmp_path / "arm_1.npz", tmp_path / "arm_2.npz")
    second = motions_of(read_result(loop.result))[1]
    written = found.motions[1]
    assert (written.name, written.pace) == ("motion_2", 1.0)
    assert written.durations == {"motion": second.trajectory.duration}
    with np.load(found.paths[1]) as stored:
        q = second.trajectory.states(stored["t"], second.coefficients)[0]
        assert written.instants == len(stored["t"])
        assert np.array_equal(stored["q"], q)
    with pytest.raises(FileError, match="exists already"):
        export_file(loop.result, "npz", tmp_path / "arm.npz", rate=100.0)


def test_a_motion_file_knows_neither_limits_nor_robot(loop: Loop, tmp_path: Path) -> None:
    (path,) = export_file(loop.result, "csv", tmp_path / "one.csv", chosen=[1]).paths
    for option, more in (("--slow", {"slow": 0.3}), ("--entry", {"start": {}})):
        with pytest.raises(FileError, match=f"{option}: .*does not say which robot"):
            export_file(path, "npz", tmp_path / "one.npz", **more)
    with pytest.raises(FileError, match=r"--motion 2: .*one\.csv holds one motion"):
        export_file(path, "npz", tmp_path / "one.npz", chosen=[2])


def test_a_motion_planned_with_a_fit_is_entered_from_rest(loop: Loop, tmp_path: Path) -> None:
    """Its problem is that of the result, what the fit knows included."""
    uncertain = [f"uncertainty.fit={loop.fit}", "constraints.torque.scale=1"]
    problem = load_problem(SMOKE, [*SMALL, "sequence.motions=1", *uncertain])
    plan(problem, output=tmp_path / "arm.h5")
    found = export_file(tmp_path / "arm.h5", "csv", tmp_path / "arm.csv", rate=50.0, start={})
    assert found.motions[0].durations.keys() == {"entry", "motion", "return"}


def test_edited_joints_samples_and_figures_are_told(loop: Loop, tmp_path: Path) -> None:
    path = tmp_path / "edited.h5"
    path.write_bytes(loop.result.read_bytes())
    with h5py.File(path, "r+") as file:
        names = list(file.attrs["joint_names"])
        file.attrs["joint_names"] = names[::-1]
    with pytest.raises(FileError, match=r"edited\.h5 names other joints .* or in another order"):
        export_file(path, "csv", tmp_path / "motion.csv")
    with pytest.raises(FileError, match="cannot be stacked: it names other joints, or in another"):
        plan(loop.problem, priors=[path])
    assert not list(tmp_path.glob("*.csv"))
    with h5py.File(path, "r+") as file:
        file.attrs["joint_names"] = names
    with h5py.File(path, "r+") as file:
        positions = file["motions/1/q"][:, :1]
        del file["motions/1/q"]
        file["motions/1/q"] = positions
    with pytest.raises(FileError, match=r"edited\.h5"):
        check(loop.problem, path, rate=10.0)
    with h5py.File(path, "r+") as file:
        file["motions/1"].attrs["condition_number"] = -1.0
    with pytest.raises(FileError, match="'condition_number' is below 1"):
        read_result(path)
