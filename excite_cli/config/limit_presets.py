"""Limits of robots as their makers publish them, by the name that `robot.limits_preset` gives.

Every number is from the source that stands beside it; what a source does not give is left to the
robot's file. Joints are known by how their names end, so that prefixes do not matter.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import radians
from typing import Any

_ARM = tuple(rf"(?<!finger_)joint{k}" for k in range(1, 8))
_UR = tuple(
    f"{name}_joint"
    for name in ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
)
_LBR = tuple(rf"(?:joint_?a?|A){k}" for k in range(1, 8))


@dataclass(frozen=True)
class LimitPreset:
    """Limits of one robot; `joints`: patterns of how names end, in the order of the numbers.

    position: lower, upper [rad]; velocity [rad/s]; acceleration [rad/s²]; jerk [rad/s³]; effort
    [N·m]; empty where the source has none.
    """

    title: str
    source: str
    joints: tuple[str, ...]
    position: tuple[tuple[float, float], ...] = ()
    velocity: tuple[float, ...] = ()
    acceleration: tuple[float, ...] = ()
    jerk: tuple[float, ...] = ()
    effort: tuple[float, ...] = ()
    remark: str = field(default="")

    def of_joints(self, names: Sequence[str]) -> Iterator[tuple[str, Mapping[str, Any]]]:
        """Joints among `names` that the preset is about, each with its limits by their key."""
        keys = ("position", "velocity", "acceleration", "jerk", "effort")
        for k, ending in enumerate(self.joints):
            given = {key: values[k] for key in keys if (values := getattr(self, key))}
            for name in names:
                if re.search(f"{ending}$", name):
                    yield name, given

    def missing(self, names: Sequence[str]) -> list[str]:
        """Numbers from 1 on of those of its joints that none of `names` is."""
        return [
            str(k)
            for k, ending in enumerate(self.joints, start=1)
            if not any(re.search(f"{ending}$", name) for name in names)
        ]


def _ur(title: str, folder: str, speeds: Sequence[float], effort: Sequence[float]) -> LimitPreset:
    """Speeds in °/s; the file names the user manual and the maker's article on joint torques."""
    source = (
        "https://github.com/UniversalRobots/Universal_Robots_ROS2_Description/blob/rolling/"
        f"config/{folder}/joint_limits.yaml"
    )
    velocity = tuple(radians(speed) for speed in speeds)
    return LimitPreset(title, source, _UR, velocity=velocity, effort=tuple(effort))


_FRANKA = "https://frankarobotics.github.io/docs/robot_specifications.html"

LIMIT_PRESETS: Mapping[str, LimitPreset] = {
    "franka_emika_panda": LimitPreset(
        "Franka Emika Panda (FER)",
        _FRANKA,
        _ARM,
        position=((-2.8973, 2.8973), (-1.7628, 1.7628), (-2.8973, 2.8973), (-3.0718, -0.0698),
                  (-2.8973, 2.8973), (-0.0175, 3.7525), (-2.8973, 2.8973)),
        velocity=(2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61),
        acceleration=(15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0),
        jerk=(7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10000.0, 10000.0),
        effort=(87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0),
    ),
    "franka_research_3": LimitPreset(
        "Franka Research 3",
        _FRANKA,
        _ARM,
        position=((-2.3093, 2.3093), (-1.5133, 1.5133), (-2.4937, 2.4937), (-2.7478, -0.4461),
                  (-2.48, 2.48), (0.8521, 4.2094), (-2.6895, 2.6895)),
        velocity=(2.0, 1.0, 1.5, 1.25, 3.0, 1.5, 3.0),
        acceleration=(10.0,) * 7,
        jerk=(5000.0,) * 7,
        effort=(87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0),
        remark="its speed limits depend on position; these are the position and speed limits that "
        "the manual suggests for planners of fixed limits",
    ),
    "kuka_lbr_iiwa_14": LimitPreset(
        "KUKA LBR iiwa 14 R820",
        "https://github.com/RobotLocomotion/drake/blob/master/manipulation/models/"
        "iiwa_description/README.md, which quotes page 30 of the maker's brochure",
        _LBR,
        velocity=tuple(radians(speed) for speed in (85, 85, 100, 75, 130, 135, 135)),
        effort=(320.0, 320.0, 176.0, 176.0, 110.0, 40.0, 40.0),
    ),
    "ur3e": _ur("Universal Robots UR3e", "ur3e", (180, 180, 180, 360, 360, 360),
                (56.0, 56.0, 28.0, 12.0, 12.0, 12.0)),
    "ur5e": _ur("Universal Robots UR5e", "ur5e", (180,) * 6, (150.0,) * 3 + (28.0,) * 3),
    "ur10e": _ur("Universal Robots UR10e", "ur10e", (120, 120, 180, 180, 180, 180),
                 (330.0, 330.0, 150.0, 56.0, 56.0, 56.0)),
}  # fmt: skip
