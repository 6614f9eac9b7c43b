"""What an effect may change of the robot that is simulated, so that it is in it as in a real one.

Effects say so themselves (`Effect.build_into`); the simulation makes a MuJoCo model of the outcome
and knows none of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from excite_cli.effects.base import Effect
    from excite_cli.robot.model import Array, Robot

# Attributes of MuJoCo's <joint> that `add_to_joint` takes.
JOINT_PARTS = frozenset({"damping", "frictionloss", "armature", "stiffness", "springref"})
_ROTOR_SHARE = 0.5  # of the link's inertia, for a rotor whose size nobody said


@dataclass(frozen=True)
class Transmission:
    """Between a motor and its link: rotor [kg·m²], stiffness [N·m/rad], damping, backlash [rad].

    `sensed_before`: the recorded torque is that of the motor, which also turns the rotor; otherwise
    that which enters the gear.
    """

    rotor: float
    sensed_before: bool
    stiffness: float = 0.0
    damping: float = 0.0
    play: float = 0.0


@dataclass(frozen=True)
class DryCoupling:
    """Dry friction `force` on v_first + direction · v_second."""

    first: int
    second: int
    direction: float
    force: float


@dataclass(frozen=True)
class Push:
    """A force (3,) [N] on the frame of `joint`, in axes of the world, from `start` to `end`."""

    force: Array
    start: float
    end: float
    joint: int


class Hysteresis(Protocol):
    """Torque of one joint that depends on where the joint came from."""

    def begin(self, q: float, v: float) -> None:
        """A run begins at this position and speed."""

    def torque(self, q: float, v: float) -> float:
        """What is taken off the motor's torque at the next control step; asked once a step."""


class SimulatedRobot(Protocol):
    """One run's robot while effects are put into it; arrays are (n,) per moved joint.

    What it is: `phi` (10·n_bodies,) its inertias, `gravity` (3,), `soft` transmissions by joint,
    `couplings`, `pushes`, and the torque `clip` at which motors stop. What its instruments make of
    it: `position_offset` is added to positions; the torque is late by `delay`, saturates as
    `reading` (n, 2) says (sharpness and level), is scaled by 1 + `gain` and moved by `offset`.
    """

    robot: Robot
    phi: Array
    gravity: Array
    clip: Array
    position_offset: Array
    reading: Array
    delay: Array
    gain: Array
    offset: Array
    soft: dict[int, Transmission]
    couplings: list[DryCoupling]
    pushes: list[Push]

    def link_inertia(self, joint: int) -> float:
        """What `joint` turns at the reference posture with all others held [kg·m²]."""

    def add_to_joint(self, joint: int, parts: Mapping[str, float]) -> None:
        """More, or less, of these attributes of MuJoCo's joint (`JOINT_PARTS`); springs add up."""

    def apply(self, effect: Effect, values: Array) -> None:
        """The effect's own formula acts as a torque at every control step."""

    def remember(self, joint: int, hysteresis: Hysteresis) -> None:
        """The torque of `hysteresis` acts on `joint`, which it follows from step to step."""

    def tell_controller(self, effect: Effect, values: Array) -> None:
        """The robot's controller knows the effect and compensates a share of it."""

    def falsify(self, effect: Effect, values: Array) -> None:
        """The effect's own formula is added to the recorded torque; nothing else happens."""


def rotor_inertia(robot: SimulatedRobot, joint: int, given: float) -> float:
    """`given` [kg·m²], or a rotor that goes with the link if that is zero."""
    return given if given > 0.0 else _ROTOR_SHARE * robot.link_inertia(joint)
