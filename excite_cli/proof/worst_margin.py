"""The record of the smallest margin of a constraint over a motion."""

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Worst:
    """The smallest margin of a constraint over a motion, with where and when it occurs.

    Smallest as a `share` of the scale of its column, so that joints of different size compare.
    """

    margin: float
    unit: str
    label: str
    time: float
    violations: int
    share: float = 0.0

    def with_later(self, later: "Worst") -> "Worst":
        """The worse of two, by the share of the scale, with the violations of both."""
        worse = later if later.share < self.share else self
        return replace(worse, violations=self.violations + later.violations)
