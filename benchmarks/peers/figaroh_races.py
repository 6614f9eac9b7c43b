"""FIGAROH as a contestant: how it is asked, started and read.

The figures are those of its own example (github.com/thanhndv212/figaroh-examples, examples/ur10):
limits of its URDF, `soft_lim`, attempts, iterations, waypoints and rates of its config.
"""

import json
import math
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.peers.race import Race, States
from benchmarks.program import ran
from excite_cli.robot.description import RobotDescription

HOW_TO_INSTALL = """\
FIGAROH was not found. Its optimiser needs IPOPT; on Debian and Ubuntu:
    apt-get install coinor-libipopt-dev liblapack-dev libblas-dev pkg-config gcc
    python -m venv figaroh-env && figaroh-env/bin/pip install figaroh==1.0.2 cyipopt
then give --figaroh-python figaroh-env/bin/python. (Its pin may differ from ours: keep it in an
environment of its own.)"""

CLEAR = "FIGAROH"
CLAIMED = "FIGAROH, its check points only"
BLIND = "FIGAROH, self-collision off"
_DRIVER = Path(__file__).with_name("figaroh_driver.py")
_TURN = math.pi
JOINTS = (
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
)
# Of the example's URDF, joint by joint: position [rad], velocity [rad/s], effort [N·m].
_POSITION = (2 * _TURN, 2 * _TURN, _TURN, 2 * _TURN, 2 * _TURN, 2 * _TURN)
_VELOCITY = (2 / 3 * _TURN, 2 / 3 * _TURN, _TURN, _TURN, _TURN, _TURN)
_EFFORT = (330.0, 330.0, 150.0, 56.0, 56.0, 56.0)
LIMITS: dict[str, dict[str, Any]] = {
    name: {"position": [-position, position], "velocity": velocity, "effort": effort}
    for name, position, velocity, effort in zip(JOINTS, _POSITION, _VELOCITY, _EFFORT, strict=True)
}
# Of the example's config; FIGAROH reads it and does not enforce it [rad/s²].
ACCELERATION = 40.0
PROBLEM = {"soft_lim": 0.1, "max_attempts": 500, "max_iterations": 100}
TRAJECTORY = {"waypoints": 7, "frequency": 20, "segment_duration": 2.0}
# FIGAROH's own option that spares exact distances beyond 2 cm; several times faster.
SCREEN = {"collision_screen": 0.02}


@dataclass(frozen=True)
class Figaroh:
    """Its interpreter, and the robot it is given."""

    python: Path
    description: RobotDescription

    def races(
        self, seed: int, self_collision: bool, seconds: float, columns: tuple[int, ...]
    ) -> list[Race]:
        """One segment from the random start of `seed`; at most `seconds` of processor time.

        columns: those of the regressor that we call base parameters, for the second measure.

        With self-collision the same run counts twice: by what FIGAROH accepts, and taken at the
        word of its optimiser, which looks at the meshes at the ends of segments only.
        """
        request = {
            "urdf": str(self.description.path),
            "package_dirs": package_folders(self.description),
            "joints": JOINTS,
            "limits": LIMITS,
            "self_collision": self_collision,
            "seed": seed,
            "seconds": seconds,
            "columns": columns,
            "problem": PROBLEM | SCREEN,
            "trajectory": TRAJECTORY,
        }
        answer = run_driver([str(self.python), str(_DRIVER)], request)
        if not self_collision:
            return [_race(BLIND, seed, answer)]
        return [_race(CLEAR, seed, answer), _race(CLAIMED, seed, answer, "claimed_")]


def _race(name: str, seed: int, answer: dict[str, Any], prefix: str = "") -> Race:
    found = f"{prefix}fine_t" in answer
    kept = np.delete(np.arange(10 * len(JOINTS)), answer["eliminated"])
    return Race(
        contestant=name,
        seed=seed,
        curve=answer[f"{prefix}curve"],
        wall=float(answer["wall"]),
        processor=float(answer["processor"]),
        before=float(answer["processor_before"]),
        fine=_states(answer, f"{prefix}fine") if found else None,
        samples=_states(answer, f"{prefix}sample") if found else None,
        columns=tuple(kept[answer["base"]].tolist()),
        words={
            "iterations": int(answer["iterations"]),
            "start": "clear" if answer["start_is_clear"] else "in collision",
            "says": "accepts its result" if answer["found"] else "rejects its result",
        },
    )


def _states(answer: dict[str, Any], kind: str) -> States:
    return States(*(answer[f"{kind}_{symbol}"] for symbol in "tqva"))


def package_folders(description: RobotDescription) -> list[str]:
    """Where Pinocchio looks for `package://NAME/…`: in a folder that holds NAME, or in NAME."""
    folders = description.package_dirs
    return [*folders, *(str(Path(folder).parent) for folder in folders)]


def run_driver(program: list[str], request: dict[str, Any]) -> dict[str, Any]:
    """What a driver answers, run on one thread in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        asked, answered = Path(folder, "request.json"), Path(folder, "answer.npz")
        asked.write_text(json.dumps(request))
        done = ran([*program, asked, answered])
        if done.status or not answered.is_file():
            raise SystemExit(f"{program[-1]} failed:\n{done.errors.strip()[-2000:]}")
        with np.load(answered) as found:
            return dict(found)


def find(python: Path | None, description: RobotDescription) -> Figaroh | None:
    """FIGAROH in the interpreter named, or in this one; None where it cannot be imported."""
    interpreter = Path(sys.executable) if python is None else python.absolute()
    asked = "import figaroh.optimal.base_optimal_trajectory, cyipopt"
    try:
        done = ran([interpreter, "-c", asked])
    except OSError:
        return None
    return None if done.status else Figaroh(interpreter, description)
