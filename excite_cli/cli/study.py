"""`excite study`: the same work for many settings and many logs."""

from pathlib import Path

import typer

from excite_cli.cli import options
from excite_cli.cli.console import Terminal
from excite_cli.cli.next_step import next_step


@options.command
def study(
    terminal: Terminal,
    config: options.Config,
    logs: list[Path] | None = typer.Argument(
        None,
        help="Measured data, a case each: HDF5, CSV, MATLAB, parquet, bags.",
        show_default=False,
    ),
    vary: list[str] | None = typer.Option(
        None,
        "--vary",
        metavar="KEY=V1,V2,…",
        help="Key of the config with the values it takes, or a range 1..8 (may be repeated: "
        "all combinations).",
    ),
    identify_only: bool = typer.Option(
        False, "--identify-only", help="Logs are identified, not diagnosed."
    ),
    output: Path | None = options.written(
        "--output",
        "-o",
        metavar="FOLDER",
        help="Folder for the cases. Default: <config name>_study here.",
    ),
    resume: bool = typer.Option(False, "--resume", help="Skip finished cases; repeat failed ones."),
    overwrite: options.Overwrite = False,
    overrides: options.Set = None,
    threads: options.Threads = 1,
    workers: options.Workers = 1,
    scheduler: options.Scheduler = None,
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
    from excite_cli.api.studying import StudyNews, run_study, study_answer, study_folder
    from excite_cli.api.working import working

    with (
        working(workers, scheduler, threads, terminal.tell) as place,
        terminal.live("") as line,
    ):

        def progress(news: StudyNews) -> None:
            best = f", best {news.best:.4g}" if news.best < float("inf") else ""
            line(
                f"{news.done} of {news.total} cases done, {news.running} running{best}; "
                f"{news.told.splitlines()[0]}",
                news.done,
                news.total,
            )

        records = run_study(
            config,
            logs or (),
            vary or (),
            output=output,
            overrides=overrides or (),
            diagnosed=not identify_only,
            resume=resume,
            overwrite=overwrite,
            progress=progress,
            workers=place,
        )
    folder = study_folder(config, output)
    answer = study_answer(records, folder)
    words = "open the table" if answer.good else "see to the messages, and repeat with --resume;"
    terminal.show(answer, next_step(f"{words} {answer.data['table']}"))
