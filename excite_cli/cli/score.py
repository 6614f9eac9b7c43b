"""`excite score`: a stored model against new data."""

from pathlib import Path

import typer

from excite_cli.cli import options
from excite_cli.cli.console import Terminal
from excite_cli.cli.next_step import after_forecast, after_score
from excite_cli.errors import ConfigError


@options.command
def score(
    terminal: Terminal,
    model: options.StoredModel,
    data: options.MaybeData = None,
    job: Path | None = typer.Option(
        None,
        "--job",
        metavar="FILE",
        help="A motion to come (CSV, ROS 2, MoveIt, a log): the error to expect on it.",
    ),
    output: Path | None = options.written("--output", "-o", help="File for the score (HDF5)."),
    held_out: options.OwnHeldOut = False,
    limits: Path | None = options.written(
        "--thresholds",
        metavar="FILE.json",
        help="Write thresholds of a collision detector, from these runs.",
    ),
    false_alarms: float = typer.Option(
        1.0, "--false-alarms", help="Allowed false alarms per hour."
    ),
    workers: options.Workers = 1,
    scheduler: options.Scheduler = None,
    overwrite: options.Overwrite = False,
) -> None:
    """Play a stored model on new data: does it still predict the torque, and if not, why?

    Nothing is fitted. Each run's error per joint is listed beside that when the model was made, and
    an alarm where its residual exceeds the model's tolerance, with the likely reason: a payload, a
    contact, an offset, other friction, an encoder that slipped. Files are read one at a time, so
    hundreds are fine. With MuJoCo the answer also says how far a simulation with the model, driven
    by the recorded torques (or set points), drifts from the robot within 0.1, 1 and 10 s.

    --thresholds: how large the residual of each joint may be, by speed and load, before a detector
    reports a collision; use fault-free runs.

    --job: before the robot moves. Along a plan, or the motion of a log, how large an error of the
    predicted torque is to be expected, and which joints go farther, faster, or carry more, than in
    the data that the model was made of.

    Exit status 1: a run exceeds the model's tolerance; more error is to be expected than usual.

    Examples:
      excite score diagnosis.h5 --job ur10.h5
      excite score diagnosis.h5 measured.h5 -o week.h5
      excite score diagnosis.h5 measured.h5 --held-out
    """
    from excite_cli.api.scoring import score as score_data
    from excite_cli.api.scoring import score_answer, thresholds
    from excite_cli.api.working import working

    if job is not None:
        _forecast(terminal, model, job, data, output, limits)
        return
    if not data:
        raise ConfigError("DATA is missing: give measured data, or --job with a motion to come.")
    with (
        working(workers, scheduler, 1, terminal.tell) as place,
        terminal.live("score", len(data)) as line,
    ):
        found = score_data(
            model,
            data,
            held_out=held_out,
            output=output,
            overwrite=overwrite,
            workers=place,
            progress=line,
            tell=terminal.tell,
        )
        if limits is not None:
            thresholds(model, data, false_alarms=false_alarms, output=limits, overwrite=overwrite)
    terminal.show(score_answer(found), after_score(found, data, output))


def _forecast(
    terminal: Terminal, model: Path, job: Path, data: list[Path] | None, *files: Path | None
) -> None:
    from excite_cli.api.forecasting import forecast, forecast_answer

    if data or any(files):
        raise ConfigError("--job: it takes no measured data, and writes no file. Run both in turn.")
    found = forecast(model, job, tell=terminal.tell)
    terminal.show(forecast_answer(found), after_forecast(found.good, model, job))
