"""What an answer is worth, given what was planted: pure functions of records, for every deck.

`right`: the truth, or an alias set of at most three that holds it, is named, or it is told as
absorbed. `wrong`: a name that is not true, itself or through its aliases. `extra`: plain friction
named beside a refinement of it on a robot that has none declared; neither right nor wrong. What the
diagnosis itself calls an approximation of something else is neither, too (on clean data it is a
false alarm like any name).

Where recordings differ, the runs of a name must be right as well: exactly those that were trained
on and have the effect; or the others, where the same effect in all runs is in the model too, which
is the same model with the opposite sign. Several names of one kind and place, each of some of those
runs, count as one. A trend over the runs may also go by two levels if those are the trend, to 98 %.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from excite_cli.effects.catalogue import catalogue
from excite_cli.simulation.ground_truth import PlantedEffect

Verdict = Literal["true", "alias", "identity", "companion", "extra", "approximation", "wrong"]

MOST_ALIASES = 3
PLAIN = ("viscous_friction", "coulomb_friction")
REFINEMENTS = (
    "asymmetric_friction",
    "nonlinear_viscous_friction",
    "stribeck_friction",
    "load_dependent_friction",
    "gear_loss",
    "position_friction",
    "dahl_friction",
    "friction_drift",
    "coupled_friction",
)
ROBOT_WIDE = ("base_tilt", "payload", "contact")
# Effects whose columns are the first order of what they stand for.
FIRST_ORDER = ("base_tilt", "encoder_offset", "elasticity", "backlash", "torque_delay")
# Names of friction that changes over the campaign as a whole.
TRENDS = ("friction_change", "friction_drift", "friction_trend")
_AS_TWO_LEVELS = 0.98
# The same motor or sensor in all runs, of which some runs may differ.
_TWO_SIDED = ("coulomb_friction", "viscous_friction", "torque_offset", "torque_gain")


@dataclass(frozen=True)
class Name:
    """Kind and joints, in words."""

    kind: str
    joints: tuple[str, ...]


@dataclass(frozen=True)
class Plant:
    """One cause: the `effects` in the robot, and its name.

    `kinds` are the names it may go by, on `joints` or `anywhere`. `runs`: those that have it;
    empty: all. `covariate`: the column of the log that it follows. `by_run`: how strong it is in
    each run, where that changes all the time. `sizes`: its parameters as a diagnosis reports them.
    `companions`: plain friction that comes with it. `touched`: joints whose torque it changes,
    the `strongest` by this `ratio` of RMS.
    What is not `required` is true, but nobody asks for it; what is not `nameable` is outside the
    catalogue, and has to be told as unexplained.
    """

    kinds: tuple[str, ...]
    joints: tuple[str, ...]
    effects: tuple[PlantedEffect, ...] = ()
    runs: frozenset[str] = frozenset()
    by_run: Mapping[str, float] = field(default_factory=dict)
    sizes: Mapping[str, float] = field(default_factory=dict)
    companions: tuple[Name, ...] = ()
    touched: tuple[str, ...] = ()
    strongest: str = ""
    ratio: float = float("nan")
    anywhere: bool = False
    required: bool = True
    nameable: bool = True
    covariate: str = ""

    @property
    def name(self) -> Name:
        return Name(self.kinds[0], self.joints)

    @property
    def in_words(self) -> str:
        """`payload@j6 in run_2+run_3`."""
        runs = f" in {'+'.join(sorted(self.runs))}" if self.runs else ""
        column = f" by {self.covariate}" if self.covariate else ""
        changes = " over the runs" if self.by_run else runs
        return f"{self.kinds[0]}@{where(self.joints)}{changes}{column}"


@dataclass(frozen=True)
class Called:
    """A name, the runs it is said of (none: all), and the column that it is said to follow."""

    name: Name
    runs: frozenset[str] = frozenset()
    covariate: str = ""


@dataclass(frozen=True)
class Named:
    """A named effect: what it is called and could be called too, its sizes and their sd."""

    called: Called
    aliases: tuple[Called, ...] = ()
    approximation: bool = False
    sizes: Mapping[str, tuple[float, float]] = field(default_factory=dict)


@dataclass(frozen=True)
class Answer:
    """What a diagnosis says; `said`: joints of whose rest it says that it is unexplained.

    `differences`: by what two recordings are said to differ, which no model then has. `saturated`:
    joints whose torque the checks of the data call so.
    """

    named: tuple[Named, ...]
    absorbed: tuple[Name, ...] = ()
    said: frozenset[str] = frozenset()
    differences: frozenset[Name] = frozenset()
    saturated: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Truth:
    """What was planted, and how plain friction is: "declared", "undeclared" or "none".

    `training`: the runs that were trained on; none where runs are not asked about. `last_leaf`: on
    which a payload "of all joints" is.
    """

    plants: Sequence[Plant]
    joints: int
    friction: str = "none"
    training: frozenset[str] = frozenset()
    last_leaf: str = ""

    @property
    def declared(self) -> bool:
        return self.friction == "declared"


@dataclass(frozen=True)
class Size:
    """A planted parameter and what was reported of it, in standard deviations."""

    kind: str
    parameter: str
    true: float
    value: float
    std: float

    @property
    def within(self) -> bool:
        return bool(abs(self.value - self.true) <= 2.0 * self.std)

    @property
    def first_order(self) -> bool:
        return self.kind in FIRST_ORDER


@dataclass(frozen=True)
class Score:
    """Of every required plant whether it is right; what every name is; sizes of the right ones.

    `there`: whether a rest is said to be unexplained on a joint that was touched.
    """

    found: tuple[bool, ...]
    names: tuple[Verdict, ...]
    sizes: tuple[Size, ...]
    detected: bool
    there: bool

    @property
    def right(self) -> bool:
        return all(self.found)

    @property
    def wrong(self) -> bool:
        return "wrong" in self.names

    @property
    def extra(self) -> bool:
        return "extra" in self.names


def where(joints: Sequence[str]) -> str:
    """`j1+j2`, or `all` of many."""
    return "+".join(joints) if len(joints) < 4 else "all"


def score(truth: Truth, answer: Answer) -> Score:
    """Judge an answer."""
    names = tuple(_verdict(named, truth, answer) for named in answer.named)
    required = [plant for plant in truth.plants if plant.required]
    found = tuple(_found(plant, truth, answer) for plant in required)
    touched = {joint for plant in required for joint in plant.touched or plant.joints}
    there = bool(touched & answer.said)
    named_there = any(touched & set(each.called.name.joints) for each in answer.named)
    detected = bool(required) and (any(found) or named_there or there)
    return Score(found, names, tuple(_sizes(truth, answer)), detected, there)


def same(planted: Name, named: Name, joints: int) -> bool:
    """Whether a name is that of what was planted, on a robot with so many joints."""
    if planted.kind != named.kind:
        return False
    if planted.kind in ROBOT_WIDE:
        return True
    if planted.kind == "torque_delay" and len(planted.joints) == joints:
        return True
    return set(planted.joints) == set(named.joints)


def identity(planted: Name, friction: bool) -> tuple[Name, ...]:
    """Other names that together are the same columns as what was planted."""
    kind = catalogue().get(planted.kind)
    others = () if kind is None else kind.same_as
    return tuple(Name(o, planted.joints) for o in others if not (friction and o in PLAIN))


def plant_of_record(record: Mapping[str, Any]) -> Plant:
    """From the line of JSON in which `benchmarks.robots.planting` tells it."""
    return Plant(
        (record["kind"],),
        tuple(record["joints"]),
        companions=tuple(Name(kind, tuple(joints)) for kind, joints in record["companions"]),
        touched=tuple(record["touched"]),
    )


def answer_of_json(answer: Mapping[str, Any]) -> Answer:
    """From what `excite diagnose --json` says."""
    close = {(e["kind"], *e["joints"], *e["runs"]) for e in answer["approximations"]}
    named = tuple(
        Named(
            Called(_name(each)),
            tuple(Called(_name(alias)) for alias in each["alias_set"]),
            (each["kind"], *each["joints"], *each["runs"]) in close,
        )
        for each in answer["effects"]
    )
    saturated = [each["joints"] for each in answer["findings"] if each["kind"] == "saturated"]
    return Answer(
        named,
        tuple(map(_name, answer["absorbed"])),
        frozenset(each["joint"] for each in answer["unexplained"]),
        saturated=frozenset(joint for joints in saturated for joint in joints),
    )


def _name(each: Mapping[str, Any]) -> Name:
    return Name(each["kind"], tuple(each["joints"]))


def _found(plant: Plant, truth: Truth, answer: Answer) -> bool:
    if not plant.nameable:
        near = any(
            named.approximation and set(plant.joints) & set(named.called.name.joints)
            for named in answer.named
        )
        return near or bool(set(plant.joints) & answer.said)
    names = [named for named in answer.named if not named.approximation]
    if any(_means(named, plant, truth, answer) for named in names):
        return True
    if any(_kind_and_place(plant, name, truth) for name in answer.absorbed):
        return True
    if plant.kinds == ("torque_saturation",) and set(plant.joints) <= answer.saturated:
        return True
    if plant.runs and plant.name in answer.differences:
        return True
    parts = () if plant.runs or plant.by_run else identity(plant.name, truth.declared)
    return bool(parts) and all(any(p == n.called.name for n in names) for p in parts)


def _verdict(named: Named, truth: Truth, answer: Answer) -> Verdict:
    if named.approximation:
        return "approximation"
    if any(_is(named.called, plant, truth, answer) for plant in truth.plants):
        return "true"
    if any(_means(named, plant, truth, answer) for plant in truth.plants):
        return "alias"
    name = named.called.name
    steady = [plant for plant in truth.plants if not (plant.runs or plant.by_run)]
    if any(name in identity(plant.name, truth.declared) for plant in steady):
        return "identity"
    if any(name in plant.companions for plant in steady) or _level_of_all(named.called, truth):
        return "companion"
    if truth.friction == "none" and name.kind in PLAIN:
        for plant in steady:
            if plant.kinds[0] in REFINEMENTS and set(name.joints) <= set(plant.joints):
                return "extra"
    return "wrong"


def _level_of_all(called: Called, truth: Truth) -> bool:
    """The same effect in all runs beside a change in some of them, which is one model with it."""
    return not called.runs and any(
        called.name.kind in plant.kinds and called.name.joints == plant.joints
        for plant in truth.plants
        if (plant.runs or plant.by_run) and called.name.kind in _TWO_SIDED
    )


def _means(named: Named, plant: Plant, truth: Truth, answer: Answer) -> bool:
    if _is(named.called, plant, truth, answer):
        return True
    few = len(named.aliases) <= MOST_ALIASES
    return few and any(_is(alias, plant, truth, answer) for alias in named.aliases)


def _is(called: Called, plant: Plant, truth: Truth, answer: Answer) -> bool:
    if not plant.nameable or called.covariate != plant.covariate:
        return False
    if plant.by_run:
        return _is_trend(called, plant, truth)
    if not _kind_and_place(plant, called.name, truth):
        return False
    told, true = _trained(called.runs, truth), _trained(plant.runs, truth)
    of_held_out = called.runs - truth.training
    if told == truth.training - true and _opposite(called, truth, answer):
        return not of_held_out & plant.runs
    if plant.runs and not of_held_out <= plant.runs:
        return False  # it is said of a held-out run that does not have it
    if told == true:
        return True
    return told < true and true == frozenset().union(*_alike(called, true, truth, answer))


def _is_trend(called: Called, plant: Plant, truth: Truth) -> bool:
    if called.name.joints != plant.joints:
        return False
    if called.name.kind in TRENDS:
        return True
    if called.name.kind not in plant.kinds:
        return False
    runs = sorted(truth.training)
    levels = np.array([run in called.runs for run in runs], dtype=float)
    true = np.array([plant.by_run[run] for run in runs])
    if not called.runs or np.ptp(levels) == 0 or np.ptp(true) == 0:
        return False
    return bool(np.corrcoef(levels, true)[0, 1] ** 2 >= _AS_TWO_LEVELS)


def _kind_and_place(plant: Plant, name: Name, truth: Truth) -> bool:
    if name.kind != plant.kinds[0]:
        return False
    if plant.anywhere:
        return True
    if name.kind == "payload" and truth.last_leaf:
        # On the carrying joint; of all joints, on the last one.
        joints = name.joints if len(name.joints) == 1 else (truth.last_leaf,)
        return joints == plant.joints
    return same(plant.name, name, truth.joints)


def _trained(runs: frozenset[str], truth: Truth) -> frozenset[str]:
    return (runs & truth.training) if runs else truth.training


def _opposite(called: Called, truth: Truth, answer: Answer) -> bool:
    """Whether the same effect in all runs is in the model, so that either set is the other's."""
    name = called.name
    if name.kind not in _TWO_SIDED:
        return False
    everywhere = any(other.called.name == name and not other.called.runs for other in answer.named)
    return everywhere or (truth.declared and name.kind in PLAIN)


def _alike(
    called: Called, true: frozenset[str], truth: Truth, answer: Answer
) -> Iterable[frozenset[str]]:
    for other in answer.named:
        runs = _trained(other.called.runs, truth)
        if other.called.name == called.name and runs < true:
            yield runs


def _disturbed(plant: Plant, truth: Truth, answer: Answer) -> bool:
    """Whether its joint has no one value of it, or what else is there goes by another name.

    Friction counts as part of what was not found, or of what may be called so, too.
    """
    return any(
        set(plant.joints) & set(other.joints)
        and (
            plant.kinds[0] in other.kinds
            or not any(_is(named.called, other, truth, answer) for named in answer.named)
        )
        for other in truth.plants
        if other.required
    )


def _sizes(truth: Truth, answer: Answer) -> Iterable[Size]:
    for plant in truth.plants:
        if not plant.required and _disturbed(plant, truth, answer):
            continue
        for named in answer.named:
            if named.approximation or not _is(named.called, plant, truth, answer):
                continue
            if _trained(named.called.runs, truth) != _trained(plant.runs, truth):
                continue  # of another set of runs: another number
            for name, size in plant.sizes.items():
                value, std = named.sizes.get(name, (np.nan, np.nan))
                if np.isfinite([value, std, size]).all() and std > 0:
                    yield Size(plant.kinds[0], name, size, value, std)
