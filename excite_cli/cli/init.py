"""`excite init`: a config that works, for a robot of which only the URDF is known."""

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from excite_cli.api.showing import Command, as_word
from excite_cli.cli import options
from excite_cli.cli.console import Terminal, asking
from excite_cli.cli.next_step import next_step
from excite_cli.errors import ConfigError, RobotError, nearest

if TYPE_CHECKING:
    from excite_cli.api.proposing import Allow, FolderRequest


@options.command
def init(
    terminal: Terminal,
    robot: str | None = typer.Option(
        None,
        "--robot",
        help="A robot of example-robot-data (see `excite robots`), or robot_descriptions:NAME.",
    ),
    urdf: Path | None = typer.Option(None, "--urdf", help="A file: URDF, xacro, MJCF or SDF."),
    output: Path | None = typer.Option(
        None, "--output", "-o", help="Config to write. Default: <robot>.yaml here."
    ),
    joints: str | None = typer.Option(
        None, "--joints", metavar="A,B,…", help="Joints to move. Default: chosen."
    ),
    base: str = typer.Option("fixed", "--base", help="fixed (on a stand too), or floating."),
    package_dirs: list[Path] | None = typer.Option(
        None,
        "--package-dirs",
        metavar="FOLDER",
        help="Folder with packages or meshes (may be repeated).",
    ),
    xacro_args: list[str] | None = typer.Option(
        None, "--xacro-arg", metavar="NAME=VALUE", help="Argument of a xacro (may be repeated)."
    ),
    srdf: Path | None = typer.Option(
        None,
        "--srdf",
        help="SRDF: named postures, disabled collision pairs. Default: beside the URDF.",
    ),
    allow_found: bool = typer.Option(
        False,
        "--allow-found",
        help="Read packages and meshes found outside the robot's folder, without asking.",
    ),
    floor: str | None = typer.Option(
        None,
        "--floor",
        metavar="HEIGHT|none",
        help="Height of the floor in the world [m]; none: the robot hangs. Default, for a "
        "fixed base: the lowest point of what does not move.",
    ),
    boxes: list[str] | None = typer.Option(
        None,
        "--box",
        metavar="NAME=LENGTHS@CENTRE",
        help="A table, a cabinet [m] (may be repeated): table=1.2,0.8,0.7@0.9,0,0.35.",
    ),
    walls: list[str] | None = typer.Option(
        None,
        "--wall",
        metavar="NAME=POINT:NORMAL",
        help="A wall, its normal towards the robot (may be repeated): back=-0.5,0,0:1,0,0.",
    ),
    keep_out: list[str] | None = typer.Option(
        None,
        "--keep-out",
        metavar="JOINT=FROM,TO",
        help="Positions of a joint to stay out of [rad or m] (may be repeated).",
    ),
    overrides: options.Set = None,
    overwrite: options.Overwrite = False,
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

    if robot is not None and urdf is not None:
        raise ConfigError("--robot and --urdf both name a robot: give one of them.")
    interactive = (
        sys.stdin.isatty() and sys.stderr.isatty() and not (terminal.as_json or terminal.quiet)
    )
    allow = _may_read(allow_found, interactive)
    arguments = _pairs(xacro_args or ())
    chosen = tuple(filter(None, (name.strip() for name in (joints or "").split(","))))
    if robot is not None:
        answers = _Answers(robot if is_named(robot) else f"{EXAMPLE_PREFIX}{robot}", output, chosen)
    elif urdf is not None:
        answers = _Answers(str(urdf), output, chosen)
    elif interactive:
        own = package_dirs or ()
        with asking():
            answers = _ask(output, chosen, lambda each: limbs_of(each, own, arguments, allow))
    else:
        raise ConfigError(
            "init needs a robot: --robot NAME (`excite robots` lists them) or --urdf FILE. At "
            "a terminal it asks."
        )
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
    written = Path(answer.data["output"])
    following = next_step("plan motions, or check a recording that you have", "optimize", written)
    terminal.show(
        answer, (*following, Command(("excite", "inspect", as_word(written), "DATA.csv")))
    )


def _pairs(words: Sequence[str]) -> dict[str, str]:
    """`NAME=VALUE` (or ROS's `NAME:=VALUE`) by name."""
    found = {}
    for word in words:
        name, equal, value = word.partition("=")
        if not equal or not name.rstrip(":"):
            raise ConfigError(f"--xacro-arg {word}: give NAME=VALUE, as --xacro-arg gripper=none.")
        found[name.rstrip(":")] = value
    return found


@dataclass(frozen=True)
class _Answers:
    """The robot (a name with its prefix, or a URDF), where to write, the joints (none: ours)."""

    robot: str
    output: Path | None
    joints: tuple[str, ...]


def _may_read(allow_found: bool, at_terminal: bool) -> "Allow":
    """Whether a robot's files may read a folder outside their own: asked once for each.

    allow_found: yes to what was found by its package or beside the robot; at_terminal: a person is
    there to be asked.
    """
    answers: dict[str, bool] = {}

    def allow(needed: "FolderRequest") -> bool:
        if (allow_found and needed.near) or not at_terminal:
            return allow_found and needed.near
        if str(needed) not in answers:
            question = f"Read {needed.folder}? The robot asks for {needed}, outside its own folder."
            with asking():
                answers[str(needed)] = typer.confirm(question, default=False, err=True)
        return answers[str(needed)]

    return allow


def _ask(
    output: Path | None,
    joints: tuple[str, ...],
    limbs: Callable[[str], Mapping[str, Sequence[str]]],
) -> _Answers:
    """Ask for the robot, the limbs to move and the file, each with a default.

    limbs: the joints of a robot by the limb they belong to.
    """
    from excite_cli.api.proposing import EXAMPLE_PREFIX, example_robots

    known = example_robots()
    while True:
        word = str(_asked("Robot (a name of `excite robots`, or a URDF file)", "ur10")).strip()
        name = word.removeprefix(EXAMPLE_PREFIX)
        if name in known or Path(word).expanduser().is_file():
            break
        typer.echo(f"There is no robot and no file '{word}'.{nearest(name, known)}", err=True)
    is_file = name not in known
    robot = str(Path(word).expanduser()) if is_file else f"{EXAMPLE_PREFIX}{name}"
    if not joints:
        groups = limbs(str(Path(robot).resolve()) if is_file else robot)
        if len(groups) > 1:
            joints = _of_groups(groups, sum(map(len, groups.values())))
    default = output or Path(f"{Path(robot).stem if is_file else name}.yaml")
    return _Answers(robot, Path(str(_asked("Write to", str(default)))), joints)


def _of_groups(groups: Mapping[str, Sequence[str]], count: int) -> tuple[str, ...]:
    """Joints of the groups that are requested; none for all."""
    typer.echo("Joints to move:", err=True)
    typer.echo(f"  0  all {count}", err=True)
    names = list(groups)
    for number, name in enumerate(names, 1):
        typer.echo(f"  {number}  {name} ({len(groups[name])})", err=True)
    while True:
        words = str(_asked("Numbers, with commas", "0")).replace(",", " ").split()
        if all(word.isdigit() and int(word) <= len(names) for word in words) and words:
            break
        typer.echo(f"Give numbers from 0 to {len(names)}.", err=True)
    if "0" in words:
        return ()
    return tuple(joint for word in words for joint in groups[names[int(word) - 1]])


def _asked(question: str, default: str) -> object:
    try:
        return typer.prompt(question, default=default, err=True)
    except EOFError as error:
        raise RobotError("no answer: give --robot or --urdf.") from error
