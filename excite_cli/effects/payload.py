"""A body on the flange that the model does not have: the last body's ten columns of Y.

The last body is that of the last moved joint. In runs that all carry it, it is absorbed by the last
body's own parameters; it shows where some runs carry it and others do not.
"""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

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
from excite_cli.effects.simulated_robot import SimulatedRobot
from excite_cli.robot.model import Array

_RADIUS = 0.05  # m, of the sphere that is planted


class Payload(Effect):
    """Mass, first moments and inertia of an added body, about the last joint's frame."""

    kind: ClassVar = "payload"
    title: ClassVar = "payload that the model does not have"
    signature: ClassVar = "residuals of gravity and inertia on many joints, in some runs only"
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

    def build_into(
        self, robot: SimulatedRobot, values: Array, numbers: Mapping[str, float]
    ) -> None:
        """The body that the last joint carries has more inertia."""
        robot.phi[-PARAMETERS_PER_BODY:] += values

    def rows(self, n: int) -> tuple[int, ...]:
        """All joints."""
        return tuple(range(n))

    def columns(self, signals: Signals) -> Array:
        """The last ten columns of Y, (T, n, 10)."""
        return signals.body.regressor[:, :, -PARAMETERS_PER_BODY:]

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """The weights, in the last ten columns of Y."""
        back = np.zeros_like(signals.body.regressor)
        back[:, :, -PARAMETERS_PER_BODY:] = weights
        return Cotangents(regressor=back)

    def report(self, values: Array, covariance: Array) -> dict[str, Value]:
        """Also the centre of mass `cx, cy, cz` in the last joint's frame."""
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
