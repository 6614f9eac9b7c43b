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

    from excite_cli.config.robot_spec import RobotSpec
    from excite_cli.robot.description import EXAMPLE_PREFIX, example_robots
    from excite_cli.robot.model import build_robot, links_by_joint

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
    for name in ("joint", "kind", "lower", "upper", "velocity", "effort", "links"):
        left = name in ("joint", "kind", "links")
        table.add_column(name, justify="left" if left else "right")
    links = links_by_joint(robot)
    data = {}
    for index, joint in enumerate(robot.joint_names):
        row = [limits.lower, limits.upper, limits.velocity, limits.effort]
        values = [float(column[index]) for column in row]
        kind = "prismatic, m" if robot.sliding[index] else "revolute, rad"
        carried = links.get(joint, [])
        table.add_row(joint, kind, *(f"{value:.4g}" for value in values), ", ".join(carried))
        numbers = dict(zip(("lower", "upper", "velocity", "effort"), values, strict=True))
        data[joint] = {"kind": kind.split(",")[0], **numbers, "links": carried}
    base = links.get("", [])
    terminal.answer(
        [table, f"fixed to the base: {', '.join(base)}"], {"joints": data, "base_links": base}
    )
