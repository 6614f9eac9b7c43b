"""What a diagnosis is worth, given what was planted: pure functions of records.

`right`: the truth, or an alias set of at most three that holds it, is named, or it is told as
absorbed. `wrong`: a name that is not true, itself or through its aliases. `extra`: plain friction
named beside a refinement of it on a robot that has none declared; neither right nor wrong. What the
diagnosis itself calls an approximation of something else is neither, too (on clean data it is a
false alarm like any name).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from excite_cli.effects.catalogue import catalogue

Verdict = Literal["true", "alias", "identity", "companion", "extra", "approximation", "wrong"]

MOST_ALIASES = 3
PLAIN = ("viscous_friction", "coulomb_friction")
REFINEMENTS = (
    "asymmetric_friction",
    "nonlinear_viscous_friction",
    "stribeck_friction",
    "load_dependent_friction",
    "position_friction",
    "dahl_friction",
    "friction_drift",
    "coupled_friction",
)
ROBOT_WIDE = ("base_tilt", "payload", "contact")


@dataclass(frozen=True)
class Name:
    """Kind and joints, in words."""

    kind: str
    joints: tuple[str, ...]


@dataclass(frozen=True)
class Plant:
    """What is in the robot: its name, the joints it touches, plain friction that comes with it."""

    name: Name
    touched: tuple[str, ...]
    companions: tuple[Name, ...] = ()


@dataclass(frozen=True)
class Found:
    """A named effect with its alias set, or one that is only said to come near the truth."""

    name: Name
    aliases: tuple[Name, ...] = ()
    approximation: bool = False


@dataclass(frozen=True)
class Answer:
    """What a diagnosis says; `saturated`: joints whose torque the checks of the data call so."""

    found: tuple[Found, ...]
    absorbed: tuple[Name, ...] = ()
    unexplained: tuple[str, ...] = ()
    saturated: tuple[str, ...] = ()


@dataclass(frozen=True)
class Score:
    """`found`: of every plant whether it is right; `names`: what every named effect is."""

    found: tuple[bool, ...]
    names: tuple[Verdict, ...]
    detected: bool
    unexplained_there: bool

    @property
    def right(self) -> bool:
        return bool(self.found) and all(self.found)

    @property
    def wrong(self) -> bool:
        return "wrong" in self.names

    @property
    def extra(self) -> bool:
        return "extra" in self.names


def same(planted: Name, named: Name, joints: int) -> bool:
    """Whether a name is that of what was planted, on a robot with so many joints."""
    if planted.kind != named.kind:
        return False
    if planted.kind in ROBOT_WIDE:
        return True
    if planted.kind == "torque_delay" and len(planted.joints) == joints:
        return True
    return set(planted.joints) == set(named.joints)


def score(planted: Sequence[Plant], answer: Answer, friction: bool, joints: int) -> Score:
    """Judge an answer; `friction`: plain friction is declared on all of the `joints`."""
    names = tuple(_verdict(found, planted, answer, friction, joints) for found in answer.found)
    right = tuple(_is_right(plant, answer, friction, joints) for plant in planted)
    touched = {joint for plant in planted for joint in plant.touched}
    there = bool(touched & set(answer.unexplained))
    named_there = any(touched & set(found.name.joints) for found in answer.found)
    return Score(
        found=right,
        names=names,
        detected=bool(planted) and (any(right) or named_there or there),
        unexplained_there=there,
    )


def _is_right(plant: Plant, answer: Answer, friction: bool, joints: int) -> bool:
    if any(_means(found, plant.name, joints) for found in answer.found if not found.approximation):
        return True
    if any(same(plant.name, name, joints) for name in answer.absorbed):
        return True
    if plant.name.kind == "torque_saturation" and set(plant.name.joints) <= set(answer.saturated):
        return True
    parts = identity(plant.name, friction)
    names = [found.name for found in answer.found if not found.approximation]
    return bool(parts) and all(part in names for part in parts)


def identity(planted: Name, friction: bool) -> tuple[Name, ...]:
    """Other names that together are the same columns as what was planted."""
    kind = catalogue().get(planted.kind)
    others = () if kind is None else kind.same_as
    return tuple(Name(o, planted.joints) for o in others if not (friction and o in PLAIN))


def _means(found: Found, planted: Name, joints: int) -> bool:
    if same(planted, found.name, joints):
        return True
    few = len(found.aliases) <= MOST_ALIASES
    return few and any(same(planted, alias, joints) for alias in found.aliases)


def _verdict(
    found: Found, planted: Sequence[Plant], answer: Answer, friction: bool, joints: int
) -> Verdict:
    if found.approximation:
        return "approximation"
    if any(same(plant.name, found.name, joints) for plant in planted):
        return "true"
    if any(_means(found, plant.name, joints) for plant in planted):
        return "alias"
    if any(found.name in identity(plant.name, friction) for plant in planted):
        return "identity"
    if any(found.name in plant.companions for plant in planted):
        return "companion"
    if not friction and found.name.kind in PLAIN:
        for plant in planted:
            refined = plant.name.kind in REFINEMENTS
            if refined and set(found.name.joints) <= set(plant.name.joints):
                return "extra"
    return "wrong"
