"""Whether a robot's motions would give away what its model lacks: `excite selftest`."""

import hashlib
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from excite_cli.api.arguments import checked
from excite_cli.api.diagnosing import diagnose
from excite_cli.api.loading import Case, load_data, measured_case
from excite_cli.api.motions import Motions, is_motion, load_motions
from excite_cli.api.outcome_prediction import predicted_outcomes, states_of
from excite_cli.api.simulating import configured_drive, simulate
from excite_cli.atomic import write_text_atomically
from excite_cli.config.load_spec import spec_as_yaml
from excite_cli.diagnosis.predicted_outcome import PredictedOutcome
from excite_cli.diagnosis.records import Diagnosis, NamedEffect
from excite_cli.diagnosis.verdict import HeldOutVerdict
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import declared_effects
from excite_cli.errors import ConfigError, ContradictionError, FileError, RobotError
from excite_cli.excitation.problem import Problem
from excite_cli.measurement.dataset import Dataset
from excite_cli.report.page import render
from excite_cli.shown.note import Tell, log_note, never, unheard
from excite_cli.simulation.ground_truth import PlantedEffect, parse_planted
from excite_cli.simulation.mujoco_model import load_mujoco
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.store.result_file import is_result
from excite_cli.study import selftest as judging
from excite_cli.study.case import DoneCase, Figures, StudyCase
from excite_cli.study.records import StudyNews
from excite_cli.study.records import run_study as run_cases
from excite_cli.study.selftest import Name, Said, Selftest, SelftestCase
from excite_cli.summary.selftest import selftest_answer as selftest_answer
from excite_cli.summary.selftest import selftest_page
from excite_cli.trajectory.fade import Segment
from excite_cli.workers.base import Workers

PAGE = "selftest.html"
_SURE = (HeldOutVerdict.CONFIRMED, HeldOutVerdict.WEIGHED)


@dataclass(frozen=True)
class _Task:
    """What cases share, and by their names what is planted: the effect, then what comes with it."""

    case: Case
    motions: tuple[Segment, ...]
    settings: SimulationSettings
    planted: dict[str, list[PlantedEffect]]


@checked("motions")
def selftest(
    problem: Problem | Case,
    motions: Motions,
    effects: Sequence[str] = (),
    settings: SimulationSettings | None = None,
    *,
    cases: int | None = None,
    output: str | Path | None = None,
    resume: bool = False,
    overwrite: bool = False,
    workers: Workers | None = None,
    progress: Callable[[StudyNews], None] = unheard,
    tell: Tell = log_note,
    ended: Callable[[], bool] = never,
) -> Selftest:
    """Whether a robot's motions would give away what its model lacks: `excite selftest`.

    Each of the `effects` (`kind@joint=value[,name:value…]`; none: those that many robots have, on
    every joint) is put into a simulated robot of its own, on top of those that the config declares;
    the robot plays all motions, and a diagnosis that holds the last one out is judged. At most
    `cases` of them are tried, spread over kinds and joints. `settings`: `usual_settings` by
    default. The folder `output` gets every case as soon as it is done, and a page (`PAGE`); with
    `resume` cases that are there are not done again. `ended` is asked before every case: once
    it is true, the answer so far is it.

    Raises
    ------
    ConfigError, RobotError, MissingExtraError
        An effect cannot be read or is declared; the config has what no simulated log has; the robot
        has no mass; MuJoCo is missing; `resume` and `overwrite` are both given, or no folder is.
    FileError
        The motions are of another robot; cases are in the folder, and neither `resume` nor
        `overwrite` is requested, or they are of another config; it cannot be written to.
    """
    load_mujoco()
    if (resume or overwrite) and (output is None or (resume and overwrite)):
        raise ConfigError(
            "--resume goes on with the folder of -o, --overwrite replaces it: give one of them, "
            "with -o FOLDER."
        )
    case = _testable(problem)
    segments = tuple(load_motions(case, motions, (), tell))
    settings = settings or usual_settings(case, motions)
    names = case.robot.joint_names
    declared = declared_effects(case.spec.effects, replace(case.robot, rows=case.robot.moved))
    chosen = _asked(case, effects, declared) if effects else []
    if cases is not None or not effects:
        usual = chosen or judging.usual_effects(case.robot, declared, settings.seed)
        chosen = judging.spread(usual, cases or len(usual), settings.seed)
    planted = {it.in_words(names): [it, *judging.beside(it, case.robot, declared)] for it in chosen}
    expected = dict(
        zip(planted, predicted_outcomes(case, segments, chosen, settings, tell), strict=True)
    )
    task = _Task(case, segments, settings, planted)
    request = _request(task)
    every = [
        StudyCase(f"case {k}", {"effect": it}, None, request + it) for k, it in enumerate(planted)
    ]
    with tempfile.TemporaryDirectory() as passing:
        folder = Path(passing if output is None else output)
        done = run_cases(task, every, folder, do_case, workers, resume, progress, overwrite, ended)
    if done and done[0].failed and len({each.message for each in done}) == 1:
        raise FileError(f"every case failed: {done[0].message}")
    found = []
    for record in done:
        words = record.values["effect"]
        one = planted[words][0]
        size, (kind, joints) = one.named()[one.number], _name(one, names)
        told: dict[str, Any] = {**record.figures, "message": record.message}
        told |= {"seconds": record.seconds, **_in_advance(expected[words])}
        found.append(SelftestCase(words, kind, joints, size, **told))
    answer = Selftest(case.robot.name, names, tuple(found), len(every))
    if output is not None:
        write_text_atomically(Path(output) / PAGE, render(selftest_page(answer)))
    return answer


def _request(task: _Task) -> str:
    """Digest of what all cases share: the config, robot, motions and how they are played."""
    parts = [spec_as_yaml(task.case.spec), task.case.robot.fingerprint(), repr(task.settings)]
    parts += [f"{it.trajectory.duration} {states_of(it)[0].tolist()}" for it in task.motions]
    return f"{hashlib.sha256(' '.join(parts).encode()).hexdigest()} "


@checked("motions")
def usual_settings(problem: Problem | Case, motions: Motions) -> SimulationSettings:
    """Seed and drive of the config, and as many samples a second as measured `motions` have."""
    rate = SimulationSettings.rate
    file = Path(motions) if isinstance(motions, str | Path) else None
    if file is not None and not (is_result(file) or is_motion(file, problem.spec)):
        motions = load_data(problem, file, unheard)
    if isinstance(motions, Dataset):
        rate = min(1000.0, *(1.0 / float(np.median(np.diff(run.t))) for run in motions.runs))
    return SimulationSettings(problem.spec.seed, rate, drive=configured_drive(problem))


def do_case(task: _Task, case: StudyCase, tell: Callable[[str], None]) -> DoneCase:
    """One case, on whatever worker: simulate, diagnose, judge."""
    began = time.perf_counter()
    planted = task.planted[case.values["effect"]]
    tell("simulating")
    words = [each.in_words(task.case.robot.joint_names) for each in planted]
    data = simulate(task.case, task.motions, words, task.settings, tell=unheard).dataset
    try:
        found = diagnose(task.case, data, progress=lambda text, done: tell(text), tell=unheard)
        figures = _figures(found, planted, task.case)
    except ContradictionError as refused:  # that names what was planted is an answer, too
        own, *others = (_name(each, task.case.robot.joint_names) for each in planted)
        said = _of_zeros(refused.faults)
        outcome, _ = judging.judge(own, said, others)
        if outcome is not judging.Outcome.FOUND:
            raise
        figures = {"outcome": str(outcome), "named": _listed([each.name for each in said])}
    return DoneCase(figures, {}, time.perf_counter() - began)


def _figures(found: Diagnosis, planted: Sequence[PlantedEffect], case: Case) -> Figures:
    one, robot = planted[0], case.robot
    own, *others = (_name(each, robot.joint_names) for each in planted)
    said = [_said(found, each) for each in found.effects]
    said += _of_zeros([(each.kind, each.joints) for each in found.findings])
    absorbed = [(each.kind, each.joints) for each in found.absorbed]
    outcome, wrong = judging.judge(own, said, others, absorbed)
    figures: dict[str, float | int | str | None] = {
        "outcome": str(outcome),
        "named": _listed([each.name for each in said if each.sure]),
        "wrong": _listed(wrong),
        "before": found.before.mean_relative_moving,
        "after": found.after.mean_relative_moving,
    }
    nothing = np.zeros((len(one.values), len(one.values)))
    values = one.effect.report_on(robot.sliding, one.values, nothing)
    figures["unit"] = values[one.number].unit if one.number in values else ""
    for each in found.effects:
        value = each.parameters.get(one.number)
        if (each.effect.kind, each.effect.joints) == own and value is not None:
            figures |= {"found": value.value, "std": value.std}
    return figures


def _of_zeros(found: Sequence[Name]) -> list[Said]:
    """Joints whose zero is found to lie elsewhere have an encoder offset."""
    joints = [joint for kind, names in found if kind == "zero" for joint in names]
    return [Said(("encoder_offset", (joint,))) for joint in joints]


def _name(planted: PlantedEffect, joints: Sequence[str]) -> Name:
    return planted.effect.kind, tuple(joints[j] for j in planted.effect.joints)


def _listed(names: Sequence[Name]) -> str:
    return ", ".join(f"{kind}@{'+'.join(joints)}" for kind, joints in names)


def _said(found: Diagnosis, named: NamedEffect) -> Said:
    """An effect of the answer; friction of several terms on a joint is confirmed as one."""
    effect, verdict = named.effect, named.verdict
    for line in found.friction_lines:
        if (line.joint,) == effect.joints and effect.kind in line.kinds and len(line.kinds) > 1:
            verdict = line.verdict
    pairs = [each.others for each in found.joint_aliases if effect in each.named]
    aliases = tuple((each.kind, each.joints) for each in (*named.aliases, *sum(pairs, ())))
    near = named.approximates is not None
    return Said((effect.kind, effect.joints), aliases, verdict in _SURE, near)


def _testable(problem: Problem | Case) -> Case:
    """The case without what only recorded runs have; refuses what cannot be simulated."""
    measured = measured_case(problem)
    spec, robot = measured.spec, measured.robot
    if spec.measurement.covariates:
        raise ConfigError(
            "measurement.covariates: a selftest simulates no further columns of the log. Leave "
            "them out: --set 'measurement.covariates=[]'."
        )
    if not standard_parameters(robot)[::10].sum() > 0.0:
        raise RobotError(
            f"{robot.name} has no masses, so nothing can be simulated. Give its links <inertial> "
            "elements, or the config a density [kg/m³]: robot.density."
        )
    return Case(spec.model_copy(update={"runs": {}}), measured.folder, robot, measured.file)


def _asked(case: Case, effects: Sequence[str], declared: Sequence[Effect]) -> list[PlantedEffect]:
    """The effects that were given, each to be planted on its own."""
    found = [each for given in effects for each in parse_planted(given, case.robot, {})]
    every = [each.in_words(case.robot.joint_names) for each in found]
    for each, words in zip(found, every, strict=True):
        if each.effect.place in {it.place for it in declared}:
            raise ConfigError(
                f"--effect '{words}': the config declares it, so no diagnosis has to find it. Take "
                "it out of `effects` of the config, or ask for another."
            )
        if every.count(words) > 1:
            raise ConfigError(f"--effect '{words}' is given twice.")
    return found


def _in_advance(found: PredictedOutcome | None) -> dict[str, Any]:
    """What was predicted of a case, by the names of its fields."""
    if found is None:
        return {}
    said = judging.predicted(found.named, found.apart, found.absorbed)
    rival = _listed([found.rival] if found.rival else [])
    return {"power": found.named, "apart": found.apart, "rival": rival, "predicted": said}
