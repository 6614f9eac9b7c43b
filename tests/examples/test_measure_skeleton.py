"""The skeleton of docs/how-to/measure.md runs as it stands there."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.cli.program import ROOT

DRIVER = """
import os, signal, time
import numpy as np
JOINTS = ["shoulder", "elbow"]
def positions():
    return np.array([0.0, float(os.environ.get("ELBOW", "0.5"))])
def play(t, q):
    if "LATE" in os.environ:
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(5)
    return np.column_stack([t + 100.0, q, 2 * q])
def stop():
    print("stopped")
"""


@pytest.mark.parametrize(
    ("environment", "reason"),
    [
        ({}, ""),
        ({"LATE": "1"}, "the time limit is over"),
        ({"ELBOW": "0.7"}, "not stand at the start"),
    ],
)
def test_skeleton(tmp_path: Path, environment: dict[str, str], reason: str) -> None:
    page = (ROOT / "docs/how-to/measure.md").read_text(encoding="utf-8")
    block = re.search(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    assert block is not None
    (tmp_path / "measure.py").write_text(block.group(1))
    (tmp_path / "my_robot.py").write_text(DRIVER)
    header = ",".join(["t", *(f"{c}_{j}" for c in ("q", "dq") for j in ("shoulder", "elbow"))])
    motion = np.array([[0.0, 0.0, 0.5, 0.0, 0.0], [0.1, 0.1, 0.6, 0.0, 0.0]])
    np.savetxt(tmp_path / "m.csv", motion, delimiter=",", header=header, comments="")
    run = subprocess.run(
        [sys.executable, "measure.py", "m.csv", "d.csv"],
        cwd=tmp_path,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    data = tmp_path / "d.csv"
    if reason:
        assert run.returncode == 1
        assert reason in run.stderr.splitlines()[-1]
        assert not data.exists()
    else:
        assert run.returncode == 0, run.stderr
        assert data.read_text().startswith("t,q_shoulder,q_elbow,tau_shoulder,tau_elbow\n")
        np.testing.assert_allclose(np.loadtxt(data, delimiter=",", skiprows=1)[:, 3], [0, 0.2])
    assert run.stdout == ("" if "ELBOW" in environment else "stopped\n")
