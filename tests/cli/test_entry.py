"""Given ends and entries through the installed program."""

import h5py
import numpy as np
import pytest

from excite_cli.api.exported_chains import start_posture
from excite_cli.cli.options import start_from
from excite_cli.config.load_spec import load_spec
from excite_cli.errors import ConfigError
from excite_cli.robot.model import build_robot
from tests.cli.conftest import Run
from tests.cli.program import BRIEF, SMOKE, Program

BAND = "constraints.keep_out={band: {elbow: [0.95, 1.15]}}"
POSTURE = np.array([0.0, 0.6, 0.8, 0.0, 0.05])


def _spline(end: str) -> tuple[str, ...]:
    trajectory = (
        "trajectory={family: bspline, duration: 6, control_points: 14, start: posture, "
        f"end: {{{end}}}}}"
    )
    return ("--set", trajectory, "--set", "sampling={}", *BRIEF)


def test_a_motion_starts_and_ends_where_the_config_says(excite: Program) -> None:
    excite.good("optimize", SMOKE, "-o", "m.h5", "--motions", "1", *_spline("elbow: 1.5"))
    with h5py.File(excite.folder / "m.h5") as file:
        group = file["motions/1"]
        q, v, a = (group[name][()] for name in "qva")
    end = POSTURE.copy()
    end[2] = 1.5
    assert np.abs(q[[0, -1]] - [POSTURE, end]).max() < 1e-9
    assert max(np.abs(v[[0, -1]]).max(), np.abs(a[[0, -1]]).max()) < 1e-9


def test_a_closed_off_end_is_told_and_nothing_is_written(excite: Program) -> None:
    arguments = ("--set", BAND, "--set", "optimizer.max_seconds=1", "-o", "m.h5")
    told = excite.refused("optimize", SMOKE, *_spline("elbow: 1.5"), *arguments, status=1)
    assert all(each in told for each in ("keep_out, band", "of the way", "may be disconnected"))
    assert not (excite.folder / "m.h5").exists()


def test_an_entered_motion_is_simulated_from_rest_to_rest(
    excite: Program, two_motions: Run
) -> None:
    pytest.importorskip("mujoco")
    arguments = (SMOKE, two_motions.path, "-o", "d.h5", "--motion", "1", "--rate", "100")
    entry = ("--entry", "--from", "elbow=0.5, shoulder_yaw=-0.3", "--periods", "2")
    answer = excite.answer("simulate", *arguments, *entry)
    duration = answer["runs"][0]["duration"]
    assert 12.5 < duration < 30.0
    start = np.array([-0.3, 0.6, 0.5, 0.0, 0.05])
    with h5py.File(excite.folder / "d.h5") as file:
        q = file["runs/motion_1/q"][()]
    assert np.abs(q[[0, -1]] - start).max() < 5e-3
    assert np.abs(np.diff(q[[0, 5, -6, -1]], axis=0)[[0, 2]]).max() < 5e-3
    assert np.ptp(q, axis=0).min() > 0.02


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("elbov=0.5", "Did you mean 'elbow'"),
        ("elbow", "'elbow' is not joint=value"),
        ("elbow=far", "'elbow=far' is not joint=value"),
        ("elbow=9", r"--from\.elbow: 9 is outside its limits"),
    ],
)
def test_postures_that_cannot_be(text: str, message: str) -> None:
    robot = build_robot(load_spec(SMOKE).robot, SMOKE.parent)
    with pytest.raises(ConfigError, match=message):
        start_posture(robot, start_from(text, True) or {})


def test_joints_not_named_stay_at_the_posture() -> None:
    robot = build_robot(load_spec(SMOKE).robot, SMOKE.parent)
    given = start_from(" elbow=0.5 ,slide=0", True)
    assert given == {"elbow": 0.5, "slide": 0.0}
    assert np.array_equal(start_posture(robot, given), [0, 0.6, 0.5, 0, 0])


def test_without_entry_there_is_no_posture() -> None:
    assert start_from(None, True) == {}
    assert start_from(None, False) is None
    with pytest.raises(ConfigError, match="--from says where --entry starts"):
        start_from("elbow=0.5", False)
