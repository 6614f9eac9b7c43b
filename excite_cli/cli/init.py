"""`excite init`: a config that works, for a robot of which only the URDF is known."""

import sys
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
    from excite_cli.api.proposing import EXAMPLE_PREFIX, save_proposal
    from excite_cli.api.threads import single_threaded
    from excite_cli.cli.init_questions import Answers, ask
    from excite_cli.errors import ConfigError

    terminal = Terminal(as_json, quiet, verbose, not no_progress)
    if robot is not None and urdf is not None:
        raise ConfigError("--robot and --urdf both name a robot: give one of them.")
    chosen = tuple(filter(None, (name.strip() for name in (joints or "").split(","))))
    if robot is not None:
        answers = Answers(f"{EXAMPLE_PREFIX}{robot.removeprefix(EXAMPLE_PREFIX)}", output, chosen)
    elif urdf is not None:
        answers = Answers(str(urdf), output, chosen)
    elif sys.stdin.isatty() and sys.stderr.isatty() and not (as_json or quiet):
        answers = ask(output, chosen)
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
            overwrite=overwrite,
            tell=terminal.tell,
        )
    terminal.show(answer)
