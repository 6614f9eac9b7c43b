"""One campaign from its making to its score: simulate, record, diagnose as a user would, compare.

The data go to a file and through the library's front door. Whether a rest is large is judged by the
truth: the residual of the diagnosed model on training data against the noise that was added, both
through the filters of that diagnosis.
"""

import re
import tempfile
import time
import traceback
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path

import numpy as np

from benchmarks.battery.motions import CONFIGS
from benchmarks.campaigns.cases import Case, group_of, make_case
from benchmarks.campaigns.instruments import Recorded, recorded
from benchmarks.campaigns.robots import leaves
from benchmarks.campaigns.scoring import Answer, Called, Name, Named, Score, Truth, score
from excite_cli.api.diagnosing import diagnose
from excite_cli.api.loading import Case as RobotCase
from excite_cli.diagnosis.records import Diagnosis, EffectRecord, NamedEffect
from excite_cli.effects.catalogue import catalogue, declared_effects
from excite_cli.errors import ExciteError
from excite_cli.identification.prepare import prepare
from excite_cli.identification.processing import Processing
from excite_cli.measurement.hdf5_writer import write_dataset
from excite_cli.simulation.simulate import simulate

LARGE = 2.5  # times the noise floor
ROSE = 1.25  # times the error before, of a joint
# An error that no effect concerns need not fall: it changes with the parameters of all runs.
_UNCHANGED = 1.02


@dataclass
class Outcome:
    """A case in plain words and numbers, for tables and files.

    `left`: joints of which it is said that more than noise is left. `rest`: residual over noise
    floor by joint. `silent`: joints of which a large rest is not said. `refused`: the data, sound
    as they are, were not taken. `worse`: the held-out error did not fall (of effects in other runs
    alone: it rose), `admitted`: and the program says so. `worse_joints`: where it rose, and no
    effect there is doubted. `seconds` are of the processor.
    """

    index: int
    group: str
    robot: str = ""
    runs: int = 0
    held_out: str = ""
    friction: str = ""
    noise: float = 0.0
    correlation: float = 0.0
    planted: list[str] = field(default_factory=list)
    named: list[dict] = field(default_factory=list)
    found: list[bool] = field(default_factory=list)
    sizes: list[dict] = field(default_factory=list)
    unexplained: list[dict] = field(default_factory=list)
    left: list[str] = field(default_factory=list)
    rest: dict[str, float] = field(default_factory=dict)
    silent: list[str] = field(default_factory=list)
    right: bool = False
    wrong: bool = False
    refused: bool = False
    worse: bool = False
    admitted: bool = False
    worse_joints: list[str] = field(default_factory=list)
    before: float = float("nan")
    after: float = float("nan")
    seconds: dict[str, float] = field(default_factory=dict)
    error: str = ""

    @property
    def alarm(self) -> bool:
        """Anything said that is not so, for a robot that lacks nothing."""
        false = any(each["judged"] not in ("true", "companion") for each in self.named)
        return false or bool(self.unexplained or self.left)


@dataclass(frozen=True)
class Judged:
    """An outcome, with the records that a person wants to see of a single case."""

    outcome: Outcome
    case: Case | None = None
    diagnosis: Diagnosis | None = None


def judge(seed: int, index: int) -> Judged:
    """Make and judge one case; what goes wrong is part of the outcome."""
    outcome = Outcome(index, group_of(seed, index))
    try:
        return _judged(outcome, make_case(seed, index))
    except Exception:
        outcome.error = traceback.format_exc()
        return Judged(outcome)


def campaign(case: Case) -> Recorded:
    """The data of a case."""
    declared = () if case.friction != "declared" else case.spec.effects or ()
    played = simulate(
        case.robot.robot,
        case.motions,
        case.settings,
        case.planted,
        declared_effects(declared, case.robot.robot),
    )
    return recorded(played.dataset, case.instruments)


def _judged(outcome: Outcome, case: Case) -> Judged:
    _describe(outcome, case)
    began = time.process_time()
    data = campaign(case)
    outcome.seconds["simulate"] = time.process_time() - began
    began = time.process_time()
    try:
        found = _diagnosed(case, data)
    except ExciteError as error:
        outcome.refused, outcome.error = True, f"{type(error).__name__}: {error}"
        return Judged(outcome, case)
    finally:
        outcome.seconds["diagnose"] = time.process_time() - began
    answer = answer_of(found)
    _fill(outcome, found, answer, score(truth_of(case), answer))
    outcome.rest = rests(case, data, found)
    outcome.silent = [
        joint
        for joint, ratio in outcome.rest.items()
        if ratio > LARGE and joint not in _told(found)
    ]
    return Judged(outcome, case, found)


def _diagnosed(case: Case, data: Recorded) -> Diagnosis:
    robot = RobotCase(case.spec, CONFIGS, case.robot.robot)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "campaign.h5"
        write_dataset(path, data.dataset, {})
        return diagnose(robot, path, case.held_out, tell=lambda note: None)


def truth_of(case: Case) -> Truth:
    """What was planted, in words."""
    robot = case.robot.robot
    return Truth(
        case.plants,
        frozenset(case.runs) - {case.held_out},
        robot.joint_names,
        robot.joint_names[leaves(robot)[-1]],
        case.friction,
    )


def answer_of(found: Diagnosis) -> Answer:
    """The diagnosis in words."""
    refined = {
        (kind, each.effect.joints)
        for each in found.effects
        for kind in catalogue()[each.effect.kind].deviates_from
    }
    return Answer(
        tuple(_named(each, refined) for each in found.effects),
        tuple(Name(each.kind, each.joints) for each in found.absorbed),
        frozenset(_left(found)),
        _differences(found),
    )


def _differences(found: Diagnosis) -> frozenset[Name]:
    """By what two training recordings are said to differ: `<kind> of <joints> by <size>`."""
    text = " ".join(each.text for each in found.findings if each.kind == "runs_differ")
    parts = re.findall(r"(\w+) of (\w+(?: and \w+)*) by [+-]", text)
    return frozenset(Name(kind, tuple(joints.split(" and "))) for kind, joints in parts)


def _named(each: NamedEffect, refined: set[tuple[str, tuple[str, ...]]]) -> Named:
    """Sizes of plain friction beside a refinement are those of a line, and of no parameter."""
    plain = (each.effect.kind, each.effect.joints) in refined
    sizes = {} if plain else {name: (v.value, v.std) for name, v in each.parameters.items()}
    return Named(
        _called(each.effect),
        tuple(_called(alias) for alias in each.aliases),
        bool(each.approximates),
        sizes,
    )


def _called(record: EffectRecord) -> Called:
    runs = frozenset(run.split("/")[0] for run in record.runs)
    return Called(Name(record.kind, record.joints), runs, record.covariate)


def _left(found: Diagnosis) -> list[str]:
    """Joints of which it is certain that more than noise is left."""
    return [each.joint for each in found.large_rests if each.certain]


def _told(found: Diagnosis) -> set[str]:
    """Joints of which anything is said that is left."""
    near = {joint for each in found.approximations for joint in each.effect.joints}
    return near | {each.joint for each in found.large_rests}


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
    ratio = np.sqrt(left / np.maximum(counted[1], 1) / np.maximum(noise / np.maximum(counted[0], 1),
                                                                   1e-300))  # fmt: skip
    names = case.robot.robot.joint_names
    return {name: float(x) for name, x, c in zip(names, ratio, counted[0], strict=True) if c > 20}


def _describe(outcome: Outcome, case: Case) -> None:
    outcome.robot, outcome.friction = case.robot.name, case.friction
    outcome.runs, outcome.held_out = len(case.runs), case.held_out
    outcome.noise, outcome.correlation = case.instruments.noise, case.instruments.correlation
    outcome.planted = [plant.in_words for plant in case.plants if plant.required]


def _fill(outcome: Outcome, found: Diagnosis, answer: Answer, result: Score) -> None:
    outcome.named = [
        {
            "kind": each.effect.kind,
            "joints": list(each.effect.joints),
            "runs": list(each.effect.runs),
            "covariate": each.effect.covariate,
            "parameters": {n: [v.value, v.std] for n, v in each.parameters.items()},
            "p_value": each.p_value,
            "share": each.share_of_residual,
            "judged": judged,
            "verdict": str(getattr(each, "verdict", None) or ""),
            "aliases": [
                {"kind": a.name.kind, "joints": list(a.name.joints), "runs": sorted(a.runs)}
                for a in named.aliases
            ],
        }
        for each, named, judged in zip(found.effects, answer.named, result.names, strict=True)
    ]
    outcome.unexplained = [
        {
            "joint": each.joint,
            "share": each.predictable,
            "depends_on": [covariate.code for covariate in each.depends_on],
        }
        for each in found.unexplained
    ]
    outcome.left = _left(found)
    outcome.found, outcome.right, outcome.wrong = list(result.found), result.right, result.wrong
    outcome.sizes = [
        {**asdict(size), "within": size.within, "first_order": size.first_order}
        for size in result.sizes
    ]
    outcome.before, outcome.after = found.before.mean_relative, found.after.mean_relative
    elsewhere = all(each.effect.runs for each in found.effects)  # and not in the held-out run
    outcome.worse = bool(found.effects) and not outcome.after < outcome.before * (
        _UNCHANGED if elsewhere else 1.0
    )
    outcome.admitted = not getattr(found, "good", True)
    outcome.worse_joints = [joint for joint in found.joint_names if _unsaid_worse(found, joint)]


def _unsaid_worse(found: Diagnosis, joint: str) -> bool:
    """Whether a joint's held-out error rose clearly, and all effects on it pass for confirmed."""
    rose = found.after.rms[joint] > ROSE * found.before.rms[joint]
    on_it = [each for each in found.effects if joint in each.effect.joints]
    verdicts = {str(getattr(each, "verdict", None) or "confirmed") for each in on_it}
    return rose and verdicts == {"confirmed"} and getattr(found, "good", True)
