"""A parameter of an effect, and a value of it."""

from dataclasses import dataclass

import numpy as np

from excite_cli.arrays import Array

Range = tuple[float, float]


@dataclass(frozen=True)
class Parameter:
    """A parameter: name, unit, and the range of sizes that is usual for a robot arm.

    `believed`: outside of it no fit is believed, however good, for the reason `because`; for sizes
    that do not depend on how large the robot is. `part_of_torque`: more than the largest torque of
    its joint is absurd.
    """

    name: str
    unit: str
    low: float
    high: float
    nonnegative: bool = False
    believed: Range | None = None
    because: str = ""
    part_of_torque: bool = False

    def allows(self, value: float) -> bool:
        """Whether a fitted value can be so."""
        if self.nonnegative and value < 0:
            return False
        return self.believed is None or self.believed[0] <= value <= self.believed[1]

    def why_not(self, value: float) -> str:
        """Why no fit with this value is believed; empty if it may be."""
        if self.nonnegative and value < 0:
            return f"{self.name} of {value:.3g} cannot be negative"
        if not self.allows(value):
            return f"{self.name} of {value:.3g}: {self.because or 'out of range'}"
        return ""

    def absurd(self, value: float, torque: float) -> str:
        """Why it is too large for a joint with this largest torque [N·m; N]; empty if not."""
        if not self.part_of_torque or abs(value) <= torque:
            return ""
        return (
            f"{self.name} of {value:.3g} is more than the largest torque of its joint, {torque:.3g}"
        )


def whole_share(name: str) -> Parameter:
    """A share of something that is either taken away or not: one by nature."""
    return Parameter(
        name, "1", 0.3, 1.5, nonnegative=True, believed=(0.6, 1.5),
        because="it is lost wholly or not at all, so this is near 1",
    )  # fmt: skip


@dataclass(frozen=True)
class Value:
    """A parameter's value with its standard deviation and unit."""

    value: float
    std: float
    unit: str


_OF_SLIDERS = (("(N·m)", "N"), ("N·m", "N"), ("kg·m²", "kg"), ("rad", "m"))


def unit_of_slider(unit: str) -> str:
    """A unit of joints that turn, on one that slides: N·m·s/rad becomes N·s/m."""
    for turning, sliding in _OF_SLIDERS:
        unit = unit.replace(turning, sliding)
    return unit


def deviation(slope: Array, covariance: Array) -> float:
    """Standard deviation of a function of the parameters with this derivative, to first order."""
    return float(np.sqrt(max(float(slope @ covariance @ slope), 0.0)))
