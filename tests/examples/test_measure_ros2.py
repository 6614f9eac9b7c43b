"""`examples/measure_ros2.py` as a user runs it, on a stand-in of ROS 2, and on ROS 2 where it is.

The stand-in has no network and no middleware: it holds that the script uses the names, arguments
and fields of rclpy, and what it does in doubt. On ROS 2 the same script meets `ros2_controller`.
"""

import importlib.util
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.cli.program import ROOT, Program
from tests.examples.conftest import Planned, assert_friction_is_found, refusal

SCRIPT = ROOT / "examples" / "measure_ros2.py"
Start = Callable[..., subprocess.Popen[str]]
ROS = importlib.util.find_spec("rclpy") and importlib.util.find_spec("control_msgs")


@pytest.fixture
def start(smoke_arm: Planned, tmp_path: Path) -> Start:
    """Starts the script on a stand-in with these faults; its log is `data.csv`."""

    def run(
        motion: Path = smoke_arm.motion, more: tuple[str, ...] = (), off: float = 0.0, **faults: Any
    ) -> subprocess.Popen[str]:
        told = {
            "urdf": str(smoke_arm.urdf),
            "joints": smoke_arm.joints,
            "start": (smoke_arm.start + off).tolist(),
            "saw": str(tmp_path / "saw.txt"),
            **faults,
        }
        return subprocess.Popen(
            [sys.executable, str(SCRIPT), *more, str(motion), str(tmp_path / "data.csv")],
            env={
                **os.environ,
                "PYTHONPATH": os.pathsep.join([str(ROOT / "tests/examples/ros2"), str(ROOT)]),
                "STAND_IN": json.dumps(told),
            },
            stderr=subprocess.PIPE,
            text=True,
        )

    return run


def assert_is_a_log(data: Path, planned: Planned, late: float) -> None:
    """From rest before the motion to rest after it."""
    log = np.genfromtxt(data, delimiter=",", names=True, deletechars="")
    t = log["t"]
    assert t[0] > 1.6e9  # stamps of the messages
    assert t[-1] - t[0] == pytest.approx(planned.seconds + 1.0, abs=late)
    for still in (log[:20], log[-10:]):
        assert max(np.abs(still[f"dq_{joint}"]).max() for joint in planned.joints) < 0.02


def test_a_motion_is_played_recorded_and_identified(
    start: Start, smoke_arm: Planned, tmp_path: Path, excite: Program
) -> None:
    process = start(off=0.05)
    assert process.wait(60) == 0, process.communicate()[1]
    way_there, motion = (tmp_path / "saw.txt").read_text().splitlines()[::2]
    assert (way_there, motion) == (
        "accepted 1 for 1.5 s",
        f"accepted {smoke_arm.instants} for {smoke_arm.seconds:.1f} s",
    )
    assert_is_a_log(tmp_path / "data.csv", smoke_arm, late=0.1)
    assert_friction_is_found(excite, smoke_arm, tmp_path / "data.csv")


@pytest.mark.parametrize(
    ("faults", "reason", "seen"),
    [
        ({"jam": 1.0}, r"the controller gave up \(-4\)|off the motion", "ended -4|cancelled"),
        ({"slow": 0.5}, "off the motion", "cancelled True"),
        ({"silent": 1.0}, "no joint states of ", "cancelled"),
        ({"effort": False}, "lack positions, velocities or efforts", None),
        ({"off": 0.2}, "the robot is 0.20 off the start", None),
        (
            {"off": 0.05, "jam": -1.0},
            "does not get to the start",
            "1 for 1.5 s\nended 0\n$",
        ),
    ],
)
def test_doubts(
    start: Start, tmp_path: Path, faults: dict[str, Any], reason: str, seen: str | None
) -> None:
    assert re.search(reason, refusal(start(**faults)))
    assert not (tmp_path / "data.csv").exists()
    saw = tmp_path / "saw.txt"
    if seen is None:
        assert not saw.exists()
    else:
        assert re.search(seen, saw.read_text())


def test_what_is_refused_before_anything_moves(
    start: Start, smoke_arm: Planned, tmp_path: Path
) -> None:
    joint = smoke_arm.joints[0]
    other = smoke_arm.edited(tmp_path / "other.csv", joint, "knee")
    assert "no joint states of knee" in refusal(start(other))
    assert "--entry" in refusal(start(smoke_arm.half(tmp_path / "half.csv")))
    assert "there is no action server /arm" in refusal(start(more=("--action", "/arm")))
    assert not (tmp_path / "saw.txt").exists()


def test_a_signal_cancels_the_motion(start: Start, tmp_path: Path) -> None:
    process, saw = start(pause=0.002), tmp_path / "saw.txt"
    while not saw.exists():
        assert process.poll() is None
        time.sleep(0.01)
    time.sleep(0.5)
    process.terminate()
    process.send_signal(signal.SIGINT)  # Ctrl-C reaches the command and what started it
    _, stderr = process.communicate(timeout=60)
    # On a busy machine the second may come when Python has put its own handlers back to end.
    assert process.returncode in (1, -signal.SIGINT)
    assert "stopped by SIG" in stderr
    assert saw.read_text().splitlines()[-1] == "cancelled True"


@pytest.mark.skipif(not ROS, reason="needs ROS 2 with rclpy and control_msgs")
@pytest.mark.parametrize(("faults", "reason"), [((), ""), (("jam=1",), "off the motion|gave up")])
def test_on_ros(smoke_arm: Planned, tmp_path: Path, faults: tuple[str, ...], reason: str) -> None:
    given = str(smoke_arm.urdf), ",".join(smoke_arm.joints), ",".join(map(str, smoke_arm.start))
    environment = {**os.environ, "ROS_DOMAIN_ID": str(os.getpid() % 100 + 1)}
    server = subprocess.Popen(
        [sys.executable, "-m", "tests.examples.ros2_controller", *given, *faults],
        cwd=ROOT,
        env=environment,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert server.stdout is not None
        assert server.stdout.readline() == "ready\n"
        data = tmp_path / "data.csv"
        run = subprocess.run(
            [sys.executable, str(SCRIPT), str(smoke_arm.motion), str(data)],
            env=environment,
            capture_output=True,
            text=True,
            timeout=60,
        )
    finally:
        server.kill()
        server.communicate()
    if reason:
        assert run.returncode == 1
        assert re.search(reason, run.stderr)
    else:
        assert run.returncode == 0, run.stderr
        assert_is_a_log(data, smoke_arm, late=1.0)  # in real time
