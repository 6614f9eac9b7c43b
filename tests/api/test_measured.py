"""Simulating, identifying and diagnosing from Python: one sentence for what cannot be."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from excite_cli import (
    Case,
    ConfigError,
    ExciteError,
    FileError,
    Note,
    SimulationSettings,
    diagnose,
    identify,
    load_case,
    load_data,
    motions_of,
    read_fit,
    read_result,
    simulate,
)
from excite_cli.api.simulating import PositionDrive, _warn_of_reading
from excite_cli.config.data_spec import MeasurementSpec
from tests.api.conftest import SMOKE, Loop

Take = Callable[..., object]


def test_what_cannot_be_played_is_refused(loop: Loop, other_joints: Case) -> None:
    with pytest.raises(FileError, match=r"arm\.h5 moves other joints than the config: elbow, sli"):
        simulate(other_joints, loop.result)
    with pytest.raises(FileError, match=r"of other joints \(elbow, slide\) than the config"):
        simulate(other_joints, load_data(loop.problem, loop.data))
    with pytest.raises(FileError, match="There is no motion to play"):
        simulate(loop.problem, [])


@pytest.mark.parametrize("take", [identify, diagnose])
def test_data_of_other_joints_are_refused_and_nothing_is_replaced_unasked(
    loop: Loop, other_joints: Case, take: Take
) -> None:
    with pytest.raises(ExciteError, match="there is no position of joint 'shoulder_yaw'"):
        take(other_joints, loop.data)
    with pytest.raises(FileError, match=r"of other joints \(elbow, slide\) than the config"):
        take(other_joints, load_data(loop.problem, str(loop.data)))
    before = loop.fit.read_bytes()
    with pytest.raises(FileError, match=r"fit\.h5 exists already"):
        take(loop.problem, loop.data, output=str(loop.fit))
    assert loop.fit.read_bytes() == before


def test_what_is_written_is_what_is_returned(loop: Loop, tmp_path: Path) -> None:
    told: list[Note] = []
    found = identify(
        loop.problem,
        [loop.data],
        output=tmp_path / "fit.h5",
        urdf=str(tmp_path / "arm.urdf"),
        mjcf=tmp_path / "arm.xml",
        parameters=tmp_path / "arm.yaml",
        tell=told.append,
    )
    stored = read_fit(str(tmp_path / "fit.h5"))
    assert np.array_equal(stored.fit.values, found.fit.values)
    assert stored.sources == (str(loop.data),)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "arm.urdf", "arm.xml", "arm.yaml", "fit.h5",
    ]  # fmt: skip
    assert any("it has no shapes, actuators or sensors" in note.sentence for note in told)


def test_a_file_is_what_was_simulated(loop: Loop, tmp_path: Path) -> None:
    runs: list[tuple[str, int, int]] = []
    found = simulate(
        loop.problem,
        read_result(loop.result),
        settings=SimulationSettings(repeat=2),
        chosen=[2],
        output=tmp_path / "data.h5",
        progress=lambda run, done, total: runs.append((run, done, total)),
    )
    assert runs == [("motion_2_take_1", 0, 2), ("motion_2_take_2", 1, 2)]
    stored = load_data(loop.problem, tmp_path / "data.h5")
    assert np.array_equal(stored.runs[1].tau, found.dataset.runs[1].tau)


def test_motions_are_entered_from_a_posture(loop: Loop) -> None:
    first = motions_of(read_result(loop.result))[0]
    told: list[Note] = []
    found = simulate(loop.problem, first, start={"elbow": 0.3}, tell=told.append)
    q = found.dataset.runs[0].q
    assert np.abs(q[[0, -1], 0] - 0.3).max() < 5e-3
    assert [note.text.partition(":")[0] for note in told] == ["motion_1"]
    with pytest.raises(ConfigError, match=r"--from: joint 'elbov' is unknown\. Did you mean 'elb"):
        simulate(loop.problem, first, start={"elbov": 0.3})


def test_a_config_that_takes_torques_from_set_points_is_compared_with_the_file() -> None:
    by_command = MeasurementSpec().model_copy(update={"torque": "command"})
    drives = SimulationSettings(drive=PositionDrive((9.0,), (1.0,)))
    told: list[Note] = []
    _warn_of_reading(by_command, drives, told.append)
    assert not told
    _warn_of_reading(by_command, SimulationSettings(), told.append)
    assert any("simulate with --control position" in note.sentence for note in told)


def test_a_config_that_converts_is_warned_of(loop: Loop, tmp_path: Path) -> None:
    case = load_case(SMOKE, ["robot.joints=[elbow, slide]", "measurement.gear_ratio.elbow=2"])
    told: list[Note] = []
    simulate(case, loop.result, chosen=[1], output=tmp_path / "d.h5", tell=told.append)
    assert any("the config converts recorded positions" in note.sentence for note in told)
