"""Contestants of the race for exciting motions: what one did, and how FIGAROH is asked and read.

FIGAROH's figures are those of its own example (github.com/thanhndv212/figaroh-examples,
examples/ur10): limits of its URDF, `soft_lim`, attempts, iterations, waypoints and rates of its
config.
"""

import json
import math
import sys
import tempfile
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.program import ran
from excite_cli.constraints.base import Array
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
OURS = "excite"
OWN = "excite, own columns"
_DRIVER = Path(__file__).with_name("figaroh_motion_driver.py")
_TURN = math.pi
JOINTS = (
    *("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint"),
    *("wrist_1_joint", "wrist_2_joint", "wrist_3_joint"),
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
class States:
    """t (T,) [s] and q, v, a (T, n) of a motion."""

    t: Array
    q: Array
    v: Array
    a: Array


class Measure(IntEnum):
    """Whose columns are called base parameters, as columns of a curve."""

    FIGAROH = 2
    EXCITE = 3

    @property
    def words(self) -> str:
        return {Measure.FIGAROH: "FIGAROH's", Measure.EXCITE: "excite's"}[self]


@dataclass(frozen=True)
class Race:
    """One contestant, one seed.

    curve (N, 4): wall and processor time [s] since its clock started and condition number by
    FIGAROH's columns and by excite's, a row for every admissible motion that was better than all
    before in either.
    `wall`, `processor`: of the whole search; `before`: processor time until the clock started.
    fine: its best admissible motion at 1 kHz; None where it has none. samples: the same at the
    instants of the cost. `words`: what else is to be told.
    """

    contestant: str
    seed: int
    curve: Array
    wall: float
    processor: float
    before: float
    fine: States | None = None
    samples: States | None = None
    columns: tuple[int, ...] | None = None
    proved: bool = False
    words: dict[str, str] = field(default_factory=dict)

    def best(self, measure: Measure) -> float:
        """Its lowest admissible condition number; infinite where it found no motion."""
        return float(self.curve[:, measure].min()) if len(self.curve) else np.inf

    def reached(self, target: float, measure: Measure) -> tuple[float, float]:
        """Wall and processor time [s] at which `target` was reached; infinite where it was not."""
        there = np.flatnonzero(self.curve[:, measure] <= target * (1 + 1e-12))
        if not len(there):
            return np.inf, np.inf
        wall, processor = self.curve[there[0], :2].tolist()
        return wall, processor

    def at(self, processor: float, measure: Measure) -> float:
        """Lowest condition number after so much processor time [s]."""
        there = self.curve[self.curve[:, 1] <= processor, measure]
        return float(there.min()) if len(there) else np.inf


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
        answer = answered([str(self.python), str(_DRIVER)], request)
        names = {CLEAR: "", CLAIMED: "claimed_"} if self_collision else {BLIND: ""}
        return [_of_figaroh(name, seed, answer, prefix) for name, prefix in names.items()]


def find(python: Path | None, description: RobotDescription) -> Figaroh | None:
    """FIGAROH in the interpreter named, or in this one; None where it cannot be imported."""
    interpreter = Path(sys.executable) if python is None else python.absolute()
    try:
        done = ran([interpreter, "-c", "import figaroh.optimal.base_optimal_trajectory, cyipopt"])
    except OSError:
        return None
    return None if done.status else Figaroh(interpreter, description)


def _of_figaroh(name: str, seed: int, answer: dict[str, Any], prefix: str) -> Race:
    fine, samples = (
        States(*(answer[f"{prefix}{kind}_{symbol}"] for symbol in "tqva"))
        if f"{prefix}fine_t" in answer
        else None
        for kind in ("fine", "sample")
    )
    kept = np.delete(np.arange(10 * len(JOINTS)), answer["eliminated"])
    words = {
        "start": "clear" if answer["start_is_clear"] else "in collision",
        "says": "accepts its result" if answer["found"] else "rejects its result",
    }
    columns = tuple(kept[answer["base"]].tolist())
    curve = answer[f"{prefix}curve"]
    return Race(name, seed, curve, *times_of(answer), fine, samples, columns, words=words)


def package_folders(description: RobotDescription) -> list[str]:
    """Where Pinocchio looks for `package://NAME/…`: in a folder that holds NAME, or in NAME."""
    folders = description.package_dirs
    return [*folders, *(str(Path(folder).parent) for folder in folders)]


def answered(program: list[str], request: dict[str, Any]) -> dict[str, Any]:
    """What a driver answers, run on one thread in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        asked, answered = Path(folder, "request.json"), Path(folder, "answer.npz")
        asked.write_text(json.dumps(request))
        done = ran([*program, asked, answered])
        if done.status or not answered.is_file():
            raise SystemExit(f"{program[-1]} failed:\n{done.errors.strip()[-2000:]}")
        with np.load(answered) as found:
            return dict(found)


def times_of(answer: dict[str, Any]) -> list[float]:
    """Wall and processor time of the search, and processor time before it [s]."""
    return [float(answer[name]) for name in ("wall", "processor", "processor_before")]
