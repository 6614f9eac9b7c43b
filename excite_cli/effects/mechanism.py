"""How an effect gets into a simulated robot and into files of models, MJCF and C."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, cast

import numpy as np

from excite_cli.effects.simulated_robot import JOINT_PARTS

if TYPE_CHECKING:
    from excite_cli.effects.base import Effect
    from excite_cli.effects.parameter import Parameter
    from excite_cli.effects.simulated_robot import SimulatedRobot
    from excite_cli.robot.model import Array


class Mechanism:
    """The effect as a part of a robot that is simulated, or of a file that holds a model."""

    parameters: ClassVar[tuple[Parameter, ...]]
    shapes: ClassVar[tuple[Parameter, ...]] = ()
    joints: tuple[int, ...]

    defaults: ClassVar[Mapping[str, float]] = {}  # of `planted`, for what is not named
    data_defect: ClassVar[bool] = False  # lies in the measurement, not in the robot
    takes_from: ClassVar[tuple[str, ...]] = ()  # kinds of its joint that it stands for a part of
    # The number that people know it by, if that is not the first linear parameter; and settings of
    # its mechanism that nobody identifies.
    known_by: ClassVar[str] = ""
    settings: ClassVar[Mapping[str, float]] = {}

    @classmethod
    def planted(cls, value: float, others: Mapping[str, float]) -> tuple[dict[str, float], Array]:
        """Shape and linear parameters for `value` of the first parameter and named `others`.

        What is not named takes its place in `defaults`; without one, the middle (geometric mean)
        of its usual range if it is a shape, zero if it is a linear parameter.
        """
        given = {**cls.defaults, **others}
        values = np.array([value, *(given.get(p.name, 0.0) for p in cls.parameters[1:])])
        shape = {
            p.name: float(given[p.name]) if p.name in given else float(np.sqrt(p.low * p.high))
            for p in cls.shapes
        }
        return shape, values

    def build_into(
        self, robot: SimulatedRobot, values: Array, numbers: Mapping[str, float]
    ) -> None:
        """Put the effect into a simulated robot.

        By default what MuJoCo's joint has a part for becomes that part, a defect of the data
        changes what is recorded, and all else acts through its own formula. `numbers` are all by
        name: linear parameters, shape and `settings`.
        """
        effect = cast("Effect", self)
        if self.data_defect:
            robot.falsify(effect, values)
            return
        parts = self.mjcf(values)
        if parts and JOINT_PARTS.issuperset(parts) and len(self.joints) == 1:
            robot.add_to_joint(self.joints[0], parts)
        else:
            robot.apply(effect, values)
        robot.tell_controller(effect, values)

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """C statements that add its torque to `tau` (`c_code`); `columns` of the log by name.

        Empty: C has no such effect.
        """
        return ""

    def in_c_series(self, values: Array) -> str:
        """The same for a recorded series as a whole, where an instant alone tells too little.

        `count`, `step`, `q`, `v`, `a`, `load` (rows), `torque` to add to, and `spare` to work in.
        """
        return ""

    def urdf(self, values: Array) -> dict[str, float]:
        """Attributes of the URDF's <dynamics> that hold this effect; empty if none can."""
        return {}

    def mjcf(self, values: Array) -> dict[str, float]:
        """Attributes of MuJoCo's <joint> that hold this effect; empty if none can."""
        return {}

    def put_into_mjcf(self, parts: MjcfParts, values: Array) -> bool:
        """Add it to a MuJoCo model; false if that cannot hold it."""
        return len(self.joints) == 1 and parts.add(self.joints[0], self.mjcf(values))


# Parts of a MuJoCo model that effects become: attributes of joints, tendons, gravity.

# Attributes of a joint that add up; `damping_2`, `damping_3` belong to v|v| and v³.
ADDED = ("damping", "damping_2", "damping_3", "frictionloss", "armature")


@dataclass(frozen=True)
class Tendon:
    """A tendon of the length q_first + ratio q_second, with `friction` [N·m] and `damping`."""

    first: int
    second: int
    ratio: float
    friction: float
    damping: float


@dataclass
class MjcfParts:
    """`joints`: attributes of every <joint>; `tendons`; `gravity` (3,) [m/s²].

    `polynomials`: whether MuJoCo's damping may be a polynomial of the speed (from version 4 on).
    """

    joints: list[dict[str, float]]
    gravity: Array
    polynomials: bool = False
    tendons: list[Tendon] = field(default_factory=list)

    def add(self, joint: int, found: dict[str, float]) -> bool:
        """Add attributes; false if they cannot be, beside those that are there."""
        own = self.joints[joint]
        powers = any(name in found for name in ("damping_2", "damping_3"))
        if not found or (powers and not self.polynomials):
            return False
        if any(name in own and name not in ADDED for name in found):
            return False
        if any(found[name] < 0 for name in ADDED if name in found):
            return False
        for name, value in found.items():
            own[name] = own.get(name, 0.0) + value if name in ADDED else value
        return True


# What the C code of effects is written with: numbers, and the names that stand for the state.
#
# In the code of an effect `q`, `v`, `a` are the state, `s` the smoothed signs of the speeds,
# `load` the torque that the gears carry, `torque` all of the robot's, `tau` what the code adds
# to, each with an entry per joint; `t` and `start` are times in the recording and on the
# campaign's clock, `column` further columns of the log, `load_rate`, `load_bend` and
# `torque_rate` the first and second rates of those torques, `memory` what effects remember
# (`memory->since` is the time from the last instant to this one); it is kept only where all of an
# instant is finite. `slopes(q, v, a, j, x, y, z, out)` gives x ∂τ/∂q_j + y ∂τ/∂v_j + z ∂τ/∂a_j of
# the rigid bodies, `tilted(roll, pitch, q, out)` what a turned base adds, `pushed(j, f, q, out)`
# what a force at the frame of joint j does; the template says how.


def real(x: float) -> str:
    """A number with all its digits."""
    return f"R({float(x)!r})"


def reals(x: Array) -> str:
    """Numbers with commas between them."""
    return ", ".join(real(each) for each in np.ravel(x))


def all_joints(call: str) -> str:
    """`call` fills `out` (EXCITE_JOINTS); it is added to the torque of all joints."""
    return f"{{ real out[N]; {call}; for (int i = 0; i < N; ++i) tau[i] += out[i]; }}"
