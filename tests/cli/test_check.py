import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from excite_cli.geometry.pair_distances import PairDistances
from tests.cli.conftest import Run
from tests.cli.program import SMOKE, Program


@pytest.fixture(scope="module")
def checked(tmp_path_factory: pytest.TempPathFactory, cache: Path, two_motions: Run) -> Any:
    """The answer of `excite check` at the default rate."""
    return Program(tmp_path_factory.mktemp("check"), cache).answer("check", SMOKE, two_motions.path)


def broken(excite: Program, path: Path, *more: str) -> list[Any]:
    """What is told of both motions of a file that is refused."""
    run = excite("check", SMOKE, path, *more, "--json")
    assert run.returncode == 1, run.stderr
    return json.loads(run.stdout)["motions"]  # type: ignore[no-any-return]


def altered(run: Run, folder: Path, change: Callable[[np.ndarray], None]) -> Path:
    """A copy of the result in which someone changed the coefficients of motion 2."""
    path = folder / "altered.h5"
    path.write_bytes(run.path.read_bytes())
    with h5py.File(path, "a") as file:
        coefficients = file["motions/2/coefficients"][()]
        change(coefficients)
        file["motions/2/coefficients"][...] = coefficients
    return path


def test_stored_motions_keep_every_limit(checked: Any, two_motions: Run) -> None:
    """The optimiser's own judgement, repeated from the file alone; distances in a second way."""
    assert [motion["index"] for motion in checked["motions"]] == [1, 2]
    stored = json.loads(two_motions.process.stdout)["motions"]
    for motion, old in zip(checked["motions"], stored, strict=True):
        assert motion["violations"] == 0
        assert set(motion["margins"]) == set(motion["certified"])
        assert {"joint_position", "joint_torque", "self_collision"} <= set(motion["margins"])
        assert all(margin >= 0 for margin in motion["margins"].values())
        assert all(motion["certified"].values())
        assert {verdict["state"] for verdict in motion["verdicts"].values()} == {"proved"}
        assert motion["samples_differ"]["share"] < 1e-9
        assert motion["meshes"]["pairs"] > 0
        assert set(motion["margins"]) - {"mesh_collision"} == set(old["margins"])
        for name, margin in old["margins"].items():
            assert motion["margins"][name] == pytest.approx(margin["margin"], abs=1e-9)
        assert motion["second_path"].keys() == {"self_collision"}
        second = motion["second_path"]["self_collision"]
        assert second["agrees"]
        assert second["difference"] < 1e-9
        assert 250 <= second["instants"] < second["of"]


def test_a_wrong_distance_of_the_program_is_said_first(
    excite: Program, two_motions: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With distances of its own that are 0.1 mm too large."""
    own = PairDistances.distances
    wrong = lambda *given, **others: own(*given, **others) + 1e-4  # noqa: E731
    monkeypatch.setattr(PairDistances, "distances", wrong)
    run = excite("check", SMOKE, two_motions.path, "--no-meshes")
    assert run.returncode == 1
    assert run.stdout.startswith("motion_1: BROKEN: self_collision of ")
    assert "differ by 0.0001 m" in run.stdout.splitlines()[0]


def test_a_position_limit_broken_by_hand_is_found(excite: Program, two_motions: Run) -> None:
    """The mean of the elbow is moved by 9 rad, far outside [-2.6, 2.6]; no speed changes."""

    def shift(coefficients: np.ndarray) -> None:
        coefficients[-1, 2] += 9.0

    path = altered(two_motions, excite.folder, shift)
    first, second = broken(excite, path)
    assert first["violations"] == 0
    assert second["violations"] > 0
    assert second["certified"]["joint_position"] is False
    assert second["worst"]["joint_position"]["where"] == "elbow upper"
    with h5py.File(path) as file:
        c = file["motions/2/coefficients"][:, 2]
    angles = 2 * np.pi / 6.0 * np.outer(np.arange(0.0, 6.0, 1e-3), [1, 2, 3, 4])
    q = np.sin(angles) @ c[:4] + np.cos(angles) @ c[4:-1] + c[-1]
    assert second["margins"]["joint_position"] == pytest.approx(2.6 - q.max(), abs=1e-3)
    assert second["margins"]["joint_velocity"] >= 0


def test_two_milliseconds_between_samples_are_found(excite: Program, two_motions: Run) -> None:
    """The elbow swings a little more about its mean, until its speed is too high for 2 ms."""
    rates = 2 * np.pi / 6.0 * np.arange(1, 5)
    fine = np.arange(0.0, 6.0, 1e-4)
    angles = np.outer(fine, rates)

    def speed(c: np.ndarray) -> np.ndarray:
        return (np.cos(angles) * rates) @ c[:4] - (np.sin(angles) * rates) @ c[4:8]

    def swing(coefficients: np.ndarray) -> None:
        elbow = coefficients[:8, 2].copy()
        low, high = 0.5, 4.0
        for _ in range(60):
            share = (low + high) / 2
            lasting = (np.abs(speed(share * elbow)) > 3.0).sum() * 1e-4
            low, high = (share, high) if lasting < 0.002 else (low, share)
        coefficients[:8, 2] = share * elbow
        assert 0.001 < (np.abs(speed(share * elbow)) > 3.0).sum() * 1e-4 < 0.003

    path = altered(two_motions, excite.folder, swing)
    _, second = broken(excite, path, "--rate", "20", "--no-meshes")
    assert second["verdicts"]["joint_velocity"]["state"] == "broken"
    assert second["certified"]["joint_velocity"] is False
    assert -0.1 < second["margins"]["joint_velocity"] < 0
    assert second["worst"]["joint_velocity"]["where"].startswith("elbow")


def test_samples_that_someone_changed_are_found(excite: Program, two_motions: Run) -> None:
    path = excite.folder / "samples.h5"
    path.write_bytes(two_motions.path.read_bytes())
    with h5py.File(path, "a") as file:
        file["motions/1/q"][7, 1] += 1e-3
        when = file["motions/1/t"][7]
    first, second = broken(excite, path, "--no-meshes")
    assert first["violations"] == 1
    assert first["samples_differ"]["time"] == pytest.approx(when)
    assert second["violations"] == 0
    told = excite("check", SMOKE, path, "--no-meshes")
    assert "differ from its coefficients" in told.stdout


def test_meshes_that_touch_are_found(excite: Program, two_motions: Run) -> None:
    """The arm is folded back until its tool is in the base."""

    def fold(coefficients: np.ndarray) -> None:
        coefficients[:-1] *= 0.02
        coefficients[-1] = [0.87, -1.65, -2.39, -1.81, 0.07]

    path = altered(two_motions, excite.folder, fold)
    _, second = broken(excite, path)
    assert second["verdicts"]["mesh_collision"]["state"] == "broken"
    assert any(pair["touching"] for pair in second["meshes"]["near"])
    assert second["margins"]["mesh_collision"] <= 0


def test_random_instants_are_counted(excite: Program, two_motions: Run) -> None:
    answer = excite.answer(
        "check", SMOKE, two_motions.path, "--rate", "1", "--random", "3000", "--no-meshes"
    )
    alone = excite.answer("check", SMOKE, two_motions.path, "--rate", "1", "--no-meshes")
    assert answer["random"] == 3000
    for one, other in zip(answer["motions"], alone["motions"], strict=True):
        assert one["worst"]["joint_velocity"]["share"] < other["worst"]["joint_velocity"]["share"]
        assert one["violations"] == 0


@pytest.mark.long
def test_a_motion_in_a_controllers_format_is_judged(excite: Program, two_motions: Run) -> None:
    excite.good("export", two_motions.path, "-f", "csv", "--motion", "1", "-o", "m.csv")
    answer = excite.answer("check", SMOKE, "m.csv", "--no-meshes")
    (motion,) = answer["motions"]
    assert motion["violations"] == 0
    assert all(motion["certified"].values())
    lines = (excite.folder / "m.csv").read_text().splitlines()
    cells = lines[3000].split(",")
    cells[3] = repr(float(cells[3]) + 0.2)  # one sample of the elbow jumps
    lines[3000] = ",".join(cells)
    (excite.folder / "jump.csv").write_text("\n".join(lines))
    (motion,) = broken(excite, Path("jump.csv"), "--no-meshes")
    assert motion["verdicts"]["joint_acceleration"]["state"] == "broken"


def test_a_slowed_motion_has_room(excite: Program, two_motions: Run) -> None:
    answer = excite.answer("check", SMOKE, two_motions.path, "--slow", "0.3", "--no-meshes")
    for motion in answer["motions"]:
        assert motion["violations"] == 0
        worst = motion["worst"]["joint_velocity"]
        assert worst["share"] >= 0.7 - 1e-9
    assert (
        "of its planned speed" in excite("check", SMOKE, two_motions.path, "--slow", "0.3").stderr
    )
    assert "--slow 1.5" in excite.refused("check", SMOKE, two_motions.path, "--slow", "1.5")


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
    tighter = ("--set", "constraints.joint_limits.velocity=0.01")
    run = excite("check", SMOKE, two_motions.path, *tighter)
    assert run.returncode == 1
    assert "BROKEN" in run.stdout
    for line in run.stdout.splitlines():
        assert ("BROKEN" in line) == ("joint_velocity" in line)
