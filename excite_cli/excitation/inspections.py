"""What was seen of several motions, and how it was looked at."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from excite_cli.excitation.inspection import Inspection, Look
from excite_cli.excitation.motion import Doubt
from excite_cli.shown.record import Shown

# Stored samples may differ from the motion by rounding only.
_SAME = 1e-6


@dataclass(frozen=True)
class Difference:
    """By how much samples that a file holds differ from its coefficients, and when [s].

    `share`: of the largest value.
    """

    share: float = 0.0
    time: float = 0.0

    @property
    def broken(self) -> bool:
        """Whether it is more than rounding: someone changed one of them."""
        return self.share > _SAME


@dataclass(frozen=True, repr=False, eq=False)
class Inspections(Shown, Mapping[str, Inspection]):
    """Inspections by the motion's name.

    `differences`: of the samples of motions from a result file. `doubts`: why motions of a result
    do not count as proved, whatever the result says of them. `slow`: the share of the limits of
    speed and acceleration that the motions were slowed to, if they were.
    """

    motions: dict[str, Inspection]
    look: Look
    differences: dict[str, Difference] = field(default_factory=dict)
    slow: float | None = None
    doubts: dict[str, Doubt] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Inspection:
        return self.motions[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.motions)

    def __len__(self) -> int:
        return len(self.motions)

    def difference(self, name: str) -> Difference:
        """That of one motion; none where no samples are known."""
        return self.differences.get(name, Difference())

    def doubt(self, name: str) -> Doubt:
        """That of one motion; none where it is not of a result."""
        return self.doubts.get(name, Doubt.NONE)

    def violations_of(self, name: str) -> int:
        """Those of one motion, samples that differ included."""
        return self.motions[name].violations + self.difference(name).broken

    @property
    def violations(self) -> int:
        """Those of all motions."""
        return sum(map(self.violations_of, self.motions))
