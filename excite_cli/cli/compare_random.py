"""`excite compare-random`: optimised motions beside the best of many random ones."""

from pathlib import Path

import typer

from excite_cli.cli import options
from excite_cli.cli.console import Terminal
from excite_cli.cli.next_step import next_step


@options.command
def compare_random(
    terminal: Terminal,
    config: options.Config,
    candidates: int = typer.Option(
        300, "--candidates", min=1, help="Minimum number of random motions."
    ),
    budget: float | None = typer.Option(
        None,
        "--seconds",
        min=0.0,
        help="Draw at least this long; 0: the number alone counts, so that the result can "
        "be reproduced. Default: as long as the optimiser took.",
    ),
    output: Path | None = options.written("--output", "-o", help="Write both to this result file."),
    optimized: Path | None = typer.Option(
        None, "--optimized", help="Result of `excite optimize` to compare with."
    ),
    motions: options.Motions = None,
    seed: options.Seed = None,
    overrides: options.Set = None,
    overwrite: options.Overwrite = False,
    threads: options.Threads = 1,
    workers: options.Workers = 1,
    scheduler: options.Scheduler = None,
) -> None:
    """Compare with random motions under the same constraints, as in the paper's Tables I and II.

    The problem is optimised first (or taken from --optimized); then at least --candidates random
    motions are drawn, and more until as much time has passed as the optimiser took. --workers share
    both, starts of the optimiser and random motions.

    Examples:
      excite compare-random ur10.yaml --candidates 100
      excite compare-random ur10.yaml --candidates 40 --seconds 0
      excite compare-random ur10.yaml --optimized ur10.h5 -o compared.h5
    """
    from excite_cli.api.comparing import compare_random as compare
    from excite_cli.api.comparing import comparison_answer, optimized_for
    from excite_cli.api.loading import load_problem
    from excite_cli.api.outputs import held
    from excite_cli.api.planning import plan
    from excite_cli.api.working import working
    from excite_cli.cli.start_line import iterations_of, start_line

    inputs = (config,) if optimized is None else (config, optimized)
    changes = options.changes(overrides, seed=seed, motions=motions)
    with (
        held({"output": output}, overwrite, inputs),
        working(workers, scheduler, threads, terminal.tell) as place,
    ):
        problem = load_problem(config, changes, terminal.tell)
        if optimized is not None:
            result = optimized_for(problem, optimized)
        else:
            with terminal.live("optimising", iterations_of(problem)) as line:
                progress = start_line(line, problem.spec)
                result = plan(problem, progress=progress, workers=place, tell=lambda note: None)
        with terminal.live("random motions", candidates) as line:
            found = compare(
                problem,
                result,
                candidates=candidates,
                seconds=budget,
                output=output,
                overwrite=overwrite,
                drawn=lambda n, best: line(f"{n} of {candidates} drawn, best {best:.1f}", n),
                workers=place,
            )
    following = (
        next_step("keep motions of this config", "optimize", config)
        if optimized is None
        else next_step("write the motions for the controller", "export", optimized, "-f", "csv")
    )
    terminal.show(comparison_answer(found, None if output is None else str(output)), following)
