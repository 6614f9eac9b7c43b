"""What is put into simulated robots beside the catalogue: bodies anywhere, moved masses, maps.

They are planted only; a diagnosis does not know them.
"""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from excite_cli.dynamics.pseudo_inertia import pseudo_inertias, ten_parameters
from excite_cli.dynamics.regressor import PARAMETERS_PER_BODY
from excite_cli.effects.base import Effect, Parameter, Signals
from excite_cli.effects.sign import smooth_sign
from excite_cli.effects.simulated_robot import SimulatedRobot
from excite_cli.robot.model import Array, Robot


def solid(mass: float, center: Array, rng: np.random.Generator, density: float = 1500.0) -> Array:
    """Ten parameters of a solid sphere or box of `mass` [kg] with its centre there [m]."""
    volume = mass / (density * rng.uniform(0.3, 2.0))
    if rng.uniform() < 0.5:
        second = np.full(3, mass * (3 * volume / (4 * np.pi)) ** (2 / 3) / 5)
    else:
        sides = np.exp(rng.uniform(-0.7, 0.7, 3))
        sides *= (volume / sides.prod()) ** (1 / 3)
        second = mass * sides**2 / 12
    turned = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    moments = turned @ np.diag(second) @ turned.T + mass * np.outer(center, center)
    first = mass * center
    return ten_parameters(
        np.block([[moments, first[:, None]], [first[None, :], np.array([[mass]])]])
    )


def slice_of(robot: Robot, joint: int) -> slice:
    """Where φ holds the body that moved `joint` carries."""
    bodies = len(robot.model.inertias) - 1
    start = PARAMETERS_PER_BODY * (bodies - robot.n + joint)
    return slice(start, start + PARAMETERS_PER_BODY)


class Carried(Effect):
    """A body fixed to what the one joint named carries; values are its ten parameters there."""

    kind: ClassVar = "payload"
    title: ClassVar = "a body on any link"
    signature: ClassVar = ""
    parameters: ClassVar = (
        Parameter("mass", "kg", 0.05, 50.0),
        *(Parameter(name, "kg·m", 0.001, 20.0) for name in ("mx", "my", "mz")),
        *(Parameter(name, "kg·m²", 1e-4, 10.0) for name in ("Ixx", "Ixy", "Iyy", "Ixz", "Iyz",
                                                              "Izz")),
    )  # fmt: skip

    def build_into(
        self, robot: SimulatedRobot, values: Array, numbers: Mapping[str, float]
    ) -> None:
        """The body has more inertia."""
        robot.phi[slice_of(robot.robot, self.joints[0])] += values

    def rows(self, n: int) -> tuple[int, ...]:
        """All joints."""
        return tuple(range(n))

    def columns(self, signals: Signals) -> Array:
        """Its ten columns of Y, (T, n, 10)."""
        robot = signals.body.robot
        return signals.body.regressor[:, :, slice_of(robot, self.joints[0])]


class MovedCenters(Effect):
    """Every body's centre of mass lies elsewhere by the three values given for its joint [m]."""

    kind: ClassVar = "moved_centers"
    title: ClassVar = "centres of mass that differ from the URDF's"
    signature: ClassVar = ""
    parameters: ClassVar = (Parameter("shift", "m", 0.0, 0.1),)

    def build_into(
        self, robot: SimulatedRobot, values: Array, numbers: Mapping[str, float]
    ) -> None:
        """Each body's mass is moved as a whole."""
        for joint, shift in zip(self.joints, values.reshape(-1, 3), strict=True):
            part = slice_of(robot.robot, joint)
            change = np.eye(4)
            change[:3, 3] = shift
            robot.phi[part] = ten_parameters(
                change @ pseudo_inertias(robot.phi[part])[0] @ change.T
            )

    def columns(self, signals: Signals) -> Array:
        """None: it is absorbed by the inertial parameters."""
        return np.zeros((len(signals.t), len(self.joints), 3 * len(self.joints)))


class PositionMap(Effect):
    """τ_j = A Σ_k w_k cos(a_k q_j + b_k q_i + c_k): a smooth torque over two positions.

    As hoses, springs across joints and magnets make it. Energy is not kept account of.
    """

    kind: ClassVar = "outside:position_map"
    title: ClassVar = "torque over two positions"
    signature: ClassVar = ""
    parameters: ClassVar = (Parameter("height", "N·m", 0.01, 300.0),)

    def rows(self, n: int) -> tuple[int, ...]:
        """The first joint."""
        return self.joints[:1]

    def columns(self, signals: Signals) -> Array:
        """(T, 1, 1)."""
        own, other = (signals.q[:, j] for j in self.joints)
        s = self.shape
        bump = np.exp(
            -(((own - s["own"]) / s["width"]) ** 2) - ((other - s["other"]) / s["width"]) ** 2
        )
        wave = np.cos(s["turns"] * own + s["turns"] * s["slope"] * other)
        return (wave + 1.5 * bump)[:, None, None]


class DirectionMap(Effect):
    """τ_j = A sgn(v_j) (1 + sin(n q_i + φ)): dry friction that another joint's angle loads."""

    kind: ClassVar = "outside:direction_map"
    title: ClassVar = "friction over another joint's position"
    signature: ClassVar = ""
    parameters: ClassVar = (Parameter("height", "N·m", 0.01, 300.0, nonnegative=True),)

    def rows(self, n: int) -> tuple[int, ...]:
        """The first joint."""
        return self.joints[:1]

    def columns(self, signals: Signals) -> Array:
        """(T, 1, 1)."""
        j, other = self.joints
        shape = 1.0 + np.sin(self.shape["turns"] * signals.q[:, other] + self.shape["phase"])
        return (smooth_sign(signals.v[:, j]) * shape)[:, None, None]


class SpeedProduct(Effect):
    """τ_j = A v_j v_i², a product of two quantities: drag that grows with another joint's speed."""

    kind: ClassVar = "outside:speed_product"
    title: ClassVar = "drag that another joint's speed raises"
    signature: ClassVar = ""
    parameters: ClassVar = (Parameter("height", "N·m·s³", 0.001, 300.0, nonnegative=True),)

    def rows(self, n: int) -> tuple[int, ...]:
        """The first joint."""
        return self.joints[:1]

    def columns(self, signals: Signals) -> Array:
        """(T, 1, 1)."""
        j, other = self.joints
        return (signals.v[:, j] * signals.v[:, other] ** 2)[:, None, None]


MAPS: tuple[type[Effect], ...] = (PositionMap, DirectionMap, SpeedProduct)


def map_shape(kind: type[Effect], rng: np.random.Generator, ranges: Array) -> dict[str, float]:
    """Numbers of a map's form; `ranges` (2, 2): lowest and highest of both positions."""
    if kind is PositionMap:
        own, other = (float(rng.uniform(*each)) for each in ranges)
        width = 0.3 * float(np.ptp(ranges, axis=1).mean())
        turns = float(rng.uniform(1.3, 3.0))
        slope = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 1.5))
        return {"own": own, "other": other, "width": width, "turns": turns, "slope": slope}
    if kind is DirectionMap:
        return {"turns": float(rng.uniform(1.0, 3.0)), "phase": float(rng.uniform(0, 2 * np.pi))}
    return {}
