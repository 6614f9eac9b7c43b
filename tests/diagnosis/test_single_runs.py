"""What is assumed of the held-out run, of effects that only some runs have."""

import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.search_result import SearchResult
from excite_cli.diagnosis.single_runs import assumptions, differences_between_runs
from excite_cli.diagnosis.training import TrainingData
from excite_cli.effects.catalogue import catalogue, kind_named
from excite_cli.identification.split import Split
from excite_cli.measurement.dataset import Run
from excite_cli.measurement.run_identity import Part, RunId
from tests.diagnosis.explicit_data import prepared, traced

JOINTS = ("a", "b")


def run(name: str, block: int = 0) -> Run:
    t = np.arange(10) / 10.0
    return Run(name, t, np.zeros((10, 2)), np.zeros((10, 2)), part=Part(block=block))


def model(**states: Any) -> Any:
    return SimpleNamespace(robot=SimpleNamespace(joint_names=JOINTS), states=states)


@pytest.mark.parametrize(
    ("held_out", "declared", "told"),
    [
        (run("other"), {}, True),
        (run("only", block=3), {}, False),  # a block of the recording that has it
        (run("other"), {"other": {"contact": "none"}}, False),
    ],
)
def test_of_a_held_out_run_that_is_not_among_its_runs_an_effect_is_taken_to_be_absent(
    held_out: Run, declared: dict[str, Any], told: bool
) -> None:
    effect = kind_named("contact")((0, 1), {"start": 0.1, "end": 0.4}, ("only",))
    parts = Split((run("only", block=1),), (held_out,), held_out.name, (0,), ("only",))
    found = assumptions([effect], parts, model(**declared))
    assert [(each.kind, each.present) for each in found] == [("contact", False)] * told


def two_recordings(offset: float, runs: tuple[str, str] = ("a", "b")) -> SearchResult:
    """Four parts of two recordings; joint 0 of the first has so much more offset, noise is one."""
    columns = [np.ones((80, 1, 1)) * (part < 2) for part in range(4)]
    rng = np.random.default_rng(3)
    tau = [np.c_[offset * c[:, 0, 0], np.zeros(80)] + rng.normal(size=(80, 2)) for c in columns]
    declared = tuple(rng.normal(size=(80, 2, 2)) for _ in columns)
    parts = [replace(prepared(np.ones((80, 2), bool)), run=RunId(runs[k // 2])) for k in range(4)]
    data = TrainingData(tuple(parts), (0, 0, 1, 1), declared, tuple(tau))
    change = catalogue()["torque_offset"]((0,), {}, (runs[0],))
    known: Any = SimpleNamespace(
        states={}, robot=SimpleNamespace(joint_names=("elbow", "wrist"), sliding=(False, False))
    )
    found = traced(data, [Candidate(change, (0,), tuple(columns), tests=4)], ())
    return replace(found, model=known)


def test_by_what_two_recordings_differ_is_told_in_one_line() -> None:
    (told,) = differences_between_runs(two_recordings(5.0))
    assert told.kind == "runs_differ"
    assert re.search(r"a and b differ: torque_offset of elbow by \+[45]\.\d* N·m in a\.", told.text)
    assert "runs: {a: {torque_offset: a}, b: {torque_offset: b}}" in told.text
    # What is chance is not told nor what parts of one recording differ by.
    assert differences_between_runs(two_recordings(0.0)) == ()
    assert differences_between_runs(two_recordings(5.0, ("a", "a"))) == ()


def test_every_held_out_run_must_be_declared() -> None:
    effect = kind_named("contact")((0, 1), {"start": 0.1, "end": 0.4}, ("only",))
    held_out = run("other"), run("third")
    parts = Split((run("only", block=1),), held_out, "other", (0,), ("only",))
    (found,) = assumptions([effect], parts, model(other={"contact": "none"}))
    assert found.kind == "contact"
