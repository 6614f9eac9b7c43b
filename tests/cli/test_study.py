"""`excite study` as a user runs it."""

import csv
import json

import numpy as np
import pytest

from excite_cli.config.load_spec import load_spec
from excite_cli.measurement.hdf5_writer import write_dataset
from excite_cli.robot.model import build_robot
from excite_cli.simulation.build import true_inertias
from excite_cli.store.result_file import read_result
from tests.cli.program import SMOKE, Program
from tests.identification.synthetic import measured

BRIEF = (
    "--set", "optimizer.max_iterations=4", "--set", "sequence.motions=1", "--set",
    "constraints.self_collision=null",
)  # fmt: skip


def test_a_study_of_settings(excite: Program) -> None:
    vary = ("--vary", "seed=2", "--vary", "sampling.cost.samples=60,3")
    asked = ("study", SMOKE, *BRIEF, *vary, "-o", "s")
    run = excite(*asked, "--json")
    assert run.returncode == 1, run.stderr
    answer = json.loads(run.stdout)
    good = [case for case in answer["cases"] if not case["failed"]]
    bad = [case for case in answer["cases"] if case["failed"]]
    assert [case["values"]["seed"] for case in good] == ["2"]
    assert answer["failed"] == len(bad) == 1
    assert all("3 samples of 5 rows" in case["error"] for case in bad)
    for case in good:
        stored = read_result(excite.folder / case["files"][0])
        assert stored.seed == int(case["values"]["seed"])
        assert stored.motions[-1].stacked_condition_number == case["condition_number"]
    rows = list(csv.DictReader((excite.folder / "s" / "study.csv").read_text().splitlines()))
    assert [row["case"] for row in rows] == [case["name"] for case in answer["cases"]]

    before = (excite.folder / good[0]["files"][0]).stat().st_mtime_ns
    again = excite(*asked, "--resume")
    assert again.returncode == 1
    assert "2 cases, 1 failed" in again.stdout
    assert (excite.folder / good[0]["files"][0]).stat().st_mtime_ns == before


@pytest.mark.long
def test_a_study_of_logs(excite: Program) -> None:
    robot = build_robot(load_spec(SMOKE).robot, SMOKE.parent)
    phi = true_inertias(robot, 0.2, seed=3)
    for name, seeds in (("first", (1, 2)), ("second", (3, 4))):
        data = measured(robot, phi, (), np.zeros(0), noise=0.1, seconds=6.0, seeds=seeds)
        write_dataset(excite.folder / f"{name}.h5", data, {})
    few = ("--set", "diagnosis.kinds=[spring]", "--set", "identification.method=ols")
    answer = excite.answer("study", SMOKE, "first.h5", "second.h5", *few)
    assert [case["name"] for case in answer["cases"]] == ["first", "second"]
    for case in answer["cases"]:
        assert 0 < case["identified_error"] < 0.2
        assert case["before"] == pytest.approx(case["identified_error"], rel=0.2)
        assert case["after"] == pytest.approx(case["before"], rel=0.01)  # nothing is missing
        assert case["effects"] == ""
        assert [name.split(".")[-2] for name in case["files"]] == ["diagnosis", "fit"]
        assert all((excite.folder / name).is_file() for name in case["files"])
    assert answer["output"] == "smoke_study"
