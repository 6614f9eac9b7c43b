"""`excite robots`: what example-robot-data offers, or the joints and links of one robot."""

import typer

from excite_cli.cli import options
from excite_cli.cli.completion import complete_robot
from excite_cli.cli.console import Terminal
from excite_cli.cli.next_step import next_step


@options.with_messages
def robots(
    terminal: Terminal,
    robot: str | None = typer.Argument(
        None,
        help="A name of the list, or a URDF file, to see its joints.",
        autocompletion=complete_robot,
    ),
) -> None:
    """List the available robots, or the joints of one with their limits.

    The robots are those of the package example-robot-data. In a config, prefix a
    listed name, as in `robot: {urdf: example-robot-data:ur10}`; a URDF of yours is given by its
    path.

    Examples:
      excite robots
      excite robots ur10
      excite robots ur10 --json
    """
    from excite_cli.api.proposing import describe_robot, list_robots, robot_answer

    following = next_step("write a config for one", "init", "--robot", robot or "NAME")
    terminal.show(
        list_robots() if robot is None else robot_answer(describe_robot(robot)), following
    )
