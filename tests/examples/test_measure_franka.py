"""`examples/measure_franka.py` as a user runs it, on a stand-in of pylibfranka."""

import importlib
import json
import os
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

SCRIPT, STAND_IN = ROOT / "examples" / "measure_franka.py", ROOT / "tests" / "examples" / "franka"
Start = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def start(panda: Planned, tmp_path: Path) -> Start:
    """Starts the script on a stand-in with these faults; its log is `data.csv`."""

    def run(motion: Path = panda.motion, off: float = 0.0, **faults: Any) -> subprocess.Popen[str]:
        told = {"urdf": str(panda.urdf), "joints": panda.joints, "saw": str(tmp_path / "saw.txt"),
                "start": (panda.start + off * np.eye(7)[1]).tolist(), **faults}  # fmt: skip
        return subprocess.Popen(
            [sys.executable, SCRIPT, "--host", "robot", motion, tmp_path / "data.csv"],
            env={**os.environ, "PYTHONPATH": f"{STAND_IN}{os.pathsep}{ROOT}",
                 "STAND_IN": json.dumps(told)},
            stderr=subprocess.PIPE,
            text=True,
        )  # fmt: skip

    return run


def test_a_motion_is_played_recorded_and_identified(
    start: Start, panda: Planned, tmp_path: Path, excite: Program
) -> None:
    process, data = start(off=0.05), tmp_path / "data.csv"
    _, stderr = process.communicate(timeout=120)
    assert process.returncode == 0, stderr
    assert (tmp_path / "saw.txt").read_text() == "finished"
    log = np.genfromtxt(data, delimiter=",", names=True, deletechars="")
    assert log["t"][0] == pytest.approx(52.0, abs=0.01)  # the robot's clock, at the start by then
    assert log["t"][-1] - log["t"][0] == pytest.approx(panda.seconds + 1.0, abs=0.01)
    assert np.diff(log["t"]) == pytest.approx(1e-3)
    for still in (log[200:400], log[-200:]):
        assert max(np.abs(still[f"dq_{joint}"]).max() for joint in panda.joints) < 0.02
    for settings in ((), ("measurement.preset=franka",)):
        assert_friction_is_found(excite, panda, data, *settings)


@pytest.mark.parametrize(
    ("faults", "reason", "saw"),
    [
        ({"refuse": True}, "Connection to FCI refused", None),
        (
            {"mode": "Reflex", "errors": "joint_reflex"},
            "in mode Reflex (joint_reflex);",
            None,
        ),
        ({"off": 0.2}, "the robot is 0.20 rad off the start", None),
        ({"reflex": 3.0}, "aborted by reflex", "stopped"),
        ({"lost": 3.0}, "UDP receive: Timeout", "stopped"),
        ({"jam": 3.0}, "rad off the motion", "stopped"),
    ],
)
def test_doubts(
    start: Start, tmp_path: Path, faults: dict[str, Any], reason: str, saw: str | None
) -> None:
    assert reason in refusal(start(**faults))
    assert not (tmp_path / "data.csv").exists()
    seen = tmp_path / "saw.txt"
    assert (seen.read_text() if seen.exists() else None) == saw


def test_motions_of_other_robots_are_refused(start: Start, panda: Planned, tmp_path: Path) -> None:
    last = panda.joints[-1]
    fewer = panda.edited(tmp_path / "fewer.csv", f"q_{last}", f"x_{last}")
    assert "the robot has 7" in refusal(start(fewer))
    assert "--entry" in refusal(start(panda.half(tmp_path / "half.csv")))
    assert "has gaps" in refusal(start(panda.edited(tmp_path / "gap.csv", "0.5,", ",")))
    assert not (tmp_path / "saw.txt").exists()


def test_a_signal_stops_the_robot(start: Start, tmp_path: Path) -> None:
    process, saw = start(pause=0.001), tmp_path / "saw.txt"
    while not saw.exists():
        assert process.poll() is None
        time.sleep(0.01)
    process.terminate()
    assert "stopped by SIGTERM" in refusal(process)
    assert saw.read_text() == "stopped"


def test_the_stand_in_has_nothing_that_pylibfranka_lacks(monkeypatch: pytest.MonkeyPatch) -> None:
    real = pytest.importorskip("pylibfranka")
    monkeypatch.syspath_prepend(STAND_IN)
    monkeypatch.delitem(sys.modules, "pylibfranka")
    ours = importlib.import_module("pylibfranka")
    for name in ("Robot", "ActiveControlBase", "JointPositions", "Duration", "RobotMode",
                 "RealtimeConfig", "ControllerMode"):  # fmt: skip
        public = {each for each in vars(getattr(ours, name)) if not each.startswith("_")}
        assert public <= set(dir(getattr(real, name))), name
