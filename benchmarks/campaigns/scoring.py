"""What an answer is worth, given what was planted: pure functions of records.

A name is right if kind and place are, and the runs: exactly those that were trained on and have the
effect; or the others, where the same effect in all runs is in the model too, which is the same
model with the opposite sign. Several names of one kind and place, each of some of those runs, count
as one. A trend over the runs may also go by two levels if those are the trend, to 98 %.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from benchmarks.battery.scoring import (
    MOST_ALIASES,
    PLAIN,
    REFINEMENTS,
    Name,
    Verdict,
    identity,
    same,
)
from benchmarks.campaigns.plants import FIRST_ORDER, TRENDS, Plant
from excite_cli.effects.base import Effect

_AS_TWO_LEVELS = 0.98
# The same motor or sensor in all runs, of which some runs may differ.
_TWO_SIDED = ("coulomb_friction", "viscous_friction", "torque_offset", "torque_gain")


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

    `differences`: by what two recordings are said to differ, which no model then has.
    """

    named: tuple[Named, ...]
    absorbed: tuple[Name, ...] = ()
    said: frozenset[str] = frozenset()
    differences: frozenset[Name] = frozenset()


@dataclass(frozen=True)
class Truth:
    """What was planted, the runs that were trained on, and plain friction that is declared."""

    plants: tuple[Plant, ...]
    training: frozenset[str]
    joints: tuple[str, ...]
    last_leaf: str
    friction: str = "none"

    @property
    def declared(self) -> tuple[str, ...]:
        return PLAIN if self.friction == "declared" else ()


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
    """Of every required plant whether it is right; what every name is; sizes of the right ones."""

    found: tuple[bool, ...]
    names: tuple[Verdict, ...]
    sizes: tuple[Size, ...]

    @property
    def right(self) -> bool:
        return all(self.found)

    @property
    def wrong(self) -> bool:
        return "wrong" in self.names


def score(truth: Truth, answer: Answer) -> Score:
    """Judge an answer."""
    names = tuple(_verdict(named, truth, answer) for named in answer.named)
    found = tuple(_found(plant, truth, answer) for plant in truth.plants if plant.required)
    return Score(found, names, tuple(_sizes(truth, answer)))


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
    own = Name(plant.kinds[0], plant.joints)
    if plant.runs and own in answer.differences:
        return True
    parts = () if plant.runs or plant.by_run else identity(own, bool(truth.declared))
    return bool(parts) and all(any(p == n.called.name for n in names) for p in parts)


def _verdict(named: Named, truth: Truth, answer: Answer) -> Verdict:
    if named.approximation:
        return "approximation"
    if any(_is(named.called, plant, truth, answer) for plant in truth.plants):
        return "true"
    if any(_means(named, plant, truth, answer) for plant in truth.plants):
        return "alias"
    name = named.called.name
    for plant in truth.plants:
        if plant.runs or plant.by_run:
            continue
        if name in identity(Name(plant.kinds[0], plant.joints), bool(truth.declared)):
            return "identity"
        if any(_effect_name(p.effect, truth) == name for p in plant.effects[1:]):
            return "companion"
        refined = plant.kinds[0] in REFINEMENTS and set(name.joints) <= set(plant.joints)
        if truth.friction == "none" and name.kind in PLAIN and refined:
            return "extra"
    if _level_of_all(named.called, truth):
        return "companion"
    return "wrong"


def _level_of_all(called: Called, truth: Truth) -> bool:
    """The same effect in all runs beside a change in some of them, which is one model with it."""
    return not called.runs and any(
        called.name.kind in plant.kinds and called.name.joints == plant.joints
        for plant in truth.plants
        if (plant.runs or plant.by_run) and called.name.kind in _TWO_SIDED
    )


def _effect_name(effect: Effect, truth: Truth) -> Name:
    return Name(effect.kind, tuple(truth.joints[j] for j in effect.joints))


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
    if name.kind == "payload":  # on the carrying joint; of all joints, on the last one
        where = name.joints if len(name.joints) == 1 else (truth.last_leaf,)
        return where == plant.joints
    return same(Name(name.kind, plant.joints), name, len(truth.joints))


def _trained(runs: frozenset[str], truth: Truth) -> frozenset[str]:
    return (runs & truth.training) if runs else truth.training


def _opposite(called: Called, truth: Truth, answer: Answer) -> bool:
    """Whether the same effect in all runs is in the model, so that either set is the other's."""
    name = called.name
    if name.kind not in _TWO_SIDED:
        return False
    everywhere = any(other.called.name == name and not other.called.runs for other in answer.named)
    return everywhere or name.kind in truth.declared


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
