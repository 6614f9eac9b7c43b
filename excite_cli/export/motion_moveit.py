"""JSON of moveit_msgs/msg/RobotTrajectory: the joints' trajectory, and none of floating joints."""

import json
from pathlib import Path

from excite_cli.export.motion_exporter import MotionExporter, joint_trajectory
from excite_cli.measurement.timed_motion import TimedMotion


class MoveitExporter(MotionExporter):
    """`.json`, as MoveIt's Python and web tools exchange plans."""

    name, suffix = "moveit", ".json"
    whole_nanoseconds = True

    def _write(self, path: Path, motion: TimedMotion) -> None:
        joints = joint_trajectory(motion)
        others = {"header": joints["header"], "joint_names": [], "points": []}
        tree = {"joint_trajectory": joints, "multi_dof_joint_trajectory": others}
        text = json.dumps(tree, ensure_ascii=False, allow_nan=False)
        path.write_text(text + "\n", encoding="utf-8")
