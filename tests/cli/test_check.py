from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from tests.cli.conftest import Run
from tests.cli.program import SMOKE, Program


def altered(run: Run, folder: Path, change: Callable[[np.ndarray], None]) -> Path:
    """A copy of the result in which someone changed the coefficients of motion 2."""
    path = folder / "altered.h5"
    path.write_bytes(run.path.read_bytes())
    with h5py.File(path, "a") as file:
        data = file["motions/2/coefficients"]
        coefficients = data[()]
        change(coefficients)
        data[...] = coefficients
    return path


def test_stored_motions_keep_every_limit(excite: Program, two_motions: Run) -> None:
    answer = excite.answer("check", SMOKE, two_motions.path)
    assert [motion["index"] for motion in answer["motions"]] == [1, 2]
    for motion in answer["motions"]:
        assert motion["violations"] == 0
        assert set(motion["margins"]) == set(motion["certified"])
        assert {"joint_position", "joint_torque", "self_collision"} <= set(motion["margins"])
        assert all(margin >= 0 for margin in motion["margins"].values())
        assert motion["certified"]["joint_position"] is True
        assert motion["certified"]["self_collision"] is False


def test_margins_are_those_stored(excite: Program, two_motions: Run) -> None:
    """The optimiser's own judgement, repeated from the file alone."""
    import json

    stored = json.loads(two_motions.process.stdout)["motions"]
    for told, motion in zip(
        excite.answer("check", SMOKE, two_motions.path)["motions"], stored, strict=True
    ):
        for name, margin in told["margins"].items():
            assert margin == pytest.approx(motion["margins"][name]["margin"], abs=1e-9)


def test_a_position_limit_broken_by_hand_is_found(excite: Program, two_motions: Run) -> None:
    """The elbow's mean is moved by 9 rad: far outside [-2.6, 2.6], and nothing else moves faster."""

    def shift(coefficients: np.ndarray) -> None:
        coefficients[-1, 2] += 9.0

    path = altered(two_motions, excite.folder, shift)
    run = excite("check", SMOKE, path)
    assert run.returncode == 1
    (row,) = [
        line for line in run.stdout.splitlines() if "joint_position" in line and "BROKEN" in line
    ]
    assert "elbow upper" in row
    assert "violations" in run.stdout
    with h5py.File(path) as file:
        c = file["motions/2/coefficients"][()]
    told = excite("check", SMOKE, path, "--json")
    assert told.returncode == 1
    import json

    first, second = json.loads(told.stdout)["motions"]
    assert first["violations"] == 0
    assert second["violations"] > 0
    assert second["certified"]["joint_position"] is False
    t = np.arange(0.0, 6.0, 1e-3)
    harmonics = (len(c) - 1) // 2
    rates = 2 * np.pi / 6.0 * np.arange(1, harmonics + 1)
    q = np.sin(np.outer(t, rates)) @ c[:harmonics, 2] + c[-1, 2]
    q += np.cos(np.outer(t, rates)) @ c[harmonics:-1, 2]
    assert second["margins"]["joint_position"] == pytest.approx(2.6 - q.max(), abs=1e-3)
    assert second["margins"]["joint_velocity"] >= 0


def test_a_peak_between_the_optimisers_instants_is_found(excite: Program, two_motions: Run) -> None:
    """The coarse rate misses what the controller rate sees."""
    coarse = excite("check", SMOKE, two_motions.path, "--rate", "2", "--json")
    fine = excite("check", SMOKE, two_motions.path, "--rate", "2000", "--json")
    import json

    few, many = (json.loads(run.stdout)["motions"] for run in (coarse, fine))
    for one, other in zip(few, many, strict=True):
        for name, margin in other["margins"].items():
            assert margin <= one["margins"][name] + 1e-9


def test_a_tighter_config_is_checked_as_it_stands(excite: Program, two_motions: Run) -> None:
    run = excite(
        "check", SMOKE, two_motions.path, "--set", "constraints.joint_limits.velocity=0.01"
    )
    assert run.returncode == 1
    assert "joint_velocity" in run.stdout


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("robot.joints=[elbow, slide]", "moves other joints"),
        ("trajectory.harmonics=3", "another trajectory"),
    ],
)
def test_a_file_of_another_problem(
    excite: Program, two_motions: Run, change: str, words: str
) -> None:
    run = excite("check", SMOKE, two_motions.path, "--set", change)
    assert run.returncode == 2
    assert words in run.stderr
