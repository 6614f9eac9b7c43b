"""One case from its making to its score: record, diagnose as a user would, compare.

What the error is compared with depends on the deck. The oracle knows the truth: the same data with
the planted effects declared and nothing looked for. Of campaigns, whether a rest is large is judged
by the truth, too: the residual of the diagnosed model on training data against the noise that was
added, both through the filters of that diagnosis. Robots as they are have three fits of a textbook
beside them: inertias free, viscous and Coulomb friction on all joints; with offset; with armature.
"""

import json
import re
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, fields, replace
from multiprocessing import get_context
from pathlib import Path
from typing import TypeVar

import numpy as np
from threadpoolctl import threadpool_limits

from benchmarks.battery.cases import Case
from benchmarks.battery.decks import DECKS, Deck
from benchmarks.battery.instruments import Recorded, recorded
from benchmarks.battery.motions import CONFIGS
from benchmarks.battery.scoring import (
    PLAIN,
    Answer,
    Called,
    Name,
    Named,
    Score,
    Truth,
    identity,
    score,
)
from benchmarks.battery.series import leaves
from excite_cli.api import diagnosing
from excite_cli.api.identifying import identify
from excite_cli.api.loading import Case as RobotCase
from excite_cli.api.loading import load_data
from excite_cli.atomic import write_text_atomically
from excite_cli.config.data_spec import EffectSpec
from excite_cli.config.spec import Spec
from excite_cli.diagnosis.diagnose import diagnose
from excite_cli.diagnosis.records import Diagnosis, EffectRecord, NamedEffect
from excite_cli.diagnosis.verdict import HeldOutVerdict
from excite_cli.effects.catalogue import (
    EVERYDAY,
    EVERYDAY_FRICTION,
    catalogue,
    declared_effects,
)
from excite_cli.errors import ExciteError
from excite_cli.fields import data_of
from excite_cli.identification.prepare import prepare
from excite_cli.identification.processing import Processing
from excite_cli.measurement.dataset import Dataset
from excite_cli.measurement.hdf5_writer import write_dataset
from excite_cli.measurement.quality import checked, raise_for_errors
from excite_cli.measurement.recording_limits import RecordingLimits
from excite_cli.simulation.ground_truth import PlantedEffect
from excite_cli.simulation.simulate import simulate

BOOKS = (EVERYDAY_FRICTION, (*EVERYDAY_FRICTION, "torque_offset"), (*EVERYDAY_FRICTION, *EVERYDAY))
LARGE = 2.5  # times the noise floor
ROSE = 1.25  # times the error before, of a joint
# An error that no effect concerns need not fall: it changes with the parameters of all runs.
_UNCHANGED = 1.02
T = TypeVar("T")


@dataclass
class Outcome:
    """A case in plain words and numbers, for tables and files.

    `left`: joints of which it is said that more than noise is left. `rest`: residual over noise
    floor by joint. `silent`: joints of which a large rest is not said. `seen`: a rest is said to be
    unexplained where something was planted. `alarm`: anything said that is not so. `refused`: the
    data, sound as they are, were not taken. `worse`: the held-out error did not fall (of effects in
    other runs alone: it rose), `admitted`: and the program says so. `worse_joints`: where it rose,
    and no effect there is doubted. `best`: the error that is compared with. `seconds` are of the
    processor.
    """

    index: int
    group: str
    kind: str = ""
    robot: str = ""
    words: str = ""
    held_out: str = ""
    friction: str = ""
    noise: float = 0.0
    correlation: float = 0.0
    planted: list[dict] = field(default_factory=list)
    named: list[dict] = field(default_factory=list)
    found: list[bool] = field(default_factory=list)
    sizes: list[dict] = field(default_factory=list)
    unexplained: list[dict] = field(default_factory=list)
    left: list[str] = field(default_factory=list)
    rest: dict[str, float] = field(default_factory=dict)
    silent: list[str] = field(default_factory=list)
    detected: bool = False
    seen: bool = False
    right: bool = False
    wrong: bool = False
    extra: bool = False
    alarm: bool = False
    refused: bool = False
    worse: bool = False
    admitted: bool = False
    worse_joints: list[str] = field(default_factory=list)
    before: float = float("nan")
    after: float = float("nan")
    best: float = float("nan")
    joint_ratio: float = float("nan")
    seconds: dict[str, float] = field(default_factory=dict)
    error: str = ""

    @property
    def ratio(self) -> float:
        """The error after over the one that it is compared with."""
        return self.after / self.best


@dataclass(frozen=True)
class Judged:
    """An outcome, with the records that a person wants to see of a single case."""

    outcome: Outcome
    case: Case | None = None
    diagnosis: Diagnosis | None = None


def judge(seed: int, index: int, deck: str = "catalogue") -> Judged:
    """Make and judge one case of a deck; what goes wrong is part of the outcome."""
    of = DECKS[deck]
    outcome = Outcome(index, *of.label(seed, index))
    try:
        return _judged(outcome, of.make_case(seed, index), of)
    except ExciteError as error:
        outcome.refused, outcome.error = True, f"{type(error).__name__}: {error}"
    except Exception:
        outcome.error = traceback.format_exc()
    return Judged(outcome)


def outcome_of(seed: int, index: int, deck: str) -> Outcome:
    """What is left of it where processes share the cases."""
    return judge(seed, index, deck).outcome


def records_of(case: Case) -> Recorded:
    """What was recorded; of cases whose simulation adds the noise, it is not known."""
    if case.data is not None:
        return Recorded(case.data, case.data, {})
    robot, inside = case.robot.robot, case.friction == "declared"
    declared = declared_effects(case.spec.effects if inside else (), robot)
    played = simulate(robot, case.motions, case.settings, case.planted, declared).dataset
    if case.instruments is None:
        return Recorded(played, played, {})
    return recorded(played, case.instruments)


def _judged(outcome: Outcome, case: Case, deck: Deck) -> Judged:
    _describe(outcome, case)
    data = _timed(outcome, "simulate", lambda: records_of(case))
    if deck.beside == "truth":
        data = replace(data, dataset=_checked(data.dataset, case))
        raise_for_errors(data.dataset)
    found = _timed(outcome, "diagnose", lambda: _diagnosed(case, data.dataset, deck))
    answer = answer_of(found, data.dataset, deck)
    _fill(outcome, found, answer, score(truth_of(case, deck), answer), deck)
    if deck.beside == "before":
        outcome.rest = rests(case, data, found)
        told = {joint for each in found.approximations for joint in each.effect.joints}
        told |= {each.joint for each in found.excess_residuals}
        outcome.silent = [j for j, x in outcome.rest.items() if x > LARGE and j not in told]
    elif deck.beside == "textbook":
        outcome.best = _timed(outcome, "textbook", lambda: _textbook(case, data.dataset))
    elif case.group not in ("outside", "history"):
        best = _timed(outcome, "oracle", lambda: oracle(case, data.dataset)).after
        outcome.best = best.mean_relative_moving
        ratios = [
            found.after.relative_moving[plant.strongest] / best.relative_moving[plant.strongest]
            for plant in case.plants
        ]
        outcome.joint_ratio = max(ratios, default=float("nan"))
    return Judged(outcome, case, found)


def _timed(outcome: Outcome, name: str, do: Callable[[], T]) -> T:
    began = time.process_time()
    try:
        return do()
    finally:
        outcome.seconds[name] = time.process_time() - began


def _diagnosed(case: Case, data: Dataset, deck: Deck) -> Diagnosis:
    if deck.beside == "truth":
        return diagnose(case.robot.robot, case.robot.base, data, case.spec)
    robot = RobotCase(case.spec, CONFIGS, case.robot.robot)
    with _in_a_file(data) as path:
        return diagnosing.diagnose(robot, path, case.held_out, tell=lambda note: None)


@contextmanager
def _in_a_file(data: Dataset) -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "campaign.h5"
        write_dataset(path, data, {})
        yield path


def _checked(dataset: Dataset, case: Case) -> Dataset:
    """The data as the reader of a file would hand them on."""
    limits = case.robot.robot.limits
    known = RecordingLimits(
        limits.lower, limits.upper, limits.velocity, limits.effort, ~case.robot.robot.sliding
    )
    runs, findings = checked(dataset.runs, case.spec.measurement, dataset.joint_names, known)
    return replace(dataset, runs=tuple(runs), findings=tuple(findings))


def _textbook(case: Case, data: Dataset) -> float:
    """The least error on the held-out part of the three fits."""
    errors = []
    for kinds in BOOKS:
        effects = [{"kind": kind, "joints": "all"} for kind in kinds]
        told = case.spec.model_dump(exclude_unset=True) | {"effects": effects}
        spec = Spec.model_validate(told | {"identification": {"inertias": "free"}})
        robot = RobotCase(spec, CONFIGS, case.robot.robot)
        with _in_a_file(data) as path:
            errors.append(identify(robot, load_data(robot, path)).error.mean_relative_moving)
    return min(errors)


def oracle(case: Case, dataset: Dataset) -> Diagnosis:
    """The diagnosis with the truth declared."""
    specs = [spec for plant in case.plants for each in plant.effects for spec in _spec(each, case)]
    effects = tuple(spec for k, spec in enumerate(specs) if spec not in specs[:k])
    search = case.spec.diagnosis.model_copy(update={"rounds": 0, "kinds": ("armature",)})
    update = {"effects": (*(case.spec.effects or ()), *effects), "diagnosis": search}
    robot = case.robot
    return diagnose(robot.robot, robot.base, dataset, case.spec.model_copy(update=update))


def _spec(planted: PlantedEffect, case: Case) -> list[EffectSpec]:
    """The effect as columns that the declared model does not have yet; none if it has no name."""
    effect, names = planted.effect, case.robot.robot.joint_names
    declared = case.friction == "declared"
    if effect.kind not in catalogue() or (declared and effect.kind in PLAIN):
        return []
    joints = tuple(names[j] for j in effect.joints)
    own = EffectSpec(
        kind=effect.kind, joints=joints, shape=dict(effect.shape), runs=effect.runs or "all"
    )
    others = identity(Name(effect.kind, joints), declared)
    return [EffectSpec(kind=o.kind, joints=o.joints, shape={}, runs="all") for o in others] or [own]


def truth_of(case: Case, deck: Deck) -> Truth:
    """What was planted, in words; runs are asked about where they differ."""
    robot = case.robot.robot
    if deck.beside != "before":
        return Truth(case.plants, robot.n, case.friction)
    training = frozenset(case.runs) - {case.held_out}
    last = robot.joint_names[leaves(robot)[-1]]
    return Truth(case.plants, robot.n, case.friction, training, last)


def answer_of(found: Diagnosis, dataset: Dataset, deck: Deck) -> Answer:
    """The diagnosis in words. Beside a textbook only what is confirmed counts, by its own name."""
    refined = {
        (kind, each.effect.joints)
        for each in found.effects
        for kind in catalogue()[each.effect.kind].deviates_from
    }
    named = [_named(each, refined) for each in found.effects]
    if deck.beside == "textbook":
        sure = [each.verdict is HeldOutVerdict.CONFIRMED for each in found.effects]
        named = [
            replace(each, aliases=(), approximation=each.approximation or not yes)
            for each, yes in zip(named, sure, strict=True)
        ]
    return Answer(
        tuple(named),
        tuple(Name(each.kind, each.joints) for each in found.absorbed),
        frozenset(found.joints_with_residual),
        differences(found),
        frozenset(j for f in dataset.findings if f.kind == "saturated" for j in f.joints),
    )


def differences(found: Diagnosis) -> frozenset[Name]:
    """By what two training recordings are said to differ: `<kind> of <joints> by <size>`."""
    text = " ".join(each.text for each in found.findings if each.kind == "runs_differ")
    parts = re.findall(r"(\w+) of (\w+(?: and \w+)*) by [+-]", text)
    return frozenset(Name(kind, tuple(joints.split(" and "))) for kind, joints in parts)


def _named(each: NamedEffect, refined: set[tuple[str, tuple[str, ...]]]) -> Named:
    """Sizes of plain friction beside a refinement are those of a line, and of no parameter."""
    plain = (each.effect.kind, each.effect.joints) in refined
    sizes = {} if plain else {name: (v.value, v.std) for name, v in each.parameters.items()}
    aliases = tuple(_called(alias) for alias in each.aliases)
    return Named(_called(each.effect), aliases, bool(each.approximates), sizes)


def _called(record: EffectRecord) -> Called:
    runs = frozenset(run.split("/")[0] for run in record.runs)
    return Called(Name(record.kind, record.joints), runs, record.covariate)


def rests(case: Case, data: Recorded, found: Diagnosis) -> dict[str, float]:
    """RMS of what the diagnosed model leaves of the training torque, over that of the noise."""
    known = {each.name for each in fields(Processing)}
    kept = {name: value for name, value in found.processing.items() if name in known}
    processing = Processing(**kept)
    n = case.robot.robot.n
    noise, left, counted = np.zeros(n), np.zeros(n), np.zeros((2, n))
    for run in data.sound.runs:
        if run.name == case.held_out:
            continue
        prepared = prepare(replace(run, tau=data.noise[run.name], valid=None), processing)
        noise += np.square(np.where(prepared.usable, prepared.tau, 0.0)).sum(axis=0)
        counted[0] += prepared.usable.sum(axis=0)
    for trace in found.traces.runs if found.traces else ():
        residual = np.where(trace.counted, trace.measured - trace.predicted, 0.0)
        left += np.square(residual).sum(axis=0)
        counted[1] += trace.counted.sum(axis=0)
    floor = np.maximum(noise / np.maximum(counted[0], 1), 1e-300)
    ratio = np.sqrt(left / np.maximum(counted[1], 1) / floor)
    names = case.robot.robot.joint_names
    return {name: float(x) for name, x, c in zip(names, ratio, counted[0], strict=True) if c > 20}


def _describe(outcome: Outcome, case: Case) -> None:
    outcome.group, outcome.words = case.group, case.words or f"{len(case.motions)} runs"
    outcome.robot, outcome.friction = case.robot.name, case.friction
    outcome.held_out = case.held_out or ""
    if (made := case.instruments) is not None:
        outcome.noise, outcome.correlation = made.noise, made.correlation
    elif case.data is None:
        outcome.noise = case.settings.torque_noise
        outcome.correlation = case.settings.noise_correlation
    required = [plant for plant in case.plants if plant.required]
    outcome.planted = [
        {
            "kind": plant.kinds[0],
            "joints": list(plant.joints),
            "words": plant.in_words,
            "values": [float(x) for x in plant.effects[0].values],
            "shape": dict(plant.effects[0].effect.shape),
            "by_run": dict(plant.by_run),
            "ratio": plant.ratio,
            "visible": visible,
        }
        for plant, visible in zip(required, case.visible or [np.nan] * len(required), strict=True)
    ]


def _fill(outcome: Outcome, found: Diagnosis, answer: Answer, result: Score, deck: Deck) -> None:
    for each, judged in zip(found.effects, result.names, strict=True):
        evidence = data_of(each)
        outcome.named.append({**evidence.pop("effect"), **evidence, "judged": judged})
    outcome.unexplained = [data_of(each) for each in found.excess_residuals if each.certain]
    outcome.left = sorted(answer.said)
    outcome.found, outcome.right, outcome.wrong = list(result.found), result.right, result.wrong
    outcome.detected, outcome.seen, outcome.extra = result.detected, result.there, result.extra
    outcome.sizes = [
        {**asdict(size), "within": size.within, "first_order": size.first_order}
        for size in result.sizes
    ]
    says_more = deck.beside == "before" and bool(found.unexplained or answer.said)
    outcome.alarm = says_more or any(each not in ("true", "companion") for each in result.names)
    whole = "mean_relative" if deck.beside == "before" else "mean_relative_moving"
    outcome.before, outcome.after = getattr(found.before, whole), getattr(found.after, whole)
    elsewhere = all(each.effect.runs for each in found.effects)  # and not in the held-out run
    most = outcome.before * (_UNCHANGED if elsewhere else 1.0)
    outcome.worse = bool(found.effects) and not outcome.after < most
    outcome.admitted = not found.good
    outcome.worse_joints = [joint for joint in found.joint_names if _unsaid_worse(found, joint)]


def _unsaid_worse(found: Diagnosis, joint: str) -> bool:
    """Whether a joint's held-out error rose clearly, and all effects on it pass for confirmed."""
    rose = found.after.rms[joint] > ROSE * found.before.rms[joint]
    on_it = [each for each in found.effects if joint in each.effect.joints]
    return rose and {str(e.verdict or "confirmed") for e in on_it} == {"confirmed"} and found.good


def outcomes_of(
    judged: Callable[[int, int], T], seed: int, indices: Sequence[int], workers: int
) -> Iterator[T]:
    """Outcomes as they come, by processes with one thread each for their matrices."""
    if workers < 2:
        for index in indices:
            yield _one(judged, seed, index)
        return
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as processes:
        for done in as_completed([processes.submit(_one, judged, seed, i) for i in indices]):
            yield done.result()


def _one(judged: Callable[[int, int], T], seed: int, index: int) -> T:
    with threadpool_limits(1):
        return judged(seed, index)


def write(path: Path, seed: int, outcomes: Sequence[Outcome]) -> None:
    """Everything as JSON, whole after each case."""
    cases = [asdict(o) for o in sorted(outcomes, key=lambda o: o.index)]
    content = {"seed": seed, "cases": cases}
    text = json.dumps(content, indent=1, ensure_ascii=False, default=_plain)
    write_text_atomically(path, text)


def _plain(value: object) -> object:
    return float(value) if isinstance(value, np.generic) else str(value)
