"""What `excite init` asks at a terminal when no robot is given."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from excite_cli.errors import RobotError, nearest

if TYPE_CHECKING:
    from excite_cli.api.proposing import Allow, FolderRequest


@dataclass(frozen=True)
class Answers:
    """The robot (a name with its prefix, or a URDF), where to write, the joints (none: ours)."""

    robot: str
    output: Path | None
    joints: tuple[str, ...]


def may_read(allow_found: bool, at_terminal: bool) -> "Allow":
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
            answers[str(needed)] = typer.confirm(question, default=False, err=True)
        return answers[str(needed)]

    return allow


def ask(
    output: Path | None,
    joints: tuple[str, ...],
    limbs: Callable[[str], Mapping[str, Sequence[str]]],
) -> Answers:
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
    return Answers(robot, Path(str(_asked("Write to", str(default)))), joints)


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
