"""`excite campaign`: plan, have it measured, diagnose, plan the next."""

from pathlib import Path
from typing import Annotated

import typer

from excite_cli.cli import options
from excite_cli.cli.console import Terminal
from excite_cli.errors import ConfigError

_MEASURED, _BUDGET, _SIMULATED = "Measured by", "Pace and budget", "Simulated robot"


def campaign(
    config: options.Config,
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder of the campaign.")] = Path(
        "campaign"
    ),
    measure: Annotated[
        str | None,
        typer.Option(
            "--measure",
            rich_help_panel=_MEASURED,
            metavar="COMMAND",
            help="Program that plays {motion} and writes the log {data}; or: simulate.",
        ),
    ] = None,
    inbox: Annotated[
        Path | None,
        typer.Option(
            "--inbox",
            rich_help_panel=_MEASURED,
            help="Exchange folder: excite writes motions here and expects their logs here.",
        ),
    ] = None,
    log: Annotated[
        str, typer.Option("--log", rich_help_panel=_MEASURED, help="Suffix of the logs.")
    ] = ".csv",
    timeout: Annotated[
        float | None,
        typer.Option(
            "--timeout",
            rich_help_panel=_MEASURED,
            min=0.001,
            help="Seconds for one motion. Default: five times the motion and a minute.",
        ),
    ] = None,
    retries: Annotated[
        int,
        typer.Option(
            "--retries", rich_help_panel=_MEASURED, min=0, help="Further tries for a motion."
        ),
    ] = 2,
    no_entry: Annotated[
        bool,
        typer.Option(
            "--no-entry",
            rich_help_panel=_MEASURED,
            help="Do not enter motions from rest at robot.posture, and go back to it.",
        ),
    ] = False,
    from_speed: Annotated[
        float,
        typer.Option(
            "--from-speed",
            rich_help_panel=_BUDGET,
            min=0.01,
            max=1.0,
            help="Share of the limits of speed, acceleration and jerk in the first round; it "
            "doubles from round to round.",
        ),
    ] = 1.0,
    max_rounds: Annotated[
        int,
        typer.Option("--max-rounds", rich_help_panel=_BUDGET, min=1, help="Rounds at the most."),
    ] = 8,
    max_seconds: Annotated[
        float,
        typer.Option(
            "--max-seconds",
            rich_help_panel=_BUDGET,
            min=0.0,
            help="No new round after so much motion [s]; 0: unlimited.",
        ),
    ] = 0.0,
    plain: Annotated[
        bool,
        typer.Option(
            "--plain",
            rich_help_panel=_BUDGET,
            help="No exploration motions: only those that excite the model's own effects.",
        ),
    ] = False,
    effect: Annotated[
        list[str] | None,
        typer.Option(
            "--effect",
            rich_help_panel=_SIMULATED,
            metavar="KIND@JOINT=VALUE…",
            help="With --measure simulate: an effect of the robot, as for `excite simulate`.",
        ),
    ] = None,
    inertia_error: Annotated[
        float,
        typer.Option(
            "--inertia-error",
            rich_help_panel=_SIMULATED,
            help="With --measure simulate: deviation of its inertias from the URDF.",
        ),
    ] = 0.2,
    seed: options.Seed = None,
    overrides: options.Set = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with the campaign in the folder.")
    ] = False,
    workers: options.Workers = 1,
    scheduler: options.Scheduler = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
    no_progress: options.NoProgress = False,
) -> None:
    """Plan motions, have them measured, diagnose, and plan the next, until the model converges.

    The program of --measure gets a motion (CSV: t, q, v, a, from rest to rest), plays it, and
    writes a log that the config reads; exit status 0 means measured. A log that is
    incomplete or of another motion is reported and rejected, and the motion repeated. At the time
    limit, and at Ctrl-C, all processes of the program get SIGTERM, and SIGKILL 10 s later or at the
    next Ctrl-C. A file in the inbox is accepted once it is a complete, newer log of the motion. In
    every round one motion separates or excites the known effects, and one explores untested
    candidates; the exploration motion is held out of the diagnosis and validates the model.

    The campaign ends when the model predicts the newest motion at training level without ambiguous
    effects, or when the budget is spent. Exit status 1: a question is open, which the answer names,
    or a motion was not measured.

    Everything is in the folder, after every step: campaign.html (the page of all rounds),
    model.yaml (the config with what was found), plans, motions, logs and diagnoses. --resume
    continues after any interruption without measuring anything again.

    Examples:
      excite campaign ur10.yaml --from-speed 0.3 \\
          --measure 'python play.py {motion} {data}'
      excite campaign ur10.yaml --resume --measure 'python play.py {motion} {data}'
      excite campaign ur10.yaml --inbox to_the_robot --log .h5
      excite campaign ur10.yaml --measure simulate --effect spring@elbow_joint=15
    """
    from excite_cli.api.campaigning import (
        MODEL,
        PAGE,
        CampaignOptions,
        campaign_answer,
        run_campaign,
    )
    from excite_cli.api.loading import load_case
    from excite_cli.api.working import single_threaded, working
    from excite_cli.cli.measured_by import measured_by
    from excite_cli.cli.start_line import start_line

    terminal = Terminal(as_json, quiet, verbose, not no_progress)
    if (measure is None) == (inbox is None):
        raise ConfigError(
            "say who measures: --measure 'COMMAND {motion} {data}', --measure simulate, or "
            "--inbox FOLDER; one of them."
        )
    if measure != "simulate" and (effect or inertia_error != 0.2):
        raise ConfigError("--effect and --inertia-error belong to --measure simulate.")
    asked = CampaignOptions(from_speed, max_rounds, max_seconds, not no_entry, plain)
    with (
        single_threaded(),
        working(workers, scheduler, 1, terminal.tell) as place,
        terminal.live("campaign") as line,
    ):
        case = load_case(config, options.changes(overrides, seed=seed))
        way = measured_by(
            case, measure, inbox, log, timeout, tuple(effect or ()), inertia_error, terminal.tell
        )
        found = run_campaign(
            case,
            way,
            output,
            asked,
            retries=retries,
            resume=resume,
            workers=place,
            progress=start_line(line, case.spec),
            tell=terminal.tell,
        )
    terminal.show(campaign_answer(found, output, {"model": MODEL, "page": PAGE}))
