"""`excite optimize`: motions one after the other, each with all earlier ones stacked."""

from enum import StrEnum
from pathlib import Path

import typer

from excite_cli.cli import options
from excite_cli.cli.console import Terminal
from excite_cli.cli.next_step import after_optimize
from excite_cli.errors import ConfigError

# κ of a UR10's motion is 8 after so many; a diagnosis of it is the same as after 1000.
QUICK_ITERATIONS = 50


class Purpose(StrEnum):
    """What --for plans for."""

    PAYLOAD = "payload"


@options.command
def optimize(
    terminal: Terminal,
    config: options.Config,
    output: options.Output = None,
    motions: options.Motions = None,
    prior: list[Path] | None = typer.Option(
        None,
        "--prior",
        help="Result file, motion (CSV, .npz, …) or measured data stacked as earlier data "
        "(may be repeated).",
    ),
    start: Path | None = typer.Option(
        None, "--start", help="Motions from which the search starts: a result file, CSV, .npz, …"
    ),
    after: Path | None = typer.Option(
        None, "--after", help="Plan the next motion after this diagnosis."
    ),
    purpose: Purpose | None = typer.Option(
        None, "--for", help="payload: shortest motion that identifies one, given --fit."
    ),
    fit: Path | None = typer.Option(
        None, "--fit", help="Fit of the robot alone, for --for payload."
    ),
    link: options.Link = None,
    restarts: int | None = typer.Option(
        None, "--starts", min=1, help="Starts per motion, the best kept; optimizer.restarts."
    ),
    quick: bool = typer.Option(False, "--quick", help="A first look: one start, 50 iterations."),
    power: list[str] | None = typer.Option(
        None,
        "--power",
        metavar="KIND=SIZE",
        help="Probability of naming an effect of this size (may be repeated).",
    ),
    efficiency: bool = typer.Option(
        False, "--efficiency", help="Information efficiency relative to free states, too."
    ),
    seed: options.Seed = None,
    overrides: options.Set = None,
    resume: bool = typer.Option(False, "--resume", help="Continue an existing file."),
    overwrite: options.Overwrite = False,
    threads: options.Threads = 1,
    workers: options.Workers = 1,
    scheduler: options.Scheduler = None,
) -> None:
    """Find motions that excite the inertial parameters and the listed effects.

    Every stored motion keeps all constraints. With --after, the motion distinguishes the effects
    that the diagnosis could not; if there are none, it excites the model with all effects found, on
    top of the measured data. Exit status 1: no admissible motion exists or was found, and the
    message names the constraint that prevents it.

    With --for payload the motion is the shortest that identifies mass, centre and inertia of what
    the robot carries, given a fit of the robot alone; its config is written beside the result
    (.yaml).

    Ctrl-C stores the best motion so far, proved as well; --resume plans that motion again.

    With --starts each motion is the best of many starts (successive halving), which --workers
    processes or a dask cluster share; the result is bit-identical.

    Examples:
      excite optimize ur10.yaml -o ur10.h5
      excite optimize ur10.yaml -o ur10.h5 --motions 3 --resume
      excite optimize ur10.yaml -o look.h5 --quick
      excite optimize ur10.yaml -o shown.h5 --power load_dependent_friction=0.03
      excite optimize ur10.yaml -o best.h5 --starts 4 --workers 2
      excite optimize ur10.yaml -o judged.h5 --efficiency
      excite optimize ur10.yaml -o more.h5 --prior ur10.h5
      excite optimize ur10.yaml -o next.h5 --after diagnosis.h5
      excite optimize ur10.yaml -o load.h5 --for payload --fit fit.h5
    """
    from excite_cli.api.load_planning import plan_load, problem_beside, save_problem
    from excite_cli.api.loading import load_case, load_problem
    from excite_cli.api.outputs import held_result, result_path
    from excite_cli.api.planning import Planned, plan, plan_after, plan_answer, sizes_asked
    from excite_cli.api.working import working
    from excite_cli.cli.start_line import iterations_of, start_line

    if after is not None and prior:
        raise ConfigError("--after brings the measured data with it: leave --prior out.")
    if purpose is None:
        if fit is not None or link is not None:
            raise ConfigError("--fit and --link belong to --for payload.")
    else:
        _refuse_beside_payload(fit, after or prior or start or resume, motions)
    inputs = [each for each in (config, *(prior or ()), start, after, fit) if each is not None]
    path = result_path(output, config)
    if quick and restarts is not None:
        raise ConfigError("--quick makes one start: leave --starts out.")
    changes = options.changes(
        overrides,
        seed=seed,
        motions=motions,
        restarts=1 if quick else restarts,
        iterations=QUICK_ITERATIONS if quick else None,
    )
    with (
        held_result(path, overwrite, resume, inputs),
        working(workers, scheduler, threads, terminal.tell) as place,
    ):
        planned: Planned
        if purpose is not None and fit is not None:
            case = load_case(config, changes)
            with problem_beside(path, overwrite, inputs) as beside:
                load = plan_load(case, fit, link, tell=terminal.tell)
                save_problem(beside, load.problem)
            planned = load.problem
        elif after is None:
            planned = load_problem(config, changes, terminal.tell)
        else:
            planned = plan_after(load_case(config, changes), after, terminal.tell)
        sizes = sizes_asked(power or (), planned)
        with terminal.live("", iterations_of(planned)) as line:
            result = plan(
                planned,
                priors=prior or (),
                starts=start or (),
                output=path,
                overwrite=overwrite,
                resume=resume,
                progress=start_line(line, planned.spec),
                workers=place,
                tell=terminal.tell,
            )
    answer = plan_answer(planned, result, str(path), efficiency, sizes)
    terminal.show(answer, after_optimize(answer.good, config, path, after, fit))


def _refuse_beside_payload(fit: Path | None, other: object, motions: int | None) -> None:
    """See that --for payload has its fit and nothing that belongs to motions for the robot."""
    if fit is None:
        raise ConfigError("--for payload needs --fit: a fit of the robot without it.")
    if other:
        raise ConfigError("--for payload takes no --after, --prior, --start, --resume.")
    if motions is not None:
        raise ConfigError("--for payload plans one motion, the shortest: leave --motions out.")
