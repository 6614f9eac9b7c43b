"""Whether a robot's motions would give away what its model lacks: `excite selftest`."""

import hashlib
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from excite_cli.api.arguments import checked
from excite_cli.api.diagnosing import diagnose
from excite_cli.api.inspecting import bare_problem
from excite_cli.api.loading import Case, inputs_of, load_data, measured_case
from excite_cli.api.motions import Motions, is_motion, load_motions
from excite_cli.api.simulating import configured_drive, simulate
from excite_cli.config.load_spec import spec_as_yaml
from excite_cli.diagnosis.expectation import rows_as_recorded
from excite_cli.diagnosis.power import power_of
from excite_cli.diagnosis.records import Diagnosis, NamedEffect
from excite_cli.diagnosis.verdict import HeldOutVerdict
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import declared_effects
from excite_cli.errors import ConfigError, ExciteError, FileError, RobotError
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.problem import Problem
from excite_cli.given_files import refuse_inputs_as_outputs
from excite_cli.measurement.dataset import Dataset
from excite_cli.shown.note import Level, Note, Tell, log_note, never, unheard
from excite_cli.simulation.ground_truth import PlantedEffect, parse_planted
from excite_cli.simulation.mujoco_model import load_mujoco
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.store.diagnosis_file import is_diagnosis
from excite_cli.store.fit_file import is_fit
from excite_cli.store.result_file import is_result
from excite_cli.study.case import DoneCase, StudyCase
from excite_cli.study.records import TABLE, StudyNews, files_of
from excite_cli.study.records import run_study as run_cases
from excite_cli.study.selftest import (
    Name,
    Said,
    Selftest,
    beside,
    case_of,
    judge,
    spread,
    usual_effects,
)
from excite_cli.summary.selftest import selftest_answer as selftest_answer
from excite_cli.trajectory.fade import Segment
from excite_cli.workers.base import Workers

_SURE = (HeldOutVerdict.CONFIRMED, HeldOutVerdict.WEIGHED)


@dataclass(frozen=True)
class _Task:
    """What all cases share: the robot, its motions, how it is simulated; by the name of a case what
    is planted (the effect, then what comes with it), and the power predicted for it."""

    case: Case
    motions: tuple[Segment, ...]
    settings: SimulationSettings
    planted: dict[str, tuple[PlantedEffect, ...]]
    power: dict[str, float]


@checked("motions")
def selftest(
    problem: Problem | Case,
    motions: Motions,
    effects: Sequence[str | PlantedEffect] = (),
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
    `cases` of them are tried, spread over kinds and joints. `settings`: of the simulation; by
    default the seed of the config, and samples as often as measured motions have them. The folder
    `output` keeps a record of every case, with which `resume` goes on. `ended` is asked before
    every case: once it is true, the answer so far is it.

    Raises
    ------
    ConfigError, RobotError, MissingExtraError
        An effect cannot be read or is declared; the config has what no simulated log has; the robot
        has no mass; MuJoCo is missing.
    FileError
        The motions are of another robot; records are in the folder already.
    """
    if (resume or overwrite) and (output is None or (resume and overwrite)):
        raise ConfigError("--resume goes on with the folder of -o, --overwrite replaces it.")
    load_mujoco()
    case = _testable(problem)
    played = read_motions(case, motions, tell)
    segments = tuple(load_motions(case, played, (), tell))
    if len(segments) == 1:
        text = "there is one motion, of which parts are held out; another one is a harder test"
        tell(Note(Level.HINT, text))
    settings = settings or usual_settings(case, played)
    declared = declared_effects(case.spec.effects, replace(case.robot, rows=case.robot.moved))
    asked = _asked(case, effects, declared, settings.seed)
    chosen = asked
    if cases is not None or not effects:
        chosen = spread(asked, len(asked) if cases is None else cases, settings.seed)
    planted = {_slug(case, each): (each, *beside(each, case.robot, declared)) for each in chosen}
    power = _predicted(case, segments, chosen, tell)
    task = _Task(case, segments, settings, planted, dict(zip(planted, power, strict=True)))
    names = case.robot.joint_names
    digest = _digest(task)
    every = [
        StudyCase(
            name, {"effect": first.in_words(names)}, None, f"{digest} {first.in_words(names)}"
        )
        for name, (first, *_) in planted.items()
    ]
    with tempfile.TemporaryDirectory() as spare:
        folder = Path(spare) if output is None else Path(output)
        written = [folder / TABLE, *(path for each in every for path in files_of(folder, each))]
        present = {f"{path.name}:": path for path in written if path.exists()}
        refuse_inputs_as_outputs(present, inputs_of(problem, motions))
        done = run_cases(task, every, folder, do_case, workers, resume, progress, overwrite, ended)
    found = tuple(case_of(each, planted[each.name][0], names) for each in done)
    failed = {each.message for each in found}
    if found and len(failed) == 1 and "" not in failed:
        raise FileError(f"every case failed: {failed.pop()}")
    return Selftest(case.robot.name, names, found, len(every))


@checked("motions")
def read_motions(problem: Problem | Case, motions: Motions, tell: Tell = log_note) -> Motions:
    """Measured data read from their file; all other motions as they are given.

    Raises
    ------
    FileError, ConfigError, MissingExtraError
        See `load_data`.
    """
    if not isinstance(motions, str | Path):
        return motions
    path = Path(motions)
    own = path.is_file() and any(it(path) for it in (is_result, is_fit, is_diagnosis))
    return motions if own or is_motion(path, problem.spec) else load_data(problem, path, tell)


@checked("motions")
def usual_settings(problem: Problem | Case, motions: Motions) -> SimulationSettings:
    """The seed and the drive of the config; samples as often as measured `motions` have them."""
    plain = SimulationSettings()
    data = read_motions(problem, motions, unheard)
    steps = [np.median(np.diff(run.t)) for run in data.runs] if isinstance(data, Dataset) else []
    rate = min(1.0 / float(min(steps)), plain.control_rate) if steps else plain.rate
    return replace(plain, seed=problem.spec.seed, rate=rate, drive=configured_drive(problem))


def do_case(task: _Task, case: StudyCase, tell: Callable[[str], None]) -> DoneCase:
    """One case, on whatever worker: simulate, diagnose, judge."""
    began = time.perf_counter()
    planted, *more = task.planted[case.name]
    tell("simulating")
    played = simulate(task.case, task.motions, (planted, *more), task.settings, tell=unheard)
    found = diagnose(
        task.case, played.dataset, progress=lambda text, done: tell(text), tell=unheard
    )
    figures = _figures(found, planted, more, task)
    if np.isfinite(task.power[case.name]):
        figures["power"] = task.power[case.name]
    return DoneCase(figures, {}, time.perf_counter() - began)


def _figures(
    found: Diagnosis, planted: PlantedEffect, more: Sequence[PlantedEffect], task: _Task
) -> dict[str, float | int | str | None]:
    robot = task.case.robot
    own, *others = (
        Name(each.effect.kind, tuple(robot.joint_names[j] for j in each.effect.joints))
        for each in (planted, *more)
    )
    said = [_said(found, each) for each in found.effects]
    absorbed = [Name(each.kind, each.joints) for each in found.absorbed]
    outcome, wrong = judge(own, said, others, absorbed)
    sure = [str(each.name) for each in said if each.sure]
    figures: dict[str, float | int | str | None] = {
        "outcome": str(outcome),
        "named": " ".join(sure),
        "wrong": " ".join(map(str, wrong)),
        "before": found.before.mean_relative_moving,
        "after": found.after.mean_relative_moving,
    }
    values = planted.effect.report_on(
        robot.sliding, planted.values, np.zeros((len(planted.values),) * 2)
    )
    if planted.number in values:
        figures["unit"] = values[planted.number].unit
    for each in found.effects:
        value = each.parameters.get(planted.number)
        if Name(each.effect.kind, each.effect.joints) == own and value is not None:
            figures |= {"found": value.value, "std": value.std, "unit": value.unit}
    return {key: value for key, value in figures.items() if value == value}


def _said(found: Diagnosis, named: NamedEffect) -> Said:
    """An effect of the answer; friction of several terms on a joint is confirmed as one."""
    effect, verdict = named.effect, named.verdict
    for line in found.friction_lines:
        if (line.joint,) == effect.joints and effect.kind in line.kinds and len(line.kinds) > 1:
            verdict = line.verdict
    pairs = [each for each in found.joint_aliases if effect in each.named]
    aliases = (*named.aliases, *(each for pair in pairs for each in pair.others))
    return Said(
        Name(effect.kind, effect.joints),
        tuple(Name(each.kind, each.joints) for each in aliases),
        verdict in _SURE,
        named.approximates is not None,
    )


def _testable(problem: Problem | Case) -> Case:
    """The case without what only recorded runs have; refuses what cannot be simulated."""
    spec = problem.spec
    if spec.measurement.covariates:
        raise ConfigError(
            "measurement.covariates: a selftest simulates no further columns of the log. Leave "
            "them out: --set 'measurement.covariates=[]'."
        )
    measured = measured_case(problem)
    robot = measured.robot
    if not standard_parameters(robot)[::10].sum() > 0.0:
        raise RobotError(
            f"{robot.name} has no masses, so nothing can be simulated. Give its links <inertial> "
            "elements, or the config a density [kg/m³]: robot.density."
        )
    return Case(spec.model_copy(update={"runs": {}}), measured.folder, robot, measured.file)


def _asked(
    case: Case, effects: Sequence[str | PlantedEffect], declared: Sequence[Effect], seed: int
) -> list[PlantedEffect]:
    """The effects to be planted, each on its own."""
    if not effects:
        return usual_effects(case.robot, declared, seed)
    found: list[PlantedEffect] = []
    for given in effects:
        found += parse_planted(given, case.robot, {}) if isinstance(given, str) else [given]
    there = {each.place for each in declared}
    for each in found:
        words = each.in_words(case.robot.joint_names)
        if each.effect.place in there:
            raise ConfigError(
                f"--effect '{words}': the config declares it, so no diagnosis has to find it. Take "
                "it out of `effects` of the config, or ask for another."
            )
        if sum(words == it.in_words(case.robot.joint_names) for it in found) > 1:
            raise ConfigError(f"--effect '{words}' is given twice.")
    return found


def _slug(case: Case, planted: PlantedEffect) -> str:
    """A name of a file for it; the same kind on the same joint in two sizes has two."""
    words = planted.in_words(case.robot.joint_names)
    number = hashlib.sha256(words.encode()).hexdigest()[:8]
    return f"{words.partition('=')[0].replace('@', '_').replace('/', '-')[:80]}_{number}"


def _digest(task: _Task) -> str:
    """Of all that cases share: the config, the motions and the settings."""
    parts = [spec_as_yaml(task.case.spec), str(task.case.folder), repr(task.settings)]
    parts += [f"{m.name} {m.trajectory.duration} {m.coefficients.tolist()}" for m in task.motions]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def _predicted(
    case: Case, motions: Sequence[Segment], planted: Sequence[PlantedEffect], tell: Tell
) -> list[float]:
    """With what power these motions but the last show each; NaN where that is not known."""
    try:
        problem = bare_problem(case)
        objective, stack = problem.objective(), Stack.empty(problem.columns)
        for each in motions[: max(1, len(motions) - 1)]:
            rows = rows_as_recorded(problem, objective, each.coefficients, each.trajectory)
            stack = stack.with_rows(rows)
    except ExciteError as error:
        tell(Note(Level.NOTE, f"no power is predicted: {error}"))
        return [np.nan for _ in planted]
    assert problem.prediction is not None
    alpha, names, found = case.spec.diagnosis.significance, case.robot.joint_names, []
    for one in planted:
        kind, joints = one.effect.kind, tuple(names[j] for j in one.effect.joints)
        size = abs(float(one.values[0]))
        shown = power_of(problem.prediction, stack, alpha, kind, size)
        found.append(next((each.power for each in shown if each.joints == joints), np.nan))
    return found
