"""One case from its making to its score: simulate, check the data, diagnose, compare to the oracle.

The oracle knows the truth: the same data with the planted effects declared and nothing looked for.
"""

import time
import traceback
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace

import numpy as np

from benchmarks.battery.cases import Case
from benchmarks.battery.decks import DECKS
from benchmarks.battery.scoring import Answer, Found, Name, Plant, Score, identity, score
from benchmarks.battery.sizes import Sized
from excite_cli.config.data_spec import EffectSpec
from excite_cli.diagnosis.diagnose import diagnose
from excite_cli.diagnosis.records import Diagnosis, EffectRecord
from excite_cli.diagnosis.words import approximation_in_words
from excite_cli.effects.catalogue import catalogue, declared_effects
from excite_cli.identification.errors_of_torque import Errors
from excite_cli.measurement.dataset import Dataset
from excite_cli.measurement.limits import Limits
from excite_cli.measurement.quality import checked, raise_for_errors
from excite_cli.robot.model import Robot
from excite_cli.simulation.ground_truth import Planted
from excite_cli.simulation.simulate import simulate


@dataclass
class Outcome:
    """A case in plain words and numbers, for tables and files."""

    index: int
    group: str
    kind: str
    robot: str = ""
    friction: bool = False
    noise: float = 0.0
    correlation: float = 0.0
    encoder: float = 0.0
    planted: list[dict] = field(default_factory=list)
    found: list[dict] = field(default_factory=list)
    absorbed: bool = False
    unexplained: list[dict] = field(default_factory=list)
    findings: list[str] = field(default_factory=list)
    score: dict = field(default_factory=dict)
    detected: bool = False
    right: bool = False
    wrong: bool = False
    extra: bool = False
    before: float = float("nan")
    after: float = float("nan")
    oracle: float = float("nan")
    ratio: float = float("nan")
    joint_ratio: float = float("nan")
    tracking: float = float("nan")
    seconds: dict[str, float] = field(default_factory=dict)
    error: str = ""


@dataclass(frozen=True)
class Judged:
    """An outcome, with the records that a person wants to see of a single case."""

    outcome: Outcome
    case: Case | None = None
    dataset: Dataset | None = None
    diagnosis: Diagnosis | None = None


def judge(seed: int, index: int, with_oracle: bool = True, deck: str = "catalogue") -> Judged:
    """Make and judge one case of a deck; what goes wrong is part of the outcome."""
    group, kind = DECKS[deck].label(seed, index)
    outcome = Outcome(index, group, kind)
    try:
        return _judged(outcome, DECKS[deck].make_case(seed, index), with_oracle)
    except Exception:
        outcome.error = traceback.format_exc()
        return Judged(outcome)


def _judged(outcome: Outcome, case: Case, with_oracle: bool) -> Judged:
    robot, began = case.robot.robot, time.perf_counter()
    _describe(outcome, case)
    declared = declared_effects(case.spec.effects, robot)
    effects = [p for one in case.planted for p in (one.planted, *one.companions)]
    simulation = simulate(robot, case.motions, case.settings, effects, declared)
    outcome.tracking = float(np.max([e.max() for e in simulation.tracking.values()]))
    outcome.seconds["simulate"] = time.perf_counter() - began
    dataset = _checked(simulation.dataset, case)
    outcome.findings = [f"{f.severity} {f.kind} {f.run} {f.joints}" for f in dataset.findings]
    raise_for_errors(dataset)
    began = time.perf_counter()
    found = diagnose(robot, case.robot.base, dataset, case.spec)
    outcome.seconds["diagnose"] = time.perf_counter() - began
    _fill(outcome, found, _score(case, found, dataset))
    outcome.before = found.before.mean_relative_moving
    outcome.after = found.after.mean_relative_moving
    if with_oracle and case.group not in ("outside", "history"):
        began = time.perf_counter()
        best = oracle(case, dataset)
        outcome.seconds["oracle"] = time.perf_counter() - began
        outcome.oracle = best.mean_relative_moving
        outcome.ratio = outcome.after / outcome.oracle
        outcome.joint_ratio = _joint_ratio(case, found.after, best)
    return Judged(outcome, case, dataset, found)


def _joint_ratio(case: Case, after: Errors, best: Errors) -> float:
    """The worst of the joints on which an effect is strongest."""
    names = case.robot.robot.joint_names
    ratios = [
        after.relative_moving[names[one.strongest]] / best.relative_moving[names[one.strongest]]
        for one in case.planted
    ]
    return max(ratios, default=float("nan"))


def _checked(dataset: Dataset, case: Case) -> Dataset:
    """The data as the reader of a file would hand them on."""
    limits = case.robot.robot.limits
    known = Limits(
        limits.lower, limits.upper, limits.velocity, limits.effort, ~case.robot.robot.sliding
    )
    runs, findings = checked(dataset.runs, case.spec.measurement, dataset.joint_names, known)
    return replace(dataset, runs=tuple(runs), findings=tuple(findings))


def oracle(case: Case, dataset: Dataset) -> Errors:
    """Errors on the held-out run with the truth declared."""
    names = case.robot.robot.joint_names
    truth = [
        _spec_of(record)
        for one in case.planted
        for each in (one.planted, *one.companions)
        for record in _declarable(each, case.has_friction, names)
    ]
    effects = tuple(_unique(truth))
    search = case.spec.diagnosis.model_copy(update={"rounds": 0, "kinds": ("armature",)})
    spec = case.spec.model_copy(
        update={"effects": (*(case.spec.effects or ()), *effects), "diagnosis": search}
    )
    return diagnose(case.robot.robot, case.robot.base, dataset, spec).after


def _unique(specs: Sequence[EffectSpec]) -> list[EffectSpec]:
    """Without a plain friction twice on a joint."""
    found: list[EffectSpec] = []
    for spec in specs:
        if spec not in found:
            found.append(spec)
    return found


def _declarable(planted: Planted, friction: bool, names: tuple[str, ...]) -> list[EffectRecord]:
    """The effect as columns that the declared model does not have yet."""
    effect = planted.effect
    record = EffectRecord(
        effect.kind, tuple(names[j] for j in effect.joints), dict(effect.shape), (), effect.runs
    )
    if effect.kind not in catalogue():
        return []  # no declaration knows it
    if friction and effect.kind in ("viscous_friction", "coulomb_friction"):
        return []
    others = identity(Name(record.kind, record.joints), friction)
    return [EffectRecord(other.kind, other.joints) for other in others] or [record]


def _spec_of(record: EffectRecord) -> EffectSpec:
    return EffectSpec(
        kind=record.kind, joints=record.joints, shape=record.shape, runs=record.runs or "all"
    )


def _score(case: Case, found: Diagnosis, dataset: Dataset) -> Score:
    robot = case.robot.robot
    return score(
        [plant_of(one, robot) for one in case.planted],
        answer_of(found, dataset),
        case.has_friction,
        robot.n,
    )


def plant_of(one: Sized, robot: Robot) -> Plant:
    """The effect in words."""
    names = robot.joint_names
    return Plant(
        Name(one.planted.effect.kind, tuple(names[j] for j in one.planted.effect.joints)),
        tuple(names[j] for j in one.touched),
        tuple(
            Name(p.effect.kind, tuple(names[j] for j in p.effect.joints)) for p in one.companions
        ),
    )


def answer_of(found: Diagnosis, dataset: Dataset) -> Answer:
    """The diagnosis in words."""
    return Answer(
        tuple(
            Found(
                _name(each.effect),
                tuple(_name(alias) for alias in each.aliases),
                bool(each.approximates),
            )
            for each in found.effects
        ),
        tuple(Name(each.kind, each.joints) for each in found.absorbed),
        found.joints_with_residual,
        tuple(j for f in dataset.findings if f.kind == "saturated" for j in f.joints),
    )


def _name(record: EffectRecord) -> Name:
    return Name(record.kind, record.joints)


def _describe(outcome: Outcome, case: Case) -> None:
    robot = case.robot.robot
    outcome.robot, outcome.friction = case.robot.name, case.has_friction
    outcome.noise = case.settings.torque_noise
    outcome.correlation = case.settings.noise_correlation
    outcome.encoder = case.settings.encoder
    outcome.planted = [
        {
            "kind": one.planted.effect.kind,
            "joints": [robot.joint_names[j] for j in one.planted.effect.joints],
            "values": [float(x) for x in one.planted.values],
            "shape": dict(one.planted.effect.shape),
            "runs": list(one.planted.effect.runs),
            "ratio": one.ratio,
            "visible": visible,
            "strongest": robot.joint_names[one.strongest],
            "touched": [robot.joint_names[j] for j in one.touched],
        }
        for one, visible in zip(case.planted, case.visible, strict=True)
    ]


def _fill(outcome: Outcome, found: Diagnosis, result: Score) -> None:
    outcome.found = [
        {
            "kind": each.effect.kind,
            "joints": list(each.effect.joints),
            "shape": each.effect.shape,
            "values": list(each.effect.values),
            "sizes": {name: (x.value, x.std) for name, x in each.parameters.items()},
            "runs": list(each.effect.runs),
            "p_value": each.p_value,
            "share": each.share_of_residual,
            "gain": each.gain,
            "verdict": verdict,
            "approximates": (
                approximation_in_words(each.approximates) if each.approximates else ""
            ),
            "aliases": [{"kind": a.kind, "joints": list(a.joints)} for a in each.aliases],
        }
        for each, verdict in zip(found.effects, result.names, strict=True)
    ]
    outcome.unexplained = [
        {
            "joint": each.joint,
            "share": each.predictable,
            "depends_on": tuple(covariate.code for covariate in each.depends_on),
        }
        for each in found.large_rests
        if each.certain
    ]
    kinds = {(p["kind"], tuple(p["joints"])) for p in outcome.planted}
    outcome.absorbed = any((a.kind, a.joints) in kinds for a in found.absorbed)
    outcome.score = asdict(result)
    outcome.detected, outcome.right = result.detected, result.right
    outcome.wrong, outcome.extra = result.wrong, result.extra
