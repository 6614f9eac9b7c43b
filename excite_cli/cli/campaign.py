"""`excite campaign`: plan, have it measured, diagnose, plan the next."""

import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from excite_cli.api.showing import Tell, saying
from excite_cli.cli import options
from excite_cli.cli.console import Terminal
from excite_cli.cli.next_step import after_campaign
from excite_cli.errors import ConfigError

if TYPE_CHECKING:
    from excite_cli.api.campaigning import Measure
    from excite_cli.api.loading import Case

_measured = partial(typer.Option, rich_help_panel="Measured by")
_budget = partial(typer.Option, rich_help_panel="Pace and budget")
_simulated = partial(typer.Option, rich_help_panel="Simulated robot")


@options.command
def campaign(
    terminal: Terminal,
    config: options.Config,
    output: Path = typer.Option(Path("campaign"), "--output", "-o", help="Folder of the campaign."),
    measure: str | None = _measured(
        None,
        "--measure",
        metavar="COMMAND",
        help="Program that plays {motion} and writes the log {data}; or: simulate.",
    ),
    inbox: Path | None = _measured(
        None,
        "--inbox",
        help="Exchange folder: excite writes motions here and expects their logs here.",
    ),
    log: str = _measured(".csv", "--log", help="Suffix of the logs."),
    timeout: float | None = _measured(
        None,
        "--timeout",
        min=0.001,
        help="Seconds for one motion. Default: five times the motion and a minute.",
    ),
    retries: int = _measured(2, "--retries", min=0, help="Further tries for a motion."),
    no_entry: bool = _measured(
        False,
        "--no-entry",
        help="Do not enter motions from rest at robot.posture, and go back to it.",
    ),
    from_speed: float = _budget(
        1.0,
        "--from-speed",
        min=0.01,
        max=1.0,
        help="Share of the limits of speed, acceleration and jerk in the first round; it "
        "doubles from round to round.",
    ),
    max_rounds: int = _budget(8, "--max-rounds", min=1, help="Rounds at the most."),
    max_seconds: float = _budget(
        0.0, "--max-seconds", min=0.0, help="No new round after so much motion [s]; 0: unlimited."
    ),
    plain: bool = _budget(
        False,
        "--plain",
        help="No exploration motions: only those that excite the model's own effects.",
    ),
    effect: list[str] | None = _simulated(
        None,
        "--effect",
        metavar="KIND@JOINT=VALUE…",
        help="With --measure simulate: an effect of the robot, as for `excite simulate`.",
    ),
    inertia_error: float = _simulated(
        0.2,
        "--inertia-error",
        help="With --measure simulate: deviation of its inertias from the URDF.",
    ),
    seed: options.Seed = None,
    overrides: options.Set = None,
    resume: bool = typer.Option(False, "--resume", help="Go on with the campaign in the folder."),
    workers: options.Workers = 1,
    scheduler: options.Scheduler = None,
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
    from excite_cli.api.working import working
    from excite_cli.cli.start_line import start_line

    if (measure is None) == (inbox is None):
        raise ConfigError(
            "say who measures: --measure 'COMMAND {motion} {data}', --measure simulate, or "
            "--inbox FOLDER; one of them."
        )
    if measure != "simulate" and (effect or inertia_error != 0.2):
        raise ConfigError("--effect and --inertia-error belong to --measure simulate.")
    asked = CampaignOptions(from_speed, max_rounds, max_seconds, not no_entry, plain)
    with (
        working(workers, scheduler, 1, terminal.tell) as place,
        terminal.live("campaign") as line,
    ):
        case = load_case(config, options.changes(overrides, seed=seed))
        way = _measured_by(
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
            progress=start_line(line, case.spec, counted=False),
            tell=terminal.tell,
        )
    answer = campaign_answer(found, output, {"model": MODEL, "page": PAGE})
    terminal.show(answer, after_campaign(found, output, sys.argv[1:]))


def _measured_by(
    case: "Case",
    measure: str | None,
    inbox: Path | None,
    suffix: str,
    limit: float | None,
    effects: tuple[str, ...],
    inertia_error: float,
    tell: Tell,
) -> "Measure":
    """A program, a folder for people who carry files, or a simulated robot."""
    from excite_cli.api.campaigning import Inbox, MeasureCommand, Simulated, SimulationSettings

    if inbox is not None:
        return Inbox(inbox, saying(tell), suffix)
    assert measure is not None
    if measure == "simulate":
        settings = SimulationSettings(seed=case.spec.seed, inertia_error=inertia_error)
        return Simulated(case, effects, settings)
    return MeasureCommand.of(measure, suffix, limit, tell)
