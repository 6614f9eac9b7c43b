"""A body that the model does not have, on a hand: ten columns of Y, those of the carrying body.

It is looked for on every leaf of the tree of moved joints. In runs that all carry it, it is
absorbed by that body's own parameters; it shows where some runs carry it and others do not.

Ten fitted numbers are those of no body as soon as an inertia is known worse than it is large. So
they are judged by their χ² distance to the numbers that bodies have (`nearest_inertias`), and what
is told are the nearest of these.
"""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from excite_cli.dynamics.pseudo_inertia import moved, nearest_inertias, smallest_eigenvalues
from excite_cli.dynamics.regressor import PARAMETERS_PER_BODY
from excite_cli.effects.base import (
    Cotangents,
    Effect,
    Parameter,
    Scope,
    Signals,
    Value,
    deviation,
)
from excite_cli.effects.judgement import Seen, half_of
from excite_cli.effects.simulated_robot import SimulatedRobot
from excite_cli.robot.link_frame import LinkFrame, leaves
from excite_cli.robot.model import Array, Robot

_RADIUS = 0.05  # m, of the sphere that is planted
_LENGTH = np.array([0.1])  # m, in which eigenvalues of inertias are told in kg
_NOTHING = 2e-3  # of the robot's mass: its own screws are more
_ROUNDING, _LIGHTEST = 1e-6, 1e-3  # of the mass; kg


class Payload(Effect):
    """Mass, first moments and inertia of an added body, about the frame of the joint it hangs on.

    Files of earlier versions name all joints, and mean the last one.
    """

    kind: ClassVar = "payload"
    title: ClassVar = "unmodelled payload"
    signature: ClassVar = "residuals of gravity and inertia on many joints, in some runs only"
    in_all_rows: ClassVar = True
    scope: ClassVar[Scope] = "robot"
    parameters: ClassVar = (
        Parameter("mass", "kg", 0.05, 50.0, nonnegative=True),
        *(Parameter(name, "kg·m", 0.001, 20.0) for name in ("mx", "my", "mz")),
        *(
            Parameter(name, "kg·m²", 1e-4, 10.0, nonnegative=name in ("Ixx", "Iyy", "Izz"))
            for name in ("Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
        ),
    )
    defaults: ClassVar[Mapping[str, float]] = {"cx": 0.0, "cy": 0.0, "cz": 0.05, "radius": _RADIUS}
    per_run: ClassVar = True
    carried: ClassVar = True
    usual: ClassVar = True
    size: ClassVar = ("mass",)
    projection_tolerance: ClassVar = (
        0.05  # it is seen by its weight; of its inertia, models know little
    )

    @classmethod
    def places(cls, robot: Robot) -> list[tuple[int, ...]]:
        """Every leaf."""
        return [(j,) for j in leaves(robot)]

    def build_into(
        self, robot: SimulatedRobot, values: Array, numbers: Mapping[str, float]
    ) -> None:
        """The body that carries it has more inertia."""
        robot.phi[self.ten(robot.robot)] += values

    def columns(self, signals: Signals) -> Array:
        """Ten columns of Y, (T, n, 10)."""
        return signals.body.regressor[:, :, self.ten(signals.body.robot)]

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """The weights, in the ten columns of Y."""
        back = np.zeros_like(signals.body.regressor)
        back[:, :, self.ten(signals.body.robot)] = weights
        return Cotangents(regressor=back)

    def ten(self, robot: Robot) -> slice:
        """Where φ has the body that carries it."""
        first = PARAMETERS_PER_BODY * (robot.model_joints[self.joints[-1]] - 1)
        return slice(first, first + PARAMETERS_PER_BODY)

    def seen_from(self, link: LinkFrame) -> Array:
        """Mass, first moments and inertia about the link's frame."""
        return moved(link.rotation, link.translation)

    def possible(self, values: Array) -> bool:
        """Whether some body has these numbers."""
        least = smallest_eigenvalues(values, _LENGTH)[0]
        return bool(values[0] >= 0.0 and least >= -_ROUNDING * max(abs(values[0]), _LIGHTEST))

    def why_not(self, values: Array) -> str:
        """No body is so, and none near it."""
        return f"no body has this mass ({values[0]:.3g} kg), centre and inertia, or nearly so"

    def absurd(self, values: Array, seen: Seen) -> str:
        """Nobody lets a robot carry more than it weighs, or notices what weighs next to nothing.

        Nor does it carry anything whose centre is farther off than `seen.reach`.
        """
        mass = float(values[0])
        if mass > seen.mass:
            return f"mass of {mass:.3g} kg is more than the robot's own {seen.mass:.3g} kg"
        if mass < _NOTHING * seen.mass:
            return f"mass of {mass:.2g} kg is next to nothing beside {seen.mass:.3g} kg of robot"
        far = float(np.linalg.norm(values[1:4])) / mass
        if far > seen.reach:
            return f"its centre is {far:.2g} m off its link, more than {seen.reach:.2g} m"
        return ""

    def nearest(self, values: Array, covariance: Array) -> Array:
        """Those of the body nearest to `values`."""
        margin = _ROUNDING * max(abs(float(values[0])), _LIGHTEST)
        back, no_signs = half_of(covariance), np.zeros(0, dtype=np.intp)
        found = nearest_inertias(back, values, _LENGTH, no_signs, margin)
        return found.x if found.solved else values

    def report(self, values: Array, covariance: Array) -> dict[str, Value]:
        """Also the centre of mass `cx, cy, cz` in the joint's frame."""
        found = super().report(values, covariance)
        mass = float(values[0])
        if mass != 0.0:
            for axis, name in enumerate(("cx", "cy", "cz"), start=1):
                slope = np.zeros(len(values))
                slope[0], slope[axis] = -values[axis] / mass**2, 1.0 / mass
                centre = float(values[axis]) / mass
                found[name] = Value(centre, deviation(slope, covariance), "m")
        return found

    @classmethod
    def planted(cls, value: float, others: Mapping[str, float]) -> tuple[dict[str, float], Array]:
        """A solid sphere of `value` kg; others: centre `cx, cy, cz` (0, 0, 0.05) and `radius` [m].

        Any of the ten parameters may be given instead.
        """
        given = {**cls.defaults, **others}
        c = np.array([given["cx"], given["cy"], given["cz"]])
        inertia = value * (0.4 * given["radius"] ** 2 + c @ c) * np.eye(3) - value * np.outer(c, c)
        six = (inertia[0, 0], inertia[0, 1], inertia[1, 1], *inertia[2])
        values = np.array([value, *(value * c), *six])
        for i, parameter in enumerate(cls.parameters[1:], start=1):
            values[i] = others.get(parameter.name, values[i])
        return {}, values
