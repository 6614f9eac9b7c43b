"""`excite study`: the same work for many settings and many logs."""

from pathlib import Path
from typing import Annotated

import typer

from excite_cli.cli import options
from excite_cli.cli.console import Terminal
from excite_cli.cli.help_page import OUTPUT


def study(
    config: options.Config,
    logs: Annotated[
        list[Path] | None,
        typer.Argument(help="Measured data, a case each: HDF5, CSV or bags.", show_default=False),
    ] = None,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary",
            metavar="KEY=V1,V2,…",
            help="Key of the config with the values it takes, or a range 1..8 (may be repeated: "
            "all combinations).",
        ),
    ] = None,
    identify_only: Annotated[
        bool, typer.Option("--identify-only", help="Logs are identified, not diagnosed.")
    ] = False,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FOLDER",
            help="Folder for the cases. Default: <config name>_study here.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    resume: Annotated[
        bool,
        typer.Option("--resume", help="Skip cases that are there; failed ones are done again."),
    ] = False,
    overwrite: options.Overwrite = False,
    overrides: options.Set = None,
    threads: options.Threads = 1,
    workers: options.Workers = 1,
    scheduler: options.Scheduler = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
    no_progress: options.NoProgress = False,
) -> None:
    """Optimise, or identify and diagnose logs, for every combination of settings.

    Without logs the config is optimised for every combination of the --vary values; with logs every
    log is identified and diagnosed for every combination. The folder gets the files of every case,
    its key figures as JSON, and a table of all, study.csv. A case that fails is one row with its
    message. Exit status 1: a case failed.

    Examples:
      excite study ur10.yaml --vary seed=1..2 -o seeds
      excite study ur10.yaml --vary trajectory.harmonics=4,5 -o harmonics
      excite study ur10.yaml measured.h5 --identify-only -o logs \\
        --vary identification.method=ols,wls
    """
    from excite_cli.cli.setup import single_threaded
    from excite_cli.cli.study_tables import answer_of, study_table
    from excite_cli.cli.working import working
    from excite_cli.errors import ConfigError
    from excite_cli.study.case import StudyTask
    from excite_cli.study.plan import planned_cases
    from excite_cli.study.records import TABLE
    from excite_cli.study.study import StudyNews, run_study
    from excite_cli.study.vary import parse_vary

    terminal = Terminal(as_json, quiet, verbose, not no_progress)
    if resume and overwrite:
        raise ConfigError("--resume goes on with the folder, --overwrite replaces it: give one.")
    varied = [parse_vary(text) for text in vary or []]
    task = StudyTask(config.resolve(), tuple(overrides or []), not identify_only)
    cases = planned_cases(task, logs or [], varied)
    folder = output or Path(f"{config.stem}_study")
    with (
        working(terminal, workers, scheduler, threads) as place,
        single_threaded(threads),
        terminal.live("", len(cases)) as show,
    ):

        def report(news: StudyNews) -> None:
            best = f", best {news.best:.4g}" if news.best < float("inf") else ""
            show(
                f"{news.done} of {news.total} cases done, {news.running} running{best}; "
                f"{news.told.splitlines()[0]}",
                news.done,
            )

        records = run_study(task, cases, folder, place, resume, report, overwrite)
    failed = sum(record.failed for record in records)
    words = f"{len(records)} cases" + (f", {failed} failed" if failed else "")
    terminal.answer(
        [study_table(records), f"{words}; {folder / TABLE}"], answer_of(records, folder)
    )
    if failed:
        raise typer.Exit(1)
