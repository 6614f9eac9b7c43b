"""`excite optimize`: motions one after the other, each with all earlier ones stacked."""

from pathlib import Path
from typing import Annotated

import typer

from excite_cli.cli import options
from excite_cli.cli.console import Terminal


def optimize(
    config: options.Config,
    output: options.Output = None,
    motions: Annotated[
        int | None, typer.Option("--motions", min=1, help="Override sequence.motions.")
    ] = None,
    prior: Annotated[
        list[Path] | None,
        typer.Option(
            "--prior",
            help="Result file, motion (CSV, .npz, …) or measured data stacked as earlier data (may "
            "be repeated).",
        ),
    ] = None,
    start: Annotated[
        Path | None,
        typer.Option(
            "--start", help="Motions from which the search starts: a result file, CSV, .npz, …"
        ),
    ] = None,
    after: Annotated[
        Path | None,
        typer.Option("--after", help="Plan the next motion after this diagnosis."),
    ] = None,
    restarts: Annotated[
        int | None,
        typer.Option(
            "--starts", min=1, help="Starts per motion, the best kept; optimizer.restarts."
        ),
    ] = None,
    seed: options.Seed = None,
    overrides: options.Set = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with an existing file.")] = False,
    overwrite: options.Overwrite = False,
    threads: options.Threads = 1,
    workers: options.Workers = 1,
    scheduler: options.Scheduler = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
    no_progress: options.NoProgress = False,
) -> None:
    """Find motions that make the inertial parameters, and effects that are listed, visible.

    Every stored motion keeps all constraints. With --after, the motion tells apart the effects that
    the diagnosis could not; if there are none, it excites the model with all effects found, on top
    of the measured data. Exit status 1: no admissible motion exists or was found, and the message
    names what stands in the way.

    With --starts each motion is the best of many starts, which --workers processes or a dask
    cluster share; the result is the same to the last digit whoever does them.

    Examples:
      excite optimize ur10.yaml -o ur10.h5
      excite optimize ur10.yaml -o ur10.h5 --motions 3 --resume
      excite optimize ur10.yaml -o quick.h5 --set optimizer.max_iterations=20
      excite optimize ur10.yaml -o best.h5 --starts 4 --workers 2
      excite optimize ur10.yaml -o more.h5 --prior ur10.h5
      excite optimize ur10.yaml -o next.h5 --after diagnosis.h5
    """
    from rich.table import Table

    from excite_cli.api.motions import load_motions
    from excite_cli.cli.setup import (
        load_next_motion,
        load_priors,
        load_problem,
        output_path,
        single_threaded,
    )
    from excite_cli.cli.start_line import iterations_of, start_line
    from excite_cli.cli.tables import (
        criterion_data,
        margin_table,
        motion_data,
        motion_table,
        outlook_table,
    )
    from excite_cli.cli.working import tell_idle, working
    from excite_cli.errors import ConfigError
    from excite_cli.excitation.result import Result
    from excite_cli.excitation.run import continue_run, new_result, resumed_result
    from excite_cli.excitation.sequence import Step
    from excite_cli.store.result_file import read_result, write_result
    from excite_cli.store.versions import versions

    terminal = Terminal(as_json, quiet, verbose, not no_progress)
    if resume and overwrite:
        raise ConfigError("--resume goes on with the file, --overwrite replaces it: give one.")
    if after is not None and prior:
        raise ConfigError("--after brings the measured data with it: leave --prior out.")
    path = output_path(output, config, overwrite, resume)
    extra = [f"sequence.motions={motions}"] if motions is not None else []
    extra += [f"seed={seed}"] if seed is not None else []
    extra += [f"optimizer.restarts={restarts}"] if restarts is not None else []
    with single_threaded(threads), working(terminal, workers, scheduler, threads) as place:
        following = None
        if after is not None:
            following = load_next_motion(terminal, config, after, [*(overrides or []), *extra])
            problem = following.model
            earlier: list[Path] = [after]
        else:
            problem = load_problem(terminal, config, overrides, extra)
            earlier = prior or []
        tell_idle(terminal, workers, problem.spec.optimizer.restarts)
        if resume and path.exists():
            result = resumed_result(problem, read_result(path), path, earlier)
            terminal.say(f"resuming after motion {len(result.motions)} of {path}")
        else:
            stacks = (
                load_priors(terminal, problem, earlier)
                if following is None
                else [(str(after), following.prior)]
            )
            result = new_result(problem, stacks, versions(), config.resolve().parent)
        starts = load_motions(problem, start, tell=terminal.tell) if start is not None else []
        with terminal.live("", iterations_of(problem.spec)) as show:
            report = start_line(show, problem.spec)

            def store(step: Step, current: Result) -> None:
                write_result(path, current, problem)
                motion = step.motion
                note = "" if motion.improved else "; it brings no improvement"
                note += "; raise optimizer.max_seconds" if motion.status == "time limit" else ""
                note += f"; {motion.note}" if motion.note else ""
                if motion.certified:
                    loose = [name for name, proved in motion.certified.items() if not proved]
                    told = "all constraints proved at every instant"
                    note += f"; not proved: {', '.join(loose)}" if loose else f"; {told}"
                terminal.say(
                    f"motion {motion.index}: condition number {motion.condition_number:.2f}, "
                    f"stacked {motion.stacked_condition_number:.2f} "
                    f"({motion.seconds:.1f} s, {motion.status}{note})"
                )

            if following is None:
                result = continue_run(problem, result, report, store, starts=starts, workers=place)
            else:
                result = continue_run(
                    following.problem, result, report, store, following.model, starts, place
                )
    outlook = following.outlook([m.coefficients for m in result.motions]) if following else None
    tables: list[Table | str] = [motion_table(result.motions), f"{path}"]
    if outlook is not None and outlook["pairs"]:
        tables.insert(0, outlook_table(outlook))
    if problem.constraints:
        tables.insert(-1, margin_table(result.motions, problem.constraints))
    terminal.answer(
        tables,
        {
            "motions": [motion_data(m) for m in result.motions],
            "criterion": criterion_data(problem),
            "output": str(path),
            **({"next_experiment": outlook} if outlook is not None else {}),
        },
    )
