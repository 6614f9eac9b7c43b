"""`excite robots`: what example-robot-data offers, or the joints and links of one robot."""

from pathlib import Path
from typing import Annotated

import typer

from excite_cli.cli import options
from excite_cli.cli.console import Terminal


def robots(
    urdf: Annotated[
        str | None,
        typer.Argument(help="A URDF or example-robot-data:<name>, to list its joints."),
    ] = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """List the robots at hand, or the joints of one with their limits.

    Example:  excite robots example-robot-data:ur10
    """
    from rich.table import Table

    from excite_cli.config.spec import RobotSpec
    from excite_cli.robot.description import EXAMPLE_PREFIX, example_robots
    from excite_cli.robot.model import build_robot

    terminal = Terminal(as_json, quiet)
    if urdf is None:
        names = list(example_robots())
        table = Table(title="Robots of example-robot-data", title_justify="left")
        table.add_column("robot.urdf")
        for name in names:
            table.add_row(f"{EXAMPLE_PREFIX}{name}")
        terminal.answer(table, {"robots": [f"{EXAMPLE_PREFIX}{name}" for name in names]})
        return
    robot = build_robot(RobotSpec(urdf=urdf), Path.cwd())
    limits = robot.limits
    table = Table(title=robot.name, title_justify="left")
    for name in ("joint", "lower", "upper", "velocity", "effort"):
        table.add_column(name, justify="left" if name == "joint" else "right")
    data = []
    for index, joint in enumerate(robot.joint_names):
        row = [limits.lower, limits.upper, limits.velocity, limits.effort]
        values = [float(column[index]) for column in row]
        table.add_row(joint, *(f"{value:.4g}" for value in values))
        data.append(dict(zip(("lower", "upper", "velocity", "effort"), values, strict=True)))
    terminal.answer(table, {"joints": dict(zip(robot.joint_names, data, strict=True))})
