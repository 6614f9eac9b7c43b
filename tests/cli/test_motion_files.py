"""Files given where motions are wanted: units that cannot be right, and files of another kind."""

from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import Run
from tests.cli.program import SMOKE, Program

JOINTS = ("shoulder_yaw", "shoulder_pitch", "elbow", "wrist_roll", "slide")


def written(
    folder: Path, name: str, pace: float = 1.0, turn: float = 1.0, speed: float = 1.0
) -> str:
    """A slow swing of all joints; `pace` scales time, `turn` positions, `speed` the speeds."""
    t = np.linspace(0, 4, 401)
    middle = np.array([0.0, 0.6, 0.8, 0.0, 0.05])
    size = np.array([0.5, 0.3, 0.3, 0.5, 0.02])
    q = middle + size * (1 - np.cos(np.pi * t[:, None] / 2)) / 2
    v = size * np.pi / 4 * np.sin(np.pi * t[:, None] / 2)
    head = ["t", *(f"q_{joint}" for joint in JOINTS), *(f"dq_{joint}" for joint in JOINTS)]
    rows = np.column_stack([t * pace, q * turn, v * turn * speed])
    np.savetxt(folder / name, rows, delimiter=",", header=",".join(head), comments="")
    return name


def test_a_good_file_is_judged(excite: Program) -> None:
    run = excite.good("check", SMOKE, written(excite.folder, "m.csv"), "--no-meshes")
    told = " ".join(run.stderr.split())
    assert "m.csv: its accelerations are those of a spline of degree 5 through the samples" in told


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"pace": 1000.0}, "Give time in s"),
        ({"speed": 2.0}, "the speeds of"),
        ({"turn": 57.3}, "Are these degrees"),
    ],
    ids=["milliseconds", "speeds", "degrees"],
)
def test_units_that_cannot_be_right(excite: Program, changes: dict[str, float], words: str) -> None:
    name = written(excite.folder, "m.csv", **changes)
    assert words in excite.refused("optimize", SMOKE, "--prior", name, "-o", "out.h5")
    assert not (excite.folder / "out.h5").exists()


def test_files_of_another_kind_are_named(excite: Program, two_motions: Run) -> None:
    made = excite.good("simulate", SMOKE, two_motions.path, "--motion", "1", "-o", "data.h5")
    assert "RMS over joints [mrad]" in made.stdout  # units of headers are no markup
    assert "Effects" not in made.stdout  # there are none
    excite.good("identify", SMOKE, "data.h5", "-o", "fit.h5")
    assert "holds a fit, not a result" in excite.refused("check", SMOKE, "fit.h5")
    swapped = excite.refused("check", two_motions.path, SMOKE)
    assert "comes first: excite COMMAND CONFIG FILE" in swapped


def test_what_closes_can_be_repeated(excite: Program) -> None:
    config = excite.folder / "closed.yaml"
    config.write_text(
        f"robot: {{urdf: {SMOKE.parents[1] / 'data' / 'smoke_arm.urdf'}, "
        "posture: {shoulder_pitch: 0.6, elbow: 0.8, slide: 0.05}}\n"
        "trajectory: {family: bspline, duration: 3, control_points: 12, start: posture, "
        "end: posture}\nconstraints: {joint_limits: {acceleration: 10.0}}\n"
        "optimizer: {max_iterations: 3}\n"
    )
    run = excite("optimize", config, "-o", "closed.h5")
    assert "all constraints proved at every instant" in run.stderr
    answer = excite.answer("simulate", config, "closed.h5", "-o", "data.h5", "--periods", "3")
    assert answer["runs"][0]["duration"] == pytest.approx(9.0, abs=0.01)
