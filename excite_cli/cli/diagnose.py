"""`excite diagnose`: what the declared model lacks, and the error before and after."""

import sys
from pathlib import Path

import typer

from excite_cli.api.showing import Command
from excite_cli.cli import options
from excite_cli.cli.console import Terminal
from excite_cli.cli.help_page import OUTPUT

_ASKED = "the answer so far follows in some seconds; Ctrl-C again ends the command without it."


@options.command
def diagnose(
    terminal: Terminal,
    config: options.Config,
    data: options.Data,
    output: Path | None = options.written("--output", "-o", help="File for the diagnosis (HDF5)."),
    held_out: options.HeldOut = None,
    apply: Path | None = options.written(
        "--apply",
        metavar="NEW.yaml",
        help="Write the config with the effects found, if the held-out error fell.",
    ),
    apply_unconfirmed: bool = typer.Option(
        False,
        "--apply-unconfirmed",
        help="Let --apply write it even where that error did not fall.",
        rich_help_panel=OUTPUT,
    ),
    workers: options.Workers = 1,
    scheduler: options.Scheduler = None,
    overwrite: options.Overwrite = False,
    overrides: options.Set = None,
) -> None:
    """Find what the declared model lacks: friction, springs, payloads, delays and more.

    The declared model is fitted to all runs but the held-out one; its residual is traced to named
    effects, with their size, certainty, and the effects that these data cannot distinguish from
    them. The held-out run is used once, for the error before and after, and for the verdict on
    every effect. A single run is cut into blocks, every third held out. --workers split the
    runs; the results are identical. Ctrl-C, or diagnosis.max_seconds, ends the search with the
    answer so far.

    Exit status 1: effects were found, but the error on the held-out run did not fall.

    Examples:
      excite diagnose ur10.yaml measured.h5 -o diagnosis.h5 --apply better.yaml
    """
    from excite_cli.api.diagnosing import diagnose as diagnose_data
    from excite_cli.api.diagnosing import diagnosis_answer
    from excite_cli.api.loading import load_case
    from excite_cli.api.working import working
    from excite_cli.cli.stopping import answer_so_far

    with (
        working(workers, scheduler, 1, terminal.tell) as place,
        terminal.live("diagnose", 10) as line,
        answer_so_far(lambda: terminal.say(_ASKED)) as ended,
    ):
        found = diagnose_data(
            load_case(config, overrides or ()),
            data,
            held_out,
            output=output,
            apply=apply,
            apply_unconfirmed=apply_unconfirmed,
            overwrite=overwrite,
            command=Command(("excite", *sys.argv[1:])).line,
            workers=place,
            progress=line,
            tell=terminal.tell,
            ended=ended,
        )
    written = {"diagnosis": output, "config": apply if found.good or apply_unconfirmed else None}
    terminal.show(diagnosis_answer(found, str(config), written, terminal.verbose, data))
