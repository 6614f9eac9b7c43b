"""`excite init`: a config that works, for a robot of which only the URDF is known."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from excite_cli.cli import options
from excite_cli.cli.console import Terminal


def init(
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot",
            help="A robot of example-robot-data (see `excite robots`), or robot_descriptions:NAME.",
        ),
    ] = None,
    urdf: Annotated[
        Path | None, typer.Option("--urdf", help="A file: URDF, xacro, MJCF or SDF.")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Config to write. Default: <robot>.yaml here."),
    ] = None,
    joints: Annotated[
        str | None,
        typer.Option("--joints", metavar="A,B,…", help="Joints to move. Default: chosen."),
    ] = None,
    base: Annotated[
        str, typer.Option("--base", help="fixed (on a stand too), or floating.")
    ] = "fixed",
    package_dirs: Annotated[
        list[Path] | None,
        typer.Option(
            "--package-dirs",
            metavar="FOLDER",
            help="Folder with packages or meshes (may be repeated).",
        ),
    ] = None,
    xacro_args: Annotated[
        list[str] | None,
        typer.Option(
            "--xacro-arg", metavar="NAME=VALUE", help="Argument of a xacro (may be repeated)."
        ),
    ] = None,
    srdf: Annotated[
        Path | None,
        typer.Option(
            "--srdf",
            help="SRDF: named postures, disabled collision pairs. Default: beside the URDF.",
        ),
    ] = None,
    allow_found: Annotated[
        bool,
        typer.Option(
            "--allow-found",
            help="Read packages and meshes found outside the robot's folder, without asking.",
        ),
    ] = False,
    floor: Annotated[
        str | None,
        typer.Option(
            "--floor",
            metavar="HEIGHT|none",
            help="Height of the floor in the world [m]; none: the robot hangs. Default, for a "
            "fixed base: the lowest point of what does not move.",
        ),
    ] = None,
    boxes: Annotated[
        list[str] | None,
        typer.Option(
            "--box",
            metavar="NAME=LENGTHS@CENTRE",
            help="A table, a cabinet [m] (may be repeated): table=1.2,0.8,0.7@0.9,0,0.35.",
        ),
    ] = None,
    walls: Annotated[
        list[str] | None,
        typer.Option(
            "--wall",
            metavar="NAME=POINT:NORMAL",
            help="A wall, its normal towards the robot (may be repeated): back=-0.5,0,0:1,0,0.",
        ),
    ] = None,
    keep_out: Annotated[
        list[str] | None,
        typer.Option(
            "--keep-out",
            metavar="JOINT=FROM,TO",
            help="Positions of a joint to stay out of [rad or m] (may be repeated).",
        ),
    ] = None,
    overrides: options.Set = None,
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
    no_progress: options.NoProgress = False,
) -> None:
    """Write a config that works for a robot, with comments that say what was chosen and why.

    Joints to move are chosen (no fingers, no wheels), with sensible limits where the URDF has none,
    a posture clear of limits and self-collision, and a pace that suits the slowest joint. Without
    --robot or --urdf, it asks at the terminal. A robot that stands is kept above a floor under what
    does not move; --floor, --box, --wall and --keep-out say what else is there.

    A robot's files read their own folder (or ROS package) and those of --package-dirs. Files
    that they need from elsewhere are searched for, and read after confirmation (or with
    --allow-found); the config lists their folders under robot.package_dirs.

    Example:  excite init --robot ur10

    Example:  excite init --urdf arm.urdf.xacro --xacro-arg gripper=none

    Example:  excite init --robot ur10 --set sequence.motions=5

    Example:  excite init --robot ur10 --floor -0.8 --box table=1.2,0.8,0.7@0.9,0,-0.45
    """
    from excite_cli.api.proposing import EXAMPLE_PREFIX, is_named, limbs_of, save_proposal
    from excite_cli.api.working import single_threaded
    from excite_cli.cli.init_questions import Answers, ask, may_read
    from excite_cli.errors import ConfigError

    terminal = Terminal(as_json, quiet, verbose, not no_progress)
    if robot is not None and urdf is not None:
        raise ConfigError("--robot and --urdf both name a robot: give one of them.")
    interactive = sys.stdin.isatty() and sys.stderr.isatty() and not (as_json or quiet)
    allow = may_read(allow_found, interactive)
    arguments = _pairs(xacro_args or ())
    chosen = tuple(filter(None, (name.strip() for name in (joints or "").split(","))))
    if robot is not None:
        answers = Answers(robot if is_named(robot) else f"{EXAMPLE_PREFIX}{robot}", output, chosen)
    elif urdf is not None:
        answers = Answers(str(urdf), output, chosen)
    elif interactive:
        own = package_dirs or ()
        answers = ask(output, chosen, lambda each: limbs_of(each, own, arguments, allow))
    else:
        raise ConfigError(
            "init needs a robot: --robot NAME (`excite robots` lists them) or --urdf FILE. At "
            "a terminal it asks."
        )
    with single_threaded():
        answer = save_proposal(
            answers.robot,
            answers.output,
            joints=answers.joints,
            base=base,
            package_dirs=package_dirs or (),
            xacro_args=arguments,
            srdf=srdf,
            overrides=overrides or (),
            floor=floor,
            boxes=boxes or (),
            walls=walls or (),
            keep_out=keep_out or (),
            allow=allow,
            overwrite=overwrite,
            tell=terminal.tell,
        )
    terminal.show(answer)


def _pairs(words: Sequence[str]) -> dict[str, str]:
    """`NAME=VALUE` (or ROS's `NAME:=VALUE`) by name."""
    from excite_cli.errors import ConfigError

    found = {}
    for word in words:
        name, equal, value = word.partition("=")
        if not equal or not name.rstrip(":"):
            raise ConfigError(f"--xacro-arg {word}: give NAME=VALUE, as --xacro-arg gripper=none.")
        found[name.rstrip(":")] = value
    return found
