"""A timed motion as the fields of trajectory_msgs/msg/JointTrajectory."""

from typing import Any

import numpy as np

from excite_cli.export.motion_exporter import states_of
from excite_cli.measurement.timed_motion import TimedMotion

_NANO = 10**9


def joint_trajectory(motion: TimedMotion) -> dict[str, Any]:
    """The message as dictionaries and lists, every field of its definition in order."""
    stamps = np.rint(motion.t * _NANO).astype(np.int64).tolist()
    rows = zip(stamps, *(x.tolist() for x in states_of(motion)), strict=True)
    return {
        "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""},
        "joint_names": list(motion.joint_names),
        "points": [
            {
                "positions": q,
                "velocities": v,
                "accelerations": a,
                "effort": [],
                "time_from_start": {"sec": stamp // _NANO, "nanosec": stamp % _NANO},
            }
            for stamp, q, v, a in rows
        ],
    }
