"""The robots at hand, and the joints of one: `excite robots`."""

from pathlib import Path

from excite_cli.api.arguments import checked
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.errors import RobotError, nearest
from excite_cli.robot.description import EXAMPLE_PREFIX, example_robots, is_named
from excite_cli.robot.model import build_robot
from excite_cli.robot.overview import DescribedRobot, describe, known_robots
from excite_cli.shown.answer import Answer
from excite_cli.summary.robots import robot_answer as robot_answer
from excite_cli.summary.robots import robots_answer


def list_robots() -> Answer:
    """The robots of example-robot-data, each with what its URDF lacks.

    Raises
    ------
    RobotError
        The package is not installed.
    """
    return robots_answer(known_robots(), list(example_robots()))


@checked()
def describe_robot(robot: str | Path) -> DescribedRobot:
    """Joints of a robot with their limits and links; `robot` is a name of the list, or a URDF file.

    Raises
    ------
    RobotError
        It is neither, or the URDF is wrong.
    """
    return describe(build_robot(RobotSpec(urdf=_urdf(str(robot))), Path.cwd()))


def _urdf(robot: str) -> str:
    """What robot.urdf would be: a file's path, or the prefix and a name."""
    if is_named(robot) or Path(robot).is_file():
        return robot
    if Path(robot).is_dir():
        raise RobotError(f"{robot} is a folder. Give a URDF file, or a name: `excite robots`.")
    known = example_robots()
    if robot not in known:
        raise RobotError(
            f"there is neither a robot nor a file '{robot}'.{nearest(robot, known)} `excite "
            f"robots` lists all names."
        )
    return f"{EXAMPLE_PREFIX}{robot}"
