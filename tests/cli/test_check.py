import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from tests.cli.conftest import Run
from tests.cli.program import SMOKE, Program


@pytest.fixture(scope="module")
def checked(tmp_path_factory: pytest.TempPathFactory, cache: Path, two_motions: Run) -> Any:
    """The answer of `excite check` at the default rate."""
    return Program(tmp_path_factory.mktemp("check"), cache).answer("check", SMOKE, two_motions.path)


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


def test_stored_motions_keep_every_limit(checked: Any) -> None:
    assert [motion["index"] for motion in checked["motions"]] == [1, 2]
    for motion in checked["motions"]:
        assert motion["violations"] == 0
        assert set(motion["margins"]) == set(motion["certified"])
        assert {"joint_position", "joint_torque", "self_collision"} <= set(motion["margins"])
        assert all(margin >= 0 for margin in motion["margins"].values())
        assert motion["certified"]["joint_position"] is True
        assert motion["certified"]["self_collision"] is False


def test_margins_are_those_stored(checked: Any, two_motions: Run) -> None:
    """The optimiser's own judgement, repeated from the file alone."""
    stored = json.loads(two_motions.process.stdout)["motions"]
    for told, motion in zip(checked["motions"], stored, strict=True):
        assert set(told["margins"]) == set(motion["margins"])
        for name, margin in told["margins"].items():
            assert margin == pytest.approx(motion["margins"][name]["margin"], abs=1e-9)


def test_a_position_limit_broken_by_hand_is_found(excite: Program, two_motions: Run) -> None:
    """The mean of the elbow is moved by 9 rad, far outside [-2.6, 2.6]; no speed changes."""

    def shift(coefficients: np.ndarray) -> None:
        coefficients[-1, 2] += 9.0

    path = altered(two_motions, excite.folder, shift)
    run = excite("check", SMOKE, path, "--json")
    assert run.returncode == 1
    first, second = json.loads(run.stdout)["motions"]
    assert first["violations"] == 0
    assert second["violations"] > 0
    assert second["certified"]["joint_position"] is False
    assert second["worst"]["joint_position"]["where"] == "elbow upper"
    with h5py.File(path) as file:
        c = file["motions/2/coefficients"][:, 2]
    duration = 6.0
    t = np.arange(0.0, duration, 1e-3)
    harmonics = len(c) // 2
    angles = 2 * np.pi / duration * np.outer(t, np.arange(1, harmonics + 1))
    q = np.sin(angles) @ c[:harmonics] + np.cos(angles) @ c[harmonics:-1] + c[-1]
    assert second["margins"]["joint_position"] == pytest.approx(2.6 - q.max(), abs=1e-3)
    assert second["margins"]["joint_velocity"] >= 0


def test_more_instants_find_no_larger_margin(
    excite: Program, two_motions: Run, checked: Any
) -> None:
    coarse = excite.answer("check", SMOKE, two_motions.path, "--rate", "2")
    assert coarse["rate"] == 2
    smaller = 0
    for one, other in zip(coarse["motions"], checked["motions"], strict=True):
        for name, margin in other["margins"].items():
            share = other["worst"][name]["share"]
            assert share <= one["worst"][name]["share"] + 1e-9
            smaller += margin < one["margins"][name] - 1e-4
    assert smaller > 0  # the rate counts


def test_a_tighter_config_is_checked_as_it_stands(excite: Program, two_motions: Run) -> None:
    run = excite(
        "check", SMOKE, two_motions.path, "--set", "constraints.joint_limits.velocity=0.01"
    )
    assert run.returncode == 1
    assert "BROKEN" in run.stdout
    for line in run.stdout.splitlines():
        assert ("BROKEN" in line) == ("joint_velocity" in line)


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
    run = excite("check", SMOKE, two_motions.path, "--set", change, "--set", "constraints={}")
    assert run.returncode == 2
    assert words in run.stderr
