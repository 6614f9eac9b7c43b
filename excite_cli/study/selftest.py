"""Whether a diagnosis gives away what is planted: which effects, and what its answer is worth.

With S the effects that an answer confirms, and p the planted one on its joints,

    wrong       some of S is on other joints, and p is not among its aliases;
    found       p is in S, or all effects that together are the same torque as p;
    confounded  p is an alias of some of S; or S, or an approximation, names another effect on a
                joint of p; or the answer lists p among those that inertias take up;
    not found   none of these.

The first that holds is the outcome. What was planted beside p, since p refines it, is neither asked
for nor wrong. Effects that an answer names without confirming them do not count, right or wrong.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from math import nan
from typing import Any

import numpy as np

from excite_cli.effects.base import Effect, Tier
from excite_cli.effects.catalogue import catalogue, shows
from excite_cli.robot.model import Robot
from excite_cli.shown.answer import Shown
from excite_cli.simulation.ground_truth import PlantedEffect, plant, sized
from excite_cli.study.records import CaseRecord

_RARE = 10.0  # `Effect.prior_cost` [χ²] of what one robot in a hundred has
_BESIDE = 0  # seed of the sizes of what comes with an effect


class Outcome(StrEnum):
    """What a diagnosis makes of a planted effect."""

    FOUND = "found"
    CONFOUNDED = "confounded"
    NOT_FOUND = "not found"
    WRONG = "wrong"


@dataclass(frozen=True)
class Name:
    """Kind and names of joints."""

    kind: str
    joints: tuple[str, ...]

    def __str__(self) -> str:
        """`spring@elbow`."""
        return f"{self.kind}@{'+'.join(self.joints)}"


@dataclass(frozen=True)
class Said:
    """An effect of an answer, its `aliases`, and whether it is `sure` or only comes `near`."""

    name: Name
    aliases: tuple[Name, ...] = ()
    sure: bool = True
    near: bool = False


def judge(
    planted: Name,
    said: Sequence[Said],
    beside: Collection[Name] = (),
    absorbed: Collection[Name] = (),
) -> tuple[Outcome, tuple[Name, ...]]:
    """The outcome (see the module), and the names that are wrong."""
    sure = [each for each in said if each.sure and not each.near and each.name not in beside]
    here = set(planted.joints)
    wrong = tuple(
        each.name
        for each in sure
        if not (_same(planted, each.name) or here & {*each.name.joints} or planted in each.aliases)
    )
    if wrong:
        return Outcome.WRONG, wrong
    parts = {Name(kind, planted.joints) for kind in catalogue()[planted.kind].same_as}
    names = {each.name for each in said if each.sure and not each.near}
    if any(_same(planted, name) for name in names) or (parts and parts <= names):
        return Outcome.FOUND, ()
    close = any(each.near and here & {*each.name.joints} for each in said)
    told = sure or close or any(_same(planted, name) for name in absorbed)
    return (Outcome.CONFOUNDED if told else Outcome.NOT_FOUND), ()


def _same(planted: Name, name: Name) -> bool:
    """Whether it is that effect; of what the whole robot has, joints are no part of its name."""
    whole = catalogue()[planted.kind].scope == "robot"
    return planted.kind == name.kind and (whole or set(planted.joints) == set(name.joints))


def usual_effects(robot: Robot, declared: Sequence[Effect], seed: int) -> list[PlantedEffect]:
    """What many robots have on one joint, beside the `declared`, in sizes as those are simulated.

    A size is 3 to 10 % of its joint's torque; that of a defect of the data a twentieth of its
    largest usual one.
    """
    there = {effect.place for effect in declared}
    found = []
    for kind in catalogue().values():
        per_joint = kind.scope == "joint" and not (kind.carried or kind.per_run)
        dated = kind.of_campaign or kind.follows_covariate or bool(kind.changes_of)
        if per_joint and not dated and kind.tier < Tier.LAST and kind.prior_cost < _RARE:
            shape, _ = kind.planted(0.0, {})
            found += [kind(place, shape) for place in kind.places(robot)]
    asked = [each for each in found if each.place not in there and shows(each, robot)]
    return [replace(each, declared=False) for each in sized(robot, asked, seed)]


def beside(planted: PlantedEffect, robot: Robot, declared: Sequence[Effect]) -> list[PlantedEffect]:
    """Effects of the same joints that it refines, as far as they are not `declared`."""
    there = {effect.place for effect in declared}
    kinds = [catalogue()[name] for name in planted.effect.refines]
    found = [plant(kind, planted.effect.joints, 0.0).effect for kind in kinds]
    asked = [each for each in found if each.place not in there]
    return [replace(each, declared=False) for each in sized(robot, asked, _BESIDE)]


def spread(effects: Sequence[PlantedEffect], count: int, seed: int) -> list[PlantedEffect]:
    """So many of the effects, in an order that spreads them over kinds and joints, by `seed`."""
    order = [effects[k] for k in np.random.default_rng([seed, 3]).permutation(len(effects))]
    chosen: list[PlantedEffect] = []
    while order and len(chosen) < count:
        kinds = [each.effect.kind for each in chosen]
        joints = [each.effect.joints for each in chosen]
        best = min(
            order, key=lambda it: kinds.count(it.effect.kind) + joints.count(it.effect.joints)
        )
        order = [each for each in order if each is not best]
        chosen.append(best)
    return chosen


@dataclass(frozen=True)
class SelftestCase:
    """One planted effect and what a diagnosis makes of it; `outcome` is None where that failed.

    `effect`: as `excite simulate --effect` takes it. `planted`: its size in `unit`; `found` ± `std`
    what the diagnosis says, NaN where it is not named. `power`: the probability with which motions
    like these were predicted to name it, NaN where nothing is predicted. `before` and `after`: mean
    error of the held-out torque, as a share. `named`: effects of the answer that are confirmed;
    `wrong`: those that are not there.
    """

    effect: str
    kind: str
    joints: tuple[str, ...]
    outcome: Outcome | None
    planted: float
    unit: str
    found: float = nan
    std: float = nan
    power: float = nan
    before: float = nan
    after: float = nan
    named: tuple[str, ...] = ()
    wrong: tuple[str, ...] = ()
    message: str = ""
    seconds: float = 0.0


@dataclass(frozen=True, repr=False)
class Selftest(Shown):
    """What a diagnosis makes of each planted effect: `cases` that were done, of `asked`.

    `joint_names` (n,) of the `robot`.
    """

    robot: str
    joint_names: tuple[str, ...]
    cases: tuple[SelftestCase, ...]
    asked: int

    def count(self, outcome: Outcome | None) -> int:
        """How many cases ended so; None: failed."""
        return sum(case.outcome is outcome for case in self.cases)

    @property
    def good(self) -> bool:
        """Whether no case is wrong, and none failed."""
        return not self.count(Outcome.WRONG) and not self.count(None)


def case_of(record: CaseRecord, planted: PlantedEffect, joints: Sequence[str]) -> SelftestCase:
    """A case as its record has it; names `joints` (n,) of the robot."""
    figures, number = record.figures, planted.number
    value = planted.effect.parameters
    unit = next((p.unit for p in (*value, *planted.effect.shapes) if p.name == number), "")
    known: dict[str, Any] = {
        key: float(figures[key])
        for key in ("found", "std", "power", "before", "after")
        if figures.get(key) is not None
    }
    known |= {key: tuple(figures.get(key, "").split()) for key in ("named", "wrong")}
    return SelftestCase(
        record.values["effect"],
        planted.effect.kind,
        tuple(joints[j] for j in planted.effect.joints),
        Outcome(figures["outcome"]) if figures else None,
        planted.named()[number],
        figures.get("unit", unit),
        **known,
        message=record.message,
        seconds=record.seconds,
    )
