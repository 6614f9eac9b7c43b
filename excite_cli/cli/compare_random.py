"""`excite compare-random`: optimised motions beside the best of many random ones."""

from pathlib import Path
from typing import Annotated

import typer

from excite_cli.cli import options
from excite_cli.cli.console import Terminal
from excite_cli.cli.help_page import OUTPUT


def compare_random(
    config: options.Config,
    candidates: Annotated[
        int, typer.Option("--candidates", min=1, help="Least number of random motions.")
    ] = 300,
    budget: Annotated[
        float | None,
        typer.Option(
            "--seconds",
            min=0.0,
            help="Draw at least this long; 0: the number alone counts, so that the result can be "
            "reproduced. Default: as long as the optimiser took.",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", help="Write both to this result file.", rich_help_panel=OUTPUT
        ),
    ] = None,
    optimized: Annotated[
        Path | None,
        typer.Option("--optimized", help="Result of `excite optimize` to compare with."),
    ] = None,
    motions: Annotated[
        int | None, typer.Option("--motions", min=1, help="Override sequence.motions.")
    ] = None,
    seed: options.Seed = None,
    overrides: options.Set = None,
    overwrite: options.Overwrite = False,
    threads: options.Threads = 1,
    workers: options.Workers = 1,
    scheduler: options.Scheduler = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
    no_progress: options.NoProgress = False,
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
    from dataclasses import replace

    from rich.table import Table

    from excite_cli.cli.setup import load_problem, output_path, single_threaded
    from excite_cli.cli.start_line import iterations_of, start_line
    from excite_cli.cli.tables import comparison_table, motion_data
    from excite_cli.cli.working import working
    from excite_cli.config.inputs import files_of_config
    from excite_cli.config.load import parse_spec
    from excite_cli.errors import FileError
    from excite_cli.excitation.random_baseline import random_baseline
    from excite_cli.excitation.result import matches
    from excite_cli.excitation.run import continue_run, new_result
    from excite_cli.given_files import refuse_inputs_as_outputs
    from excite_cli.store.result_file import read_result, write_result
    from excite_cli.store.versions import versions

    terminal = Terminal(as_json, quiet, verbose, not no_progress)
    inputs = [optimized] if optimized is not None else []
    path = output_path(output, config, overwrite, inputs=inputs) if output else None
    extra = [f"sequence.motions={motions}"] if motions is not None else []
    extra += [f"seed={seed}"] if seed is not None else []
    with single_threaded(threads), working(terminal, workers, scheduler, threads) as place:
        problem = load_problem(terminal, config, overrides, extra)
        refuse_inputs_as_outputs({"--output": path}, files_of_config(problem.spec, problem.folder))
        if optimized is not None:
            result = read_result(optimized)
            reason = matches(problem, result)
            if reason:
                raise FileError(f"--optimized {optimized} does not belong to {config}: {reason}.")
            stored = parse_spec(result.config, f"the config stored in {optimized}")
            if (stored.trajectory, stored.sampling) != (
                problem.spec.trajectory,
                problem.spec.sampling,
            ):
                raise FileError(
                    f"--optimized {optimized} has another trajectory or sampling section than "
                    f"{config}. Compare with the config it was made with."
                )
        else:
            with terminal.live("optimising", iterations_of(problem.spec)) as show:
                result = continue_run(
                    problem,
                    new_result(problem, [], versions(), config.resolve().parent),
                    start_line(show, problem.spec),
                    lambda step, current: None,
                    workers=place,
                )
        seconds = sum(motion.seconds for motion in result.motions)
        with terminal.live("random motions", candidates) as show:
            baseline = random_baseline(
                problem,
                len(result.motions),
                problem.spec.seed,
                candidates,
                seconds if budget is None else budget,
                lambda drawn, best: show(f"{drawn} of {candidates} drawn, best {best:.1f}", drawn),
                result.prior_stack,
                place,
            )
    result = replace(
        result,
        random=baseline.motions,
        random_candidates=(baseline.candidates, baseline.admissible),
    )
    if path is not None:
        write_result(path, result, problem)
    summary = (
        f"{baseline.candidates} candidates in {baseline.seconds:.1f} s, {baseline.admissible} "
        f"admissible; the optimiser took {seconds:.1f} s"
    )
    answer: list[Table | str] = [comparison_table(result.motions, baseline.motions), summary]
    terminal.answer(
        [*answer, str(path)] if path is not None else answer,
        {
            "random": [
                {
                    "index": m.index,
                    "condition_number": m.condition_number,
                    "stacked_condition_number": m.stacked_condition_number,
                }
                for m in baseline.motions
            ],
            "optimized": [motion_data(m) for m in result.motions],
            "candidates": baseline.candidates,
            "admissible": baseline.admissible,
            "seconds": {"optimized": seconds, "random": baseline.seconds},
            "output": str(path) if path is not None else None,
        },
    )
