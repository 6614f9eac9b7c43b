"""Joint states at many instants, with the kinematics that several constraints share."""

from dataclasses import dataclass
from functools import cached_property

from excite_cli.dynamics.forward_kinematics import BatchKinematics
from excite_cli.robot.model import Array


@dataclass(frozen=True)
class States:
    """q, v, a (T, n) of the moved joints; placements and motion columns are computed once."""

    kinematics: BatchKinematics
    q: Array
    v: Array
    a: Array

    @cached_property
    def placements(self) -> tuple[Array, Array]:
        """Rotations (T, B, 3, 3) and translations (T, B, 3) of all bodies in the world."""
        return self.kinematics.placements(self.q)

    @cached_property
    def columns(self) -> Array:
        """World motion columns (T, nv, 6), [linear; angular] about the world origin."""
        return self.kinematics.axes(*self.placements)
