"""Effects that are planted only: no name of the catalogue fits, or they are made in another way.

Those outside the catalogue are dissipative, conservative or a fault of the sensor, as real ones
are; whatever a diagnosis calls them is wrong. Friction with memory comes with the dry friction that
it is a part of, and is called by the catalogue's name; of Maxwell's elements that is not quite
true: they may as well be told as an approximation, or as unexplained, but by no other name.
"""

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from excite_cli.dynamics.pseudo_inertia import pseudo_inertias, ten_parameters
from excite_cli.dynamics.regressor import PARAMETERS_PER_BODY
from excite_cli.effects.base import Effect, Parameter, Scope, Signals
from excite_cli.effects.dahl_friction import DahlFriction
from excite_cli.effects.sign import smooth_sign
from excite_cli.effects.simulated_robot import SimulatedRobot
from excite_cli.robot.model import Array, Robot


class Unnamed(Effect):
    """No kind of the catalogue."""

    signature: ClassVar = ""
    one_row: ClassVar = False  # of several joints only the first one has a torque

    def rows(self, n: int) -> tuple[int, ...]:
        return self.joints[:1] if self.one_row else super().rows(n)


class RubbingSector(Unnamed):
    """τ_j = f exp(−(q_j − c)²/2w²) sgn v_j: a seal or a cable that rubs in one sector."""

    kind: ClassVar = "outside:rubbing_sector"
    title: ClassVar = "friction in one sector"
    parameters: ClassVar = (Parameter("friction", "N·m", 0.05, 300.0, nonnegative=True),)
    shapes: ClassVar = (Parameter("centre", "rad", 0.1, 3.0), Parameter("width", "rad", 0.1, 1.0))

    def columns(self, signals: Signals) -> Array:
        j = list(self.joints)
        away = (signals.q[:, j, None] - self.shape["centre"]) / self.shape["width"]
        return np.exp(-0.5 * away**2) * smooth_sign(signals.v[:, j, None])


class DistantCoupling(Unnamed):
    """τ_j = c v_k and τ_k = c v_j of joints that are no neighbours.

    With as much viscous friction of their own, which is declared, it only takes energy away.
    """

    kind: ClassVar = "outside:distant_coupling"
    title: ClassVar = "viscous coupling of joints that are no neighbours"
    scope: ClassVar[Scope] = "pair"
    parameters: ClassVar = (Parameter("viscous", "N·m·s/rad", 0.01, 100.0),)

    @classmethod
    def places(cls, robot: Robot) -> list[tuple[int, ...]]:
        return [(j, k) for j in range(robot.n) for k in range(j + 2, robot.n)]

    def columns(self, signals: Signals) -> Array:
        first, second = self.joints
        return np.stack([signals.v[:, second], signals.v[:, first]], axis=1)[:, :, None]


class HardeningSpring(Unnamed):
    """τ_j = k (q_j − q_0)³."""

    kind: ClassVar = "outside:hardening_spring"
    title: ClassVar = "spring that hardens"
    parameters: ClassVar = (Parameter("stiffness", "N·m/rad³", 0.01, 2000.0, nonnegative=True),)
    shapes: ClassVar = (Parameter("rest", "rad", 0.1, 3.0),)

    def columns(self, signals: Signals) -> Array:
        return (signals.q[:, list(self.joints), None] - self.shape["rest"]) ** 3


class TorqueHysteresis(Unnamed):
    """The sensor remembers: z' = τ'/w (1 − z sgn τ'), h z is added to the torque τ it shows."""

    kind: ClassVar = "outside:torque_hysteresis"
    title: ClassVar = "hysteresis of the torque sensor"
    parameters: ClassVar = (Parameter("height", "N·m", 0.01, 100.0, nonnegative=True),)
    shapes: ClassVar = (Parameter("width", "N·m", 0.1, 100.0),)
    data_defect: ClassVar = True

    def columns(self, signals: Signals) -> Array:
        torque = signals.torque[:, self.joints[0]]
        z = np.zeros(len(torque))
        for t, change in enumerate(np.diff(torque), start=1):
            # Exact over a step of constant direction, so it stays within ±1.
            side = np.sign(change)
            z[t] = side + (z[t - 1] - side) * np.exp(-abs(change) / self.shape["width"])
        return z[:, None, None]


OUTSIDE: tuple[type[Effect], ...] = (
    RubbingSector,
    DistantCoupling,
    HardeningSpring,
    TorqueHysteresis,
)


_STEP = 1e-3  # s, of the controller
_SUBSTEPS = 5
_SHARES = np.array([0.4, 0.3, 0.2, 0.1])  # of the friction that each element holds
_WAYS = np.array([0.25, 0.7, 1.6, 4.0])  # distances after which each of them slips


class _InTime(DahlFriction):
    """Friction of a joint with a memory of its own, in place of dry friction."""

    def memory(self, friction: float) -> Any:
        raise NotImplementedError

    def build_into(
        self, robot: SimulatedRobot, values: Array, numbers: Mapping[str, float]
    ) -> None:
        """At the joint."""
        for j in self.joints:
            robot.remember(j, self.memory(float(values[0])))
            robot.add_to_joint(j, {"frictionloss": -float(values[0])})
        robot.tell_controller(self, values)


class DahlBySpeed(_InTime):
    """dz/dt = v/d (1 − z sgn v), integrated over time by Euler's steps."""

    title: ClassVar = "Dahl friction, integrated over time"

    def memory(self, friction: float) -> Any:
        return _BySpeed(friction, self.shape["distance"])


class _BySpeed:
    def __init__(self, friction: float, distance: float) -> None:
        self._friction, self._distance, self._z = friction, distance, 0.0

    def begin(self, q: float, v: float) -> None:
        self._z = 0.0

    def torque(self, q: float, v: float) -> float:
        rate = v * _STEP / _SUBSTEPS / self._distance
        for _ in range(_SUBSTEPS):
            self._z += rate * (1.0 - self._z * np.sign(v))
        return self._friction * self._z


class MaxwellSlip(_InTime):
    """Four springs in parallel, each of which slips at its own force (Iwan, Maxwell slip)."""

    title: ClassVar = "Maxwell slip of four elements"

    def memory(self, friction: float) -> Any:
        return _Elements(friction, self.shape["distance"])

    def columns(self, signals: Signals) -> Array:
        elements = _Elements(1.0, self.shape["distance"])
        q, v = signals.q[:, self.joints[0]], signals.v[:, self.joints[0]]
        elements.begin(float(q[0]), float(v[0]))
        bent = np.array([elements.torque(float(x), 0.0) for x in q])
        return (bent - smooth_sign(v))[:, None, None]


class _Elements:
    def __init__(self, friction: float, distance: float) -> None:
        self._forces, self._ways = friction * _SHARES, distance * _WAYS
        self._q, self._bent = 0.0, np.zeros(len(_WAYS))

    def begin(self, q: float, v: float) -> None:
        self._q, self._bent = q, np.full(len(_WAYS), np.sign(v))

    def torque(self, q: float, v: float) -> float:
        self._bent = np.clip(self._bent + (q - self._q) / self._ways, -1.0, 1.0)
        self._q = q
        return float(self._forces @ self._bent)


HISTORY: Mapping[str, type[DahlFriction]] = {
    "dahl_by_speed": DahlBySpeed,
    "maxwell_slip": MaxwellSlip,
}


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


class Carried(Unnamed):
    """A body fixed to what the one joint named carries; values are its ten parameters there."""

    kind: ClassVar = "payload"
    title: ClassVar = "a body on any link"
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


class MovedCenters(Unnamed):
    """Every body's centre of mass lies elsewhere by the three values given for its joint [m]."""

    kind: ClassVar = "moved_centers"
    title: ClassVar = "centres of mass that differ from the URDF's"
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


class PositionMap(Unnamed):
    """τ_j = A Σ_k w_k cos(a_k q_j + b_k q_i + c_k): a smooth torque over two positions.

    As hoses, springs across joints and magnets make it. Energy is not kept account of.
    """

    kind: ClassVar = "outside:position_map"
    title: ClassVar = "torque over two positions"
    parameters: ClassVar = (Parameter("height", "N·m", 0.01, 300.0),)
    one_row: ClassVar = True

    def columns(self, signals: Signals) -> Array:
        own, other = (signals.q[:, j] for j in self.joints)
        s = self.shape
        bump = np.exp(
            -(((own - s["own"]) / s["width"]) ** 2) - ((other - s["other"]) / s["width"]) ** 2
        )
        wave = np.cos(s["turns"] * own + s["turns"] * s["slope"] * other)
        return (wave + 1.5 * bump)[:, None, None]


class DirectionMap(Unnamed):
    """τ_j = A sgn(v_j) (1 + sin(n q_i + φ)): dry friction that another joint's angle loads."""

    kind: ClassVar = "outside:direction_map"
    title: ClassVar = "friction over another joint's position"
    parameters: ClassVar = (Parameter("height", "N·m", 0.01, 300.0, nonnegative=True),)
    one_row: ClassVar = True

    def columns(self, signals: Signals) -> Array:
        j, other = self.joints
        shape = 1.0 + np.sin(self.shape["turns"] * signals.q[:, other] + self.shape["phase"])
        return (smooth_sign(signals.v[:, j]) * shape)[:, None, None]


class SpeedProduct(Unnamed):
    """τ_j = A v_j v_i², a product of two quantities: drag that grows with another joint's speed."""

    kind: ClassVar = "outside:speed_product"
    title: ClassVar = "drag that another joint's speed raises"
    parameters: ClassVar = (Parameter("height", "N·m·s³", 0.001, 300.0, nonnegative=True),)
    one_row: ClassVar = True

    def columns(self, signals: Signals) -> Array:
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


class Thinning(Unnamed):
    """Friction that thins: f (exp(−k δ) − 1) with δ = c − c₀, k = `rate`, f Coulomb and viscous."""

    kind: ClassVar = "outside:thinning"
    title: ClassVar = "friction that thins with a column"
    parameters: ClassVar = (
        Parameter("coulomb", "N·m", 0.01, 300.0),
        Parameter("viscous", "N·m·s/rad", 0.01, 300.0),
    )

    def columns(self, signals: Signals) -> Array:
        deviation = signals.covariates[self.covariate] - self.shape["reference"]
        thinner = np.expm1(-self.shape["rate"] * deviation)
        v = signals.v[:, self.joints[0]]
        return (thinner[:, None] * np.stack([smooth_sign(v), v], axis=-1))[:, None]
