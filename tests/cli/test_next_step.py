"""What each command says is to be done next, by what was given and found."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace as Some
from typing import Any

import pytest

from excite_cli.api.showing import Answer, Command, Part
from excite_cli.cli import next_step as step
from excite_cli.cli.console import Terminal
from excite_cli.diagnosis.records import OPEN_SETUP
from excite_cli.measurement.dataset import Finding
from excite_cli.summary.diagnosis import diagnosis_answer
from tests.diagnosis.synthetic_diagnosis import make_diagnosis

CONFIG, PLAN, DATA, MODEL = map(Path, ("arm.yaml", "arm.h5", "log.csv", "found.h5"))


def exported(format: str = "c", worse: bool | None = None, motions: int = 0) -> Any:
    held_out = None if worse is None else Some(worse=worse)
    return Some(format=format, held_out=held_out, motions=motions)


def scored(*alarms: tuple[str, ...]) -> Any:
    return Some(alarms=[Some(reasons=each) for each in alarms], model="found.h5")


def campaign(ended: str, most_rounds: int = 2) -> Any:
    return Some(ended=ended, rounds=[1, 2], seconds=40.0, asked=Some(most_rounds=most_rounds))


TYPED = ["campaign", "arm.yaml", "--measure", "p {motion} {data}"]
INSPECT = "excite inspect CONFIG.yaml log.csv"


@pytest.mark.parametrize(
    ("parts", "commands"),
    [
        (step.after_optimize(False, CONFIG, PLAN, None, None), []),
        (
            step.after_optimize(True, CONFIG, PLAN, None, None),
            [
                "excite view arm.h5",
                "excite export arm.h5 --format csv",
                "excite simulate arm.yaml arm.h5 -o measured.h5",
            ],
        ),
        (
            step.after_optimize(True, CONFIG, PLAN, MODEL, None),
            ["excite view arm.h5", "excite diagnose arm.yaml OLD.h5 NEW.h5 -o DIAGNOSIS.h5"],
        ),
        (
            step.after_optimize(True, CONFIG, PLAN, None, MODEL),
            ["excite identify arm.yaml LOADED.h5 --only payload --fit found.h5"],
        ),
        (
            step.after_check(False, CONFIG, PLAN, True),
            ["excite optimize arm.yaml --start arm.h5 -o MOTIONS.h5"],
        ),
        (step.after_check(True, CONFIG, PLAN, True), ["excite export arm.h5 --format csv"]),
        (step.after_check(True, CONFIG, DATA, False), ["excite inspect arm.yaml DATA.csv"]),
        (step.after_export(exported(motions=2), PLAN), ["excite inspect CONFIG.yaml DATA.csv"]),
        (step.after_export(exported("urdf", True), MODEL), ["excite export found.h5 -f c"]),
        (step.after_export(exported("c", True), MODEL), ["excite diagnose CONFIG.yaml DATA.h5"]),
        (step.after_export(exported("mjcf", False), MODEL), ["excite replay found.h5 DATA.h5"]),
        (step.after_export(exported("c"), MODEL), ["excite score found.h5 DATA.h5"]),
        (step.after_identify(True, CONFIG, [DATA], MODEL), ["excite diagnose arm.yaml log.csv"]),
        (
            step.after_identify(False, CONFIG, [DATA], None),
            ["excite identify arm.yaml log.csv -o fit.h5"],
        ),
        (step.after_identify(False, CONFIG, [DATA], MODEL), ["excite score found.h5 DATA.h5"]),
        (step.after_score(scored(("payload",), ()), [DATA], None), [INSPECT]),
        (
            step.after_score(scored(("payload",)), [DATA], None),
            ["excite diagnose CONFIG.yaml log.csv"],
        ),
        (
            step.after_score(scored(), [DATA], None),
            ["excite score found.h5 log.csv -o SCORE.h5"],
        ),
        (step.after_score(scored(), [DATA], MODEL), ["excite compare found.h5"]),
        (step.after_forecast(True, MODEL, PLAN), ["excite score found.h5 DATA.h5"]),
        (
            step.after_forecast(False, MODEL, PLAN),
            ["excite optimize CONFIG.yaml --set task.plan=arm.h5"],
        ),
        (
            step.after_campaign(campaign("complete"), Path("c"), TYPED),
            ["excite export c/round_2_diagnosis.h5 -f c"],
        ),
        (
            step.after_campaign(campaign("budget"), Path("c"), [*TYPED, "--max-rounds", "2"]),
            [
                "excite campaign arm.yaml --measure 'p {motion} {data}' --resume --max-rounds 4",
            ],
        ),
        (
            step.after_campaign(campaign("budget", 8), Path("c"), [*TYPED, "--resume"]),
            [
                "excite campaign arm.yaml --measure 'p {motion} {data}' --resume --max-seconds 80",
            ],
        ),
        (
            step.after_campaign(campaign("stuck"), Path("c"), TYPED),
            ["excite report c/round_2_diagnosis.h5"],
        ),
    ],
)
def test_by_what_was_given_and_found(parts: tuple[Part, ...], commands: list[str]) -> None:
    assert str(parts[0]).startswith("Next: ")
    assert [part.line for part in parts if isinstance(part, Command)] == commands


def test_a_path_is_no_option() -> None:
    (_, command) = step.next_step("look", "view", Path("-a.h5"))
    assert isinstance(command, Command)
    assert command.line == "excite view ./-a.h5"


def after_diagnosis(file: str | None = "d.h5", **changes: Any) -> list[str]:
    made = replace(make_diagnosis(), **changes)
    answer = diagnosis_answer(made, "arm.yaml", {"diagnosis": file}, data=[DATA])
    return [part.line for part in answer.parts if isinstance(part, Command)]


def test_after_a_diagnosis() -> None:
    plan = "excite optimize arm.yaml --after d.h5"
    assert after_diagnosis() == ["excite report d.h5", plan]
    assert after_diagnosis(None) == ["excite diagnose arm.yaml log.csv -o DIAGNOSIS.h5"]
    assert after_diagnosis(effects=(), excess_residuals=()) == ["excite score d.h5 DATA.h5"]
    doubt = Finding(OPEN_SETUP, "warning", "the base may be inclined")
    assert after_diagnosis(findings=(doubt,)) == ["excite inspect arm.yaml log.csv"]


def test_nothing_to_extend_a_model_by_is_not_said() -> None:
    left = replace(make_diagnosis(), effects=())
    answer = diagnosis_answer(left, "arm.yaml", {"diagnosis": "d.h5"})
    assert "plan a motion, to show more of what no effect explains:" in str(answer.parts)


def test_json_has_it_and_quiet_leaves_it_out(capsys: pytest.CaptureFixture[str]) -> None:
    following = step.next_step("look at it", "view", PLAN)
    Terminal().show(Answer(("done",), {}), following)
    assert capsys.readouterr().out == "done\nNext: look at it:\n  excite view arm.h5\n"
    Terminal(quiet=True).show(Answer(("done",), {}), following)
    assert capsys.readouterr().out == "done\n"
    Terminal(as_json=True).show(Answer((), {"a": 1}), following)
    assert json.loads(capsys.readouterr().out) == {"a": 1, "next": ["excite view arm.h5"]}
