"""Joints that move, with a speed or an effort of 0 as their limit.

Programs that export descriptions write 0 where nobody gave a figure. It is taken as no limit:
plans are then bounded by nothing that the robot can do. Positions of 0 to 0 are refused where a
joint is to move (`robot/limits.py`).
"""

import xml.etree.ElementTree as ElementTree

import numpy as np

from excite_cli.checks.base import DescriptionCheck, Log
from excite_cli.checks.check_result import CheckResult, few

NAME = "limits of the description"
_WRITTEN = (".urdf", ".xacro")  # MJCF has no limits of speed, SDF may leave them out


class ZeroLimits(DescriptionCheck):
    """Limits of 0 of joints that move."""

    name = NAME

    def look(self, log: Log) -> list[CheckResult]:
        """A doubt for speeds, and one for efforts, that the config does not give in their place."""
        robot = log.robot
        if robot.description.path.suffix not in _WRITTEN:
            return []
        root = ElementTree.fromstring(robot.description.urdf)
        limits = {joint.get("name", ""): joint.find("limit") for joint in root.iter("joint")}
        found = []
        for key, values in (("velocity", robot.limits.velocity), ("effort", robot.limits.effort)):
            zero = []
            for name, value in zip(robot.joint_names, values, strict=True):
                limit = limits.get(name)
                written = None if limit is None else limit.get(key)
                if not np.isfinite(value) and written is not None and float(written) == 0.0:
                    zero.append(name)
            if zero:
                text = (
                    f"the description limits the {key} of {few(zero)} to 0, which is taken as no "
                    f"limit. Give what the data sheet says: robot.limits.{zero[0]}.{key}"
                )
                found.append(CheckResult(NAME, f"zero_{key}", "doubt", text, tuple(zero)))
        return found
