"""What `excite init` asks at a terminal when no robot is given."""

from dataclasses import dataclass
from pathlib import Path

import typer

from excite_cli.errors import RobotError, nearest


@dataclass(frozen=True)
class Answers:
    """The robot (a name with its prefix, or a URDF), where to write, the joints (none: ours)."""

    robot: str
    output: Path | None
    joints: tuple[str, ...]


def ask(output: Path | None, joints: tuple[str, ...]) -> Answers:
    """Ask for the robot, the limbs to move and the file, each with a default."""
    from excite_cli.api.proposing import EXAMPLE_PREFIX, example_robots, limbs_of

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
        groups = limbs_of(str(Path(robot).resolve()) if is_file else robot)
        if len(groups) > 1:
            joints = _of_groups(groups, sum(map(len, groups.values())))
    default = output or Path(f"{Path(robot).stem if is_file else name}.yaml")
    return Answers(robot, Path(str(_asked("Write to", str(default)))), joints)


def _of_groups(groups: dict[str, tuple[str, ...]], count: int) -> tuple[str, ...]:
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
