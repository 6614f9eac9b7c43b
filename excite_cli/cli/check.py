"""`excite check`: every motion of a file against every constraint, by other means."""

from typing import Annotated

import typer

from excite_cli.cli import options
from excite_cli.cli.console import Terminal


def check(
    config: options.Config,
    file: options.MotionFile,
    rate: Annotated[float, typer.Option("--rate", min=1.0, help="Instants per second [Hz].")] = 1e3,
    random: Annotated[int, typer.Option("--random", min=0, help="Additional random instants.")] = 0,
    meshes: Annotated[
        bool, typer.Option("--meshes/--no-meshes", help="Check the collision meshes, too.")
    ] = True,
    slow: Annotated[
        float | None,
        typer.Option(
            "--slow",
            metavar="SHARE",
            help="Judge the motions slowed to a share of their limits of speed to jerk.",
        ),
    ] = None,
    overrides: options.Set = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
    no_progress: options.NoProgress = False,
) -> None:
    """Judge motions before a robot plays them: results, CSV, ROS 2, MoveIt, NumPy, measured data.

    Margins are taken at controller rate (and at random instants); distances of capsules are
    measured a second time by Pinocchio and coal. Between the instants every constraint is proved
    with bounds independent of the optimiser's kinematics; the collision meshes are checked
    by Pinocchio and coal, too. A verdict is `proved` (at every instant), `sampled` (no
    violation seen, with the reason why it is not proved) or `BROKEN`. Exit status 1: something is
    broken.

    Examples:
      excite check ur10.yaml ur10.h5
      excite check ur10.yaml ur10.h5 --random 10000 --json
    """
    from excite_cli.api.checking import check as check_motions
    from excite_cli.api.checking import check_answer
    from excite_cli.api.loading import load_problem
    from excite_cli.api.paths import existing
    from excite_cli.api.working import single_threaded

    terminal = Terminal(as_json, quiet, verbose, not no_progress)
    existing(file)
    with single_threaded():
        problem = load_problem(config, overrides or (), terminal.tell)
        with terminal.live("") as line:
            found = check_motions(
                problem,
                file,
                rate=rate,
                random=random,
                meshes=meshes,
                slow=slow,
                progress=lambda done, total: line(f"motion {done + 1}/{total}", done, total),
                tell=terminal.tell,
            )
    terminal.show(check_answer(found, str(file), problem))
