"""`excite init`: a config that works, for a robot of which only the URDF is known."""

from pathlib import Path
from typing import Annotated

import typer

from excite_cli.cli import options
from excite_cli.cli.console import Terminal


def init(
    robot: Annotated[
        str | None,
        typer.Option("--robot", help="A robot of example-robot-data; see `excite robots`."),
    ] = None,
    urdf: Annotated[Path | None, typer.Option("--urdf", help="A URDF file.")] = None,
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
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
    no_progress: options.NoProgress = False,
) -> None:
    """Write a config that works for a robot, with comments that say what was chosen and why.

    Joints to move are chosen (no fingers, no wheels), with sensible limits where the URDF has none,
    a posture clear of limits and of itself, and a pace that suits the slowest joint. Without
    --robot and --urdf, the terminal is asked.

    Example:  excite init --robot ur10
    """
    import sys

    from excite_cli.api.outputs import check_outputs
    from excite_cli.atomic import write_text_atomically
    from excite_cli.cli.init_questions import ask
    from excite_cli.cli.setup import single_threaded
    from excite_cli.errors import ConfigError
    from excite_cli.proposal.propose import Request, propose
    from excite_cli.robot.description import EXAMPLE_PREFIX, load_description

    terminal = Terminal(as_json, quiet, verbose, not no_progress)
    if robot is not None and urdf is not None:
        raise ConfigError("--robot and --urdf both name a robot: give one of them.")
    if base not in ("fixed", "floating"):
        raise ConfigError(f"--base {base}: allowed are fixed and floating.")
    chosen = tuple(filter(None, (name.strip() for name in (joints or "").split(","))))
    if robot is None and urdf is None:
        if not (sys.stdin.isatty() and sys.stderr.isatty()) or as_json or quiet:
            raise ConfigError(
                "init needs a robot: --robot NAME (`excite robots` lists them) or --urdf FILE. At "
                "a terminal it asks."
            )
        answers = ask(output, chosen)
        robot, urdf, output, chosen = (
            answers.robot,
            answers.urdf,
            answers.output,
            answers.joints,
        )
    name = robot.removeprefix(EXAMPLE_PREFIX) if robot is not None else (urdf or Path()).stem
    path = output or Path(f"{name}.yaml")
    check_outputs({"output": path}, overwrite)
    folder = path.resolve().parent
    source = f"{EXAMPLE_PREFIX}{name}" if robot is not None else _from(urdf or Path(), folder)
    load_description(source, relative_to=folder)  # a wrong name is told at once
    terminal.say(f"looking at {name}: capsules and tables of its meshes take longest, once")
    asked = Request(source, folder, chosen, "floating" if base == "floating" else "fixed")
    with single_threaded():
        proposal = propose(asked)
    write_text_atomically(path, proposal.text)
    problem = proposal.settled.problem
    lines = [
        f"{problem.robot.name}: moves {len(proposal.joints)} joints, "
        f"{problem.base.rank} base parameters, {problem.trajectory.duration:.4g} s",
        *proposal.notes,
        f"{path}",
        f"next:  excite optimize {path}",
    ]
    terminal.answer(
        lines,
        {
            "output": str(path),
            "robot": source,
            "joints": list(proposal.joints),
            "left_out": {why: list(names) for why, names in proposal.left_out.items()},
            "base_parameters": problem.base.rank,
            "duration": problem.trajectory.duration,
            "notes": list(proposal.notes),
        },
    )


def _from(urdf: Path, folder: Path) -> str:
    """The URDF's path as the config in `folder` says it: relative where it is near."""
    import os

    relative = os.path.relpath(urdf.resolve(), folder)
    return str(urdf.resolve()) if relative.count("..") > 3 else relative
