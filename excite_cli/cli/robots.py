"""`excite robots`: what example-robot-data offers, or the joints and links of one robot."""

from pathlib import Path
from typing import Annotated

import typer

from excite_cli.cli import options
from excite_cli.cli.completion import complete_robot
from excite_cli.cli.console import Terminal
from excite_cli.errors import RobotError, nearest


def robots(
    robot: Annotated[
        str | None,
        typer.Argument(
            help="A name of the list, or a URDF file, to see its joints.",
            autocompletion=complete_robot,
        ),
    ] = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
    no_progress: options.NoProgress = False,
) -> None:
    """List the robots at hand, or the joints of one with their limits.

    The robots are those of the package example-robot-data. In a config, a name of the list stands
    after a prefix, as in `robot: {urdf: example-robot-data:ur10}`; a URDF of yours is given by its
    path.

    Examples:
      excite robots
      excite robots ur10
      excite robots ur10 --json
    """
    terminal = Terminal(as_json, quiet, verbose, not no_progress)
    if robot is None:
        _list(terminal)
    else:
        _describe(terminal, robot)


def _list(terminal: Terminal) -> None:
    from excite_cli.cli.layout import table as new_table
    from excite_cli.robot.description import EXAMPLE_PREFIX, example_robots
    from excite_cli.robot.glance import known_robots

    found = known_robots()
    names = ("name", "kind", "joints", "lacks", "also called")
    table = new_table(
        "Robots of example-robot-data", names, ("name", "kind"), words=("lacks", "also called")
    )
    for each in found:
        there = {"inertias": each.inertias, "visuals": each.visual, "collisions": each.collision}
        lacks = ", ".join(word for word, is_there in there.items() if not is_there)
        table.add_row(each.name, each.kind, str(each.joints), lacks, ", ".join(each.others))
    terminal.answer(
        [table, f"In a config: robot: {{urdf: {EXAMPLE_PREFIX}NAME}}. Joints: excite robots NAME"],
        {
            "robots": [f"{EXAMPLE_PREFIX}{name}" for name in example_robots()],
            "details": {
                each.name: {
                    "kind": each.kind,
                    "joints": each.joints,
                    "inertias": each.inertias,
                    "visual": each.visual,
                    "collision": each.collision,
                    "also_called": list(each.others),
                    "file": str(each.path),
                }
                for each in found
            },
        },
    )


def _describe(terminal: Terminal, robot: str) -> None:
    from excite_cli.cli.layout import table as new_table
    from excite_cli.config.robot_spec import RobotSpec
    from excite_cli.robot.model import build_robot, links_by_joint

    built = build_robot(RobotSpec(urdf=_urdf(robot)), Path.cwd())
    limits, links = built.limits, links_by_joint(built)
    sliding = any(built.sliding)
    names = ("joint", *(("kind",) * sliding), "lower", "upper", "speed", "effort", "links")
    unit = "rad, rad/s, N·m; prismatic: m, m/s, N" if sliding else "rad, rad/s, N·m"
    table = new_table(
        f"{built.name}: {built.n} joints ({unit})", names, ("joint", "kind"), words=("links",)
    )
    data = {}
    for index, joint in enumerate(built.joint_names):
        row = [limits.lower, limits.upper, limits.velocity, limits.effort]
        values = [float(column[index]) for column in row]
        kind = "prismatic" if built.sliding[index] else "revolute"
        carried = links.get(joint, [])
        shown = [f"{value:.4g}" if abs(value) < float("inf") else "-" for value in values]
        table.add_row(joint, *((kind,) * sliding), *shown, ", ".join(carried))
        numbers = dict(zip(("lower", "upper", "velocity", "effort"), values, strict=True))
        data[joint] = {"kind": kind, **numbers, "links": carried}
    base = links.get("", [])
    terminal.answer(
        [table, f"fixed to the base: {', '.join(base)}"], {"joints": data, "base_links": base}
    )


def _urdf(robot: str) -> str:
    """What robot.urdf would be: a file's path, or the prefix and a name.

    Raises
    ------
    RobotError
        It is neither.
    """
    from excite_cli.robot.description import EXAMPLE_PREFIX, example_robots

    if robot.startswith(EXAMPLE_PREFIX) or Path(robot).is_file():
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
