"""JSON of moveit_msgs/msg/RobotTrajectory, or of a JointTrajectory alone."""

import json
from pathlib import Path

from excite_cli.errors import FileError
from excite_cli.motion_formats.base import MotionFormat
from excite_cli.motion_formats.joint_trajectory import joint_trajectory, motion_of, text_of
from excite_cli.motion_formats.timed_motion import TimedMotion


class MoveitJson(MotionFormat):
    """`.json`, as MoveIt's Python and web tools exchange plans."""

    name, title = "moveit", "MoveIt JSON"
    suffixes = (".json",)
    whole_nanoseconds = True

    def read(self, path: Path) -> TimedMotion:
        """The field `joint_trajectory`, if there is one, else the whole."""
        try:
            tree = json.loads(text_of(path))
        except (ValueError, RecursionError) as error:
            raise FileError(f"{path} is not valid JSON: {error}.") from error
        if isinstance(tree, dict) and "joint_trajectory" in tree:
            tree = tree["joint_trajectory"]
        return motion_of(path, tree)

    def fill(self, path: Path, motion: TimedMotion) -> None:
        """The joints' trajectory, and an empty one of floating joints."""
        joints = joint_trajectory(motion)
        others = {"header": joints["header"], "joint_names": [], "points": []}
        tree = {"joint_trajectory": joints, "multi_dof_joint_trajectory": others}
        text = json.dumps(tree, ensure_ascii=False, allow_nan=False)
        path.write_text(text + "\n", encoding="utf-8")
