"""Whether a diagnosis gives away what is planted: which effects, and what its answer is worth.

With S the effects that an answer confirms, and p the planted one on its joints, it is

    wrong       where some of S is on other joints, and p is not among its aliases;
    found       where p is in S, or all effects that together are the same torque as p;
    confounded  where p is an alias of some of S; where S, or an approximation, names another effect
                on a joint of p; or where the answer lists p among those that inertias take up;
    not found   else.

The first that holds counts. What was planted beside p, since p refines it, is neither asked for nor
wrong; nor is what an answer names without confirming it. Before the trial, with the probabilities a
that p is named and confirmed, and b that it is preferred to every other effect, both of
`diagnosis/predicted_outcome.py`, the outcome is predicted as

    confounded  where inertias take p up;
    not found   where a ≤ 0.2;
    confounded  where b ≤ 0.2;
    found       where a b ≥ 0.8;
    open        else.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from math import nan

import numpy as np

from excite_cli.effects.base import Effect, Tier
from excite_cli.effects.catalogue import catalogue, shows
from excite_cli.robot.model import Robot
from excite_cli.shown.answer import Shown
from excite_cli.simulation.ground_truth import PlantedEffect, plant, sized

_RARE = 10.0  # `Effect.prior_cost` [χ²] of what one robot in a hundred has
_UNLIKELY, _LIKELY = 0.2, 0.8  # probabilities that are taken for no and yes
OPEN = "open"
_BESIDE = 0  # seed of the sizes of what comes with an effect
Name = tuple[str, tuple[str, ...]]  # kind, names of joints


class Outcome(StrEnum):
    """What a diagnosis makes of a planted effect."""

    FOUND = "found"
    CONFOUNDED = "confounded"
    NOT_FOUND = "not found"
    WRONG = "wrong"
    FAILED = "failed"


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
    kind, joints = planted
    sure = [each for each in said if each.sure and not each.near]
    more = [each for each in sure if each.name not in beside]
    there = [each for each in said if _same(planted, each.name) or {*joints} & {*each.name[1]}]
    wrong = tuple(e.name for e in more if e not in there and planted not in e.aliases)
    if wrong:
        return Outcome.WRONG, wrong
    names = {each.name for each in sure}
    parts = {(part, joints) for part in catalogue()[kind].same_as}
    if any(_same(planted, name) for name in names) or (parts and parts <= names):
        return Outcome.FOUND, ()
    close = more or planted in absorbed or any(each.near for each in there)
    return (Outcome.CONFOUNDED if close else Outcome.NOT_FOUND), ()


def predicted(named: float, apart: float, absorbed: bool) -> str:
    """The outcome that these probabilities say (see the module), or that it is open."""
    if absorbed:
        return Outcome.CONFOUNDED
    if named <= _UNLIKELY:
        return Outcome.NOT_FOUND
    if apart <= _UNLIKELY:
        return Outcome.CONFOUNDED
    return Outcome.FOUND if named * apart >= _LIKELY else OPEN


def _same(planted: Name, name: Name) -> bool:
    """Whether it is that effect; of what the whole robot has, joints are no part of its name."""
    whole = catalogue()[planted[0]].scope == "robot"
    return planted[0] == name[0] and (whole or {*planted[1]} == {*name[1]})


def usual_effects(robot: Robot, declared: Sequence[Effect], seed: int) -> list[PlantedEffect]:
    """What many robots have on one joint, with 3 to 10 % of its torque, beside the `declared`."""
    found: list[Effect] = []
    for kind in catalogue().values():
        dated = kind.of_campaign or kind.follows_covariate or bool(kind.changes_of)
        usual = kind.tier < Tier.LAST and kind.prior_cost < _RARE
        if kind.scope == "joint" and usual and not (dated or kind.carried or kind.per_run):
            shape, _ = kind.planted(0.0, {})
            found += [kind(place, shape) for place in kind.places(robot)]
    return _planted([each for each in found if shows(each, robot)], robot, declared, seed)


def beside(planted: PlantedEffect, robot: Robot, declared: Sequence[Effect]) -> list[PlantedEffect]:
    """Effects of the same joints that it refines, as far as they are not `declared`.

    What it takes from comes beside what is declared: that may be less than it takes.
    """
    kinds = [catalogue()[name] for name in planted.effect.refines]
    found = [plant(kind, planted.effect.joints, 0.0).effect for kind in kinds]
    there = [each for each in declared if each.kind not in planted.effect.takes_from]
    return _planted(found, robot, there, _BESIDE)


def _planted(
    effects: Sequence[Effect], robot: Robot, declared: Sequence[Effect], seed: int
) -> list[PlantedEffect]:
    there = {effect.place for effect in declared}
    new = [each for each in effects if each.place not in there]
    return [replace(each, declared=False) for each in sized(robot, new, seed)]


def spread(effects: Sequence[PlantedEffect], count: int, seed: int) -> list[PlantedEffect]:
    """So many of the effects, in an order that spreads them over kinds and joints, by `seed`."""
    order = [effects[k] for k in np.random.default_rng([seed, 3]).permutation(len(effects))]
    chosen: list[PlantedEffect] = []
    while order and len(chosen) < count:
        kinds = [each.effect.kind for each in chosen]
        joints = [each.effect.joints for each in chosen]
        counts = [kinds.count(it.effect.kind) + joints.count(it.effect.joints) for it in order]
        chosen.append(order.pop(counts.index(min(counts))))
    return chosen


@dataclass(frozen=True)
class SelftestCase:
    """One planted effect and what a diagnosis makes of it, or the `message` that it failed with.

    `effect`: as `excite simulate --effect` takes it. `planted`: its size in `unit`; `found` ± `std`
    in the answer. `power`: predicted probability to name it, `apart` to prefer it to the `rival`,
    the effect that is most like it; `predicted`: the outcome that they say, or `open`. `before`,
    `after`: mean error of the held-out torque, as a share. NaN: not known. `named`: what the answer
    confirms; `wrong` of it.
    """

    effect: str
    kind: str
    joints: tuple[str, ...]
    planted: float
    power: float = nan
    apart: float = nan
    rival: str = ""
    predicted: str = ""
    outcome: str = Outcome.FAILED
    unit: str = ""
    found: float = nan
    std: float = nan
    before: float = nan
    after: float = nan
    named: str = ""
    wrong: str = ""
    message: str = ""
    seconds: float = 0.0


@dataclass(frozen=True, repr=False)
class Selftest(Shown):
    """What a diagnosis makes of each planted effect: `cases` that were done, of `asked`."""

    robot: str
    joint_names: tuple[str, ...]
    cases: tuple[SelftestCase, ...]
    asked: int

    def count(self, outcome: str) -> int:
        """How many cases ended so."""
        return sum(case.outcome == outcome for case in self.cases)

    @property
    def good(self) -> bool:
        """Whether no case is wrong, and none failed."""
        return not (self.count(Outcome.WRONG) or self.count(Outcome.FAILED))
