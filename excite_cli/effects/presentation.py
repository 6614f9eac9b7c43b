"""How an effect is reported and drawn: its numbers as people know them, and over which axis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from excite_cli.effects.parameter import Parameter, Value, deviation, unit_of_slider

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from excite_cli.effects.signals import Signals
    from excite_cli.robot.link_frame import LinkFrame
    from excite_cli.robot.model import Array

Quantity = Literal["position", "speed", "acceleration", "load", "time", "covariate"]


@dataclass(frozen=True)
class Abscissa:
    """What the torque of an effect is drawn over: `values` (T,) in `unit`, and their name.

    Values that lie a `period` apart are the same place, if there is one.
    """

    name: str
    unit: str
    values: Array
    period: float | None = None


# Of one joint: name, unit, and where `Signals` has it.
_DRAWN_OVER: Mapping[Quantity, tuple[str, str, str]] = {
    "position": ("angle", "rad", "q"),
    "speed": ("speed", "rad/s", "v"),
    "acceleration": ("acceleration", "rad/s²", "a"),
    "load": ("rigid-body torque", "N·m", "load"),
}


def of_one_joint(quantity: Quantity, signals: Signals, joint: int) -> Abscissa | None:
    """A quantity of `joint`; None where it belongs to none."""
    if quantity not in _DRAWN_OVER:
        return None
    name, unit, series = _DRAWN_OVER[quantity]
    return Abscissa(name, unit, getattr(signals, series)[:, joint])


Scope = Literal["joint", "pair", "robot", "base"]
Picture = Literal["cloud", "window"]


class Presentation:
    """Numbers, units and axes for tables and figures."""

    parameters: ClassVar[tuple[Parameter, ...]]
    shapes: ClassVar[tuple[Parameter, ...]] = ()
    joints: tuple[int, ...]
    shape: Mapping[str, float]
    scope: ClassVar[Scope] = "joint"

    # What of its own joints the torque is a function of: with a free function of it beside, nothing
    # of the effect would be left.
    function_of: ClassVar[tuple[Quantity, ...]] = ()
    # A body that one joint carries: part of the load of joints, and named by its link if one likes.
    carried: ClassVar[bool] = False
    # Samples over `abscissa`, or the seconds in which it shows most.
    picture: ClassVar[Picture] = "cloud"

    def abscissa(self, signals: Signals) -> Abscissa | None:
        """The quantity over which a person sees the effect; None: the torque it predicts.

        By default the one quantity of its one joint that it is a `function_of`.
        """
        if len(self.joints) != 1 or len(self.function_of) != 1:
            return None
        return of_one_joint(self.function_of[0], signals, self.joints[0])

    def seen_from(self, link: LinkFrame) -> Array:
        """Linear parameters in the frame of `link`: that matrix (p, p) times `values`."""
        return np.eye(len(self.parameters))

    def report(self, values: Array, covariance: Array) -> dict[str, Value]:
        """Named parameters as people know them, with standard deviations."""
        found = {
            p.name: Value(float(values[i]), deviation(np.eye(len(values))[i], covariance), p.unit)
            for i, p in enumerate(self.parameters)
        }
        for shape in self.shapes:
            if shape.name in self.shape:
                found[shape.name] = Value(float(self.shape[shape.name]), float("nan"), shape.unit)
        return found

    def report_on(
        self, sliding: NDArray[np.bool_], values: Array, covariance: Array
    ) -> dict[str, Value]:
        """`report` with the units of a robot whose moved joints slide, or do not (n,)."""
        return {
            name: replace(value, unit=self.unit_on(value.unit, sliding))
            for name, value in self.report(values, covariance).items()
        }

    def unit_on(self, unit: str, sliding: NDArray[np.bool_]) -> str:
        """A unit of its parameters on a robot whose moved joints slide, or do not (n,)."""
        of_joint = self.scope == "joint" and not self.carried
        return unit_of_slider(unit) if of_joint and sliding[self.joints[0]] else unit
