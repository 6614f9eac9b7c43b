"""How large the robot and its torques are, as the data show: what sizes of effects are held to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from excite_cli.robot.model import Array


@dataclass(frozen=True)
class Seen:
    """Of each moved joint (n,) [N·m]: the largest measured `torque`, and RMS of the rigid `load`.

    `mass` of the robot [kg].
    """

    torque: Array
    load: Array
    mass: float
