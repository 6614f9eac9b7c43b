"""`excite check`: every motion of a file against every constraint, by other means."""

import typer

from excite_cli.cli import options
from excite_cli.cli.console import Terminal
from excite_cli.cli.next_step import after_check


@options.command
def check(
    terminal: Terminal,
    config: options.Config,
    file: options.MotionFile,
    rate: float = typer.Option(1000.0, "--rate", min=1.0, help="Instants per second [Hz]."),
    random: int = typer.Option(0, "--random", min=0, help="Additional random instants."),
    meshes: bool = typer.Option(
        True, "--meshes/--no-meshes", help="Check the collision meshes, too."
    ),
    slow: float | None = typer.Option(
        None,
        "--slow",
        metavar="SHARE",
        help="Judge the motions slowed to a share of their limits of speed to jerk.",
    ),
    overrides: options.Set = None,
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
    from excite_cli.api.arguments import existing
    from excite_cli.api.checking import check as check_motions
    from excite_cli.api.checking import check_answer
    from excite_cli.api.loading import load_problem
    from excite_cli.api.motions import is_result

    existing(file)
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
    answer = check_answer(found, str(file), problem)
    terminal.show(answer, after_check(answer.good, config, file, is_result(file)))
