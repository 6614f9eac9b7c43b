"""excite as its user runs it: `excite diagnose` of a config that declares no effect."""

from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

from benchmarks.battery.scoring import Truth, answer_of_json, plant_of_record, score
from benchmarks.scoreboard.case import Case
from benchmarks.scoreboard.contestants import BODIES, EXCITE, Result, excite
from benchmarks.scoreboard.judge import Judge
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.store.model_file import consistent_model, read_model


def diagnosed(case: Case, judge: Judge, folder: Path) -> list[Result]:
    """The model that it tells its errors of, and the one with bodies that can be."""
    stored = folder / "diagnosis.h5"
    answer, run = excite(case, stored)
    lines = lines_of_config(case.config) + 1
    if answer is None:
        return [Result(name, None, run.processor, lines, run.last) for name in (EXCITE, BODIES)]
    model = read_model(stored)
    names = None if case.is_real else verdicts(answer, case, judge.case.robot.n)
    return [
        Result(name, judge.verdict(*predicted(each, judge)), run.processor, lines, names=names)
        for name, each in ((EXCITE, model.model), (BODIES, consistent_model(model)))
    ]


def predicted(model: IdentifiedModel, judge: Judge) -> tuple[list[Any], Any]:
    """Torques at the states that are asked, and inertias (bodies, 10)."""
    robot = judge.case.robot
    torques = [model.predicted(robot, run).torque for run in judge.held_out]
    return torques, model.phi.reshape(-1, 10)


def lines_of_config(config: Path) -> int:
    """Lines of a config that are neither empty nor comments."""
    lines = config.read_text(encoding="utf-8").splitlines()
    return sum(bool(line.strip()) and not line.strip().startswith("#") for line in lines)


def verdicts(answer: dict[str, Any], case: Case, joints: int) -> dict[str, int]:
    """How many named effects are true, …, wrong; how many are `planted`, and how many `told`."""
    plants = [plant_of_record(each) for each in case.planted]
    told = replace(answer_of_json(answer), saturated=frozenset())  # by names alone
    scored = score(Truth(plants, joints), told)
    return dict(Counter(scored.names)) | {"planted": len(plants), "told": sum(scored.found)}
