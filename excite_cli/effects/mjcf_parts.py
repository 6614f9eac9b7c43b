"""Parts of a MuJoCo model that effects become: attributes of joints, tendons, gravity."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from excite_cli.robot.model import Array


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
