"""What `excite init` asks at a terminal when no robot is given."""

from dataclasses import dataclass
from pathlib import Path

import typer

from excite_cli.errors import RobotError, nearest


@dataclass(frozen=True)
class Answers:
    """A robot's name or URDF, where to write, and the joints to move (none: our choice)."""

    robot: str | None
    urdf: Path | None
    output: Path
    joints: tuple[str, ...]


def ask(output: Path | None, joints: tuple[str, ...]) -> Answers:
    """Ask for the robot, the limbs to move and the file, each with a default."""
    from excite_cli.proposal.joints import choose_joints
    from excite_cli.proposal.limbs import limbs
    from excite_cli.robot.description import EXAMPLE_PREFIX, example_robots, load_description
    from excite_cli.robot.urdf_joints import survey

    known = example_robots()
    while True:
        word = str(_asked("Robot (a name of `excite robots`, or a URDF file)", "ur10")).strip()
        name = word.removeprefix(EXAMPLE_PREFIX)
        if name in known or Path(word).expanduser().is_file():
            break
        typer.echo(f"There is no robot and no file '{word}'.{nearest(name, known)}", err=True)
    is_file = name not in known
    urdf = Path(word).expanduser() if is_file else None
    source = str(urdf.resolve()) if urdf is not None else f"{EXAMPLE_PREFIX}{name}"
    if not joints:
        chosen = choose_joints(survey(load_description(source)).joints, source).chosen
        groups = limbs(chosen)
        if len(groups) > 1:
            joints = _of_groups(groups, len(chosen))
    default = output or Path(f"{urdf.stem if urdf is not None else name}.yaml")
    written = Path(str(_asked("Write to", str(default))))
    return Answers(None if is_file else name, urdf, written, joints)


def _of_groups(groups: dict[str, tuple[str, ...]], count: int) -> tuple[str, ...]:
    """Joints of the groups that are asked for; none for all."""
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
