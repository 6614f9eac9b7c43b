"""What the torque of an effect is a function of, and drawn over."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from excite_cli.effects.signals import Signals
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
