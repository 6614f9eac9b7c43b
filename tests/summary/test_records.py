"""Records read well in a console, and show the terminal's tables in a notebook."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import excite_cli
from excite_cli import (
    Case,
    Effect,
    Problem,
    Result,
    check,
    compare_random,
    describe_robot,
    load_case,
    load_problem,
    motions_of,
    plan,
    plan_after,
    propose,
    verify_gradient,
    write_result,
)
from excite_cli.api.checking import check_answer
from excite_cli.api.comparing import comparison_answer
from excite_cli.api.planning import plan_answer
from excite_cli.campaign.measure import Measure
from excite_cli.cli.console import Terminal
from excite_cli.identification.errors_of_torque import Errors
from excite_cli.measurement.dataset import Run
from excite_cli.measurement.run_identity import Origin
from excite_cli.scoring.changes import Change
from excite_cli.scoring.records import ScoredRun
from excite_cli.scoring.thresholds import Thresholds
from excite_cli.shown.answer import Answer, Shown, Table, _found
from excite_cli.summary.motions import result_parts
from excite_cli.workers.base import Workers
from tests.diagnosis.synthetic_diagnosis import make_diagnosis, smoke_spec

ROOT = Path(__file__).resolve().parents[2]
SMOKE = ROOT / "configs" / "smoke.yaml"
RUN = Run(
    "elbow",
    np.arange(5) / 10,
    np.zeros((5, 3)),
    np.zeros((5, 3)),
    origin=Origin("log.h5", "/runs/elbow"),
)
CHANGE = Change(
    "viscous of elbow", "elbow", "N·m·s/rad", 1.0, 2.0, 0.1, 1e-6, "may", (1.0, 2.0), (0.1, 0.1)
)
ELBOW = {"elbow": 0.02}
ERRORS = Errors(0.02, 0.02, ELBOW, ELBOW, ELBOW, ELBOW, (0.01, 0.03))
SCORED = ScoredRun(
    "monday", "monday.h5", 6.0, ERRORS, allowed={"elbow": 0.03}, ratio={"elbow": 3.0},
    peak={"elbow": 1.0}, left=("elbow",),
)  # fmt: skip
THRESHOLDS = Thresholds(("a", "b"), np.ones((2, 4)), np.array([3.0, 4.0]), 0.5, 0.02)
# Settings, and records of a few words, which Python itself shows well.
SHORT = {"Drawing", "Exported", "Level", "Note", "Report", "Serving", "SimulationSettings", "View"}
SHORT |= {"Take", "Answer", "CaseRecord", "SelftestCase"}
BRIEF = ["optimizer.max_iterations=6", "sequence.motions=1"]


@pytest.fixture(scope="module")
def problem() -> Problem:
    return load_problem(SMOKE, BRIEF)


@pytest.fixture(scope="module")
def result(problem: Problem) -> Result:
    return plan(problem)


@pytest.fixture(scope="module")
def records(problem: Problem, result: Result) -> dict[str, Shown]:
    inspections = check(problem, result, rate=50.0, meshes=False)
    found = make_diagnosis(rivals=())
    following = plan_after(Case(smoke_spec(), SMOKE.parent, problem.robot), found)
    return {
        "smoke_arm: 5 joints, 26 base parameters": problem,
        "smoke_arm: 5 joints)": load_case(SMOKE),
        "1 motion of 5 joints, stacked condition number": result,
        "motion 1: condition number": result.motions[0],
        "motion_1: 5 joints, 6 s": motions_of(result)[0],
        "elbow: 3 joints, 5 samples, 0.4 s, from log.h5": RUN,
        "viscous friction on elbow: ": found.effects[0],
        "the next motion": following,
        "motion_1: no violation": inspections,
        "no violation; joint_position proved": inspections["motion_1"],
        "2 candidates": compare_random(problem, result, candidates=2, seconds=0),
        "moves 5 joints": propose(str(ROOT / "data" / "smoke_arm.urdf")),
        "smoke_arm: 5 joints (": describe_robot(ROOT / "data" / "smoke_arm.urdf"),
        "The gradient is right.": verify_gradient(problem),
        "smoke_arm.urdf; constraints, optimizer, sampling": problem.spec,
        "viscous of elbow rose from 1 to 2.00 ± 0.10 N·m·s/rad since may": CHANGE,
        "monday: 2.00% of the torque; 3 times the tolerance on elbow": SCORED,
        "2 joints, 0.5 false alarms an hour": THRESHOLDS,
    }


def test_records_of_a_file_are_shown_whatever_else_was_imported(
    problem: Problem, result: Result, tmp_path: Path
) -> None:
    write_result(tmp_path / "r.h5", result, problem)
    read = "from excite_cli import read_result; r = read_result('r.h5'); print(r, r.motions)"
    run = subprocess.run(
        [sys.executable, "-c", read], cwd=tmp_path, capture_output=True, text=True, check=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert run.stdout == f"{result!r} {result.motions!r}\n"
    assert "…" not in run.stdout


def test_a_run_says_where_it_was_read() -> None:
    html = RUN._repr_html_()
    assert html is not None
    assert "log.h5 /runs/elbow" in html
    assert "from" not in (replace(RUN, origin=Origin())._repr_html_() or "")


def test_every_public_record_has_words_and_tables() -> None:
    public = {name: getattr(excite_cli, name) for name in excite_cli.__all__}
    for name, kind in public.items():
        if (
            not isinstance(kind, type)
            or issubclass(kind, Exception | Workers | Measure | Effect)
            or name in SHORT
        ):
            continue
        assert issubclass(kind, Shown), name
        assert _found(kind) is not None, name


def test_a_record_is_a_few_words(records: dict[str, Shown]) -> None:
    for words, record in records.items():
        told = repr(record)
        assert told.startswith(f"{type(record).__name__}(")
        assert words.removesuffix(" (") in told
        assert len(told) < 400
        assert "array(" not in told


def test_a_notebook_shows_tables(records: dict[str, Shown]) -> None:
    for record in records.values():
        html = record._repr_html_()
        assert html is not None
        assert html.count("<p>") + html.count("<table>") >= 1


def test_terminal_and_notebook_show_the_same_cells(
    problem: Problem, result: Result, capsys: pytest.CaptureFixture[str]
) -> None:
    Terminal().show(plan_answer(problem, result, "arm.h5"))
    printed = capsys.readouterr().out
    html = result._repr_html_()
    assert html is not None
    for answer in (result_parts(result),):  # what the record alone says
        for part in answer:
            cells = [c for row in part.rows for c in row] if isinstance(part, Table) else []
            assert all(cell in printed and cell in html for cell in cells)


def test_answers_are_json(problem: Problem, result: Result) -> None:
    found = check(problem, result, rate=50.0, meshes=False)
    compared = compare_random(problem, result, candidates=2, seconds=0)
    answers: list[Answer] = [
        plan_answer(problem, result, "arm.h5"),
        check_answer(found, "arm.h5", problem),
        comparison_answer(compared, None),
    ]
    for answer in answers:
        assert json.loads(json.dumps(answer.data)).keys() == answer.data.keys()
        assert answer.good
    assert answers[1].data["pairs"]["kept_apart"] == 7
    assert answers[1].data["pairs"]["not_kept_apart"] == []
