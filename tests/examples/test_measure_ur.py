"""`examples/measure_ur.py` as a user runs it, with the real `ur_rtde`, on a stand-in on sockets."""

import signal
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from subprocess import PIPE, Popen

import numpy as np
import pytest

from tests.cli.program import ROOT, Program
from tests.examples.conftest import Planned, assert_friction_is_found, refusal
from tests.examples.tracking_arm import TrackingArm
from tests.examples.ur_controller import TORQUE_PER_AMPERE, UrController

pytest.importorskip("rtde_control", reason="needs ur_rtde")
RATE = 125.0
SCRIPT = ROOT / "examples" / "measure_ur.py"


@pytest.fixture
def robot(ur10: Planned) -> Iterator[UrController]:
    arm = TrackingArm(ur10.urdf, ur10.joints, 1.0 / RATE)
    arm.place(ur10.start)
    controller = UrController(arm)
    yield controller
    controller.close()


def started(robot: UrController, motion: Path, data: Path, *more: str) -> Popen[str]:
    command = [sys.executable, SCRIPT, "--host", robot.host, "--rate", str(RATE), *more]
    return Popen([*map(str, command), str(motion), str(data)], stderr=PIPE, text=True)


def begun(robot: UrController, planned: Planned, folder: Path, moved: float) -> Popen[str]:
    """A run whose motion goes on, at `moved` rad/s or more by now."""
    process = started(robot, planned.motion, folder / "data.csv")
    while not robot.servoing or robot.moved < moved:
        assert process.poll() is None
        time.sleep(0.01)
    return process


def until(condition: Callable[[], bool]) -> None:
    """Waits for it, five seconds at most."""
    deadline = time.monotonic() + 5.0
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.05)
    assert condition()


def test_a_motion_is_played_recorded_and_identified(
    robot: UrController, ur10: Planned, tmp_path: Path, excite: Program
) -> None:
    data = tmp_path / "data.csv"
    robot.stand(ur10.start + 0.05 * np.eye(6)[0])
    process = started(robot, ur10.motion, data)
    assert process.wait(120) == 0
    assert robot.ended == "script"
    way_there, speed = robot.moved_to
    np.testing.assert_allclose(way_there, ur10.start)
    assert speed == pytest.approx(0.1)  # rad/s: slowly
    log = np.genfromtxt(data, delimiter=",", names=True, deletechars="")
    t = log["t"]
    assert t[0] > 1000.0  # the controller's clock
    assert t[-1] - t[0] == pytest.approx(ur10.seconds + 1.0, abs=0.05)
    assert np.median(np.diff(t)) == pytest.approx(1 / RATE)
    for still in (log[:40], log[-20:]):
        assert max(np.abs(still[f"dq_{joint}"]).max() for joint in ur10.joints) < 0.02
    settings = "torque=current", "channels={tau: current}", f"torque_constant={TORQUE_PER_AMPERE}"
    assert_friction_is_found(excite, ur10, data, *(f"measurement.{words}" for words in settings))


@pytest.mark.parametrize(
    ("fault", "value", "reason"),
    [
        ("protective_stop_at", 1.5, "protective or emergency stop"),
        ("hang_up_at", 1.5, "the connection is lost"),
        ("unplug_at", 1.5, "the connection is lost"),
        ("scaling", 0.5, "speed is scaled down"),
        ("limit", 0.1, "leaves the robot's safety limits"),
        ("jam_at", 1.5, "rad off the motion"),
    ],
)
def test_doubts(
    robot: UrController, ur10: Planned, tmp_path: Path, fault: str, value: float, reason: str
) -> None:
    setattr(robot, fault, value)
    data = tmp_path / "data.csv"
    assert reason in refusal(started(robot, ur10.motion, data))
    assert not data.exists()
    until(lambda: not robot.servoing)  # told to stop, or its watchdog


def test_what_is_refused_before_anything_moves(
    robot: UrController, ur10: Planned, tmp_path: Path
) -> None:
    data = tmp_path / "data.csv"
    gap = ur10.edited(tmp_path / "gap.csv", "0.5,", ",")
    assert "has gaps" in refusal(started(robot, gap, data))
    other = ur10.edited(tmp_path / "other.csv", "elbow", "knee")
    assert "knee_joint" in refusal(started(robot, other, data))
    robot.stand(ur10.start + 0.3)
    assert "0.30 rad off the start" in refusal(started(robot, ur10.motion, data))
    assert robot.moved < 1e-9
    robot.close()
    assert "Could not connect" in refusal(started(robot, ur10.motion, data))


def test_a_signal_stops_the_robot(robot: UrController, ur10: Planned, tmp_path: Path) -> None:
    process = begun(robot, ur10, tmp_path, 0.1)
    process.terminate()
    process.send_signal(signal.SIGINT)  # Ctrl-C reaches the command and what started it
    assert "stopped by SIG" in refusal(process)
    assert (robot.servoing, robot.ended) == (0.0, "script")


def test_a_killed_process_leaves_a_robot_that_stops(
    robot: UrController, ur10: Planned, tmp_path: Path
) -> None:
    process = begun(robot, ur10, tmp_path, 0.0)
    process.kill()
    process.communicate()
    until(lambda: robot.ended == "watchdog")
