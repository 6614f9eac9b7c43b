"""`excite export`: motions for controllers, identified models for simulators."""

from pathlib import Path

import typer

from excite_cli.cli import options
from excite_cli.cli.completion import complete_format
from excite_cli.cli.console import Terminal
from excite_cli.cli.next_step import after_export
from excite_cli.cli.options import start_from
from excite_cli.errors import ConfigError


@options.command
def export(
    terminal: Terminal,
    file: Path = typer.Argument(
        ..., help="A result file, a motion (CSV, …), or a model.", show_default=False
    ),
    format_: str = typer.Option(
        ...,
        "--format",
        "-f",
        metavar="FORMAT",
        help="{motion_formats} of motions; urdf, mjcf, c, ros2-package, randomization of "
        "models; isaaclab, mjlab, bam of those whose robot follows set points; yaml of fits.",
        autocompletion=complete_format,
    ),
    output: Path | None = options.written(
        "--output", "-o", help="File, or folder of a bag or a package. Default: named after FILE."
    ),
    motion: str = typer.Option(
        "all", "--motion", metavar="I|all", help="Which motion of a result file."
    ),
    rate: float = typer.Option(1000.0, "--rate", help="Instants per second [Hz]."),
    equidistant: bool = typer.Option(
        False, "--equidistant", help="Stretch the step so that all steps are equal."
    ),
    periods: int = typer.Option(
        1, "--periods", min=1, help="Repeat a closed motion this many times."
    ),
    slow: float | None = typer.Option(
        None,
        "--slow",
        metavar="SHARE",
        help="Slow down until speeds, accelerations and jerks keep this share of their limits.",
    ),
    entry: bool = typer.Option(
        False, "--entry", help="Enter the motion from rest at a posture, and go back to it."
    ),
    posture: str | None = typer.Option(
        None,
        "--from",
        metavar="JOINT=VALUE,…",
        help="The posture of --entry [rad, m]; joints not named are at robot.posture.",
    ),
    thresholds: Path | None = typer.Option(
        None,
        "--thresholds",
        metavar="FILE.json",
        help="Thresholds of `score --thresholds`: adds a collision detector to c.",
    ),
    samples: int | None = typer.Option(
        None, "--samples", min=1, help="With -f randomization: robots to draw. Default: 100."
    ),
    seed: int | None = typer.Option(
        None, "--seed", min=0, help="With -f randomization: of the draw. Default: 1."
    ),
    allow_unproved: bool = typer.Option(
        False, "--allow-unproved", help="Write motions that changed since they were proved, too."
    ),
    lead: bool = typer.Option(
        False,
        "--lead",
        help="Write set points that lead the motion by what drives of measurement.command lag "
        "behind it.",
    ),
    overwrite: options.Overwrite = False,
) -> None:
    """Write motions in the formats that controllers take, or a model for simulators and in C.

    Positions, speeds and accelerations come from the motion's coefficients, so they are exact at
    any rate. The last instant is the motion's end; if the duration is not a multiple of the step,
    the last step is 0.5 to 1.5 steps long. Several motions go to files with
    their numbers in the name. With --entry the robot starts and ends at rest. Units: s, rad (m).

    A motion of a result that is not the one that was proved (its coefficients, verdict, config or
    robot changed since), or was written by an earlier version, is refused.

    A robot whose drives follow set points lags behind those of the motion. With --lead, q of the
    files are set points with which it plays the motion that was proved, as far as the URDF's
    inertias are right: q + (torque + kd v) / kp, early by the delay of measurement.command.

    A model is a fit, a diagnosis or a config of `diagnose --apply`. As C it is one file without
    dependencies or allocation, with all effects that C can hold, the standard deviation of the
    torque and a self-test. A ros2-package is a folder with this file and a plug-in of
    inverse_dynamics_solver for ros2_control, named after the folder. For domain randomization there
    are mean, covariance and samples of all numbers that simulators hold.

    Examples:
      excite export ur10.h5 --format csv --motion 1 -o motion.csv
      excite export ur10.h5 --format ros2 --entry --rate 500
      excite export ur10.h5 --format csv --motion 1 --slow 0.3 -o slow.csv
      excite export fit.h5 --format mjcf -o identified.xml
      excite export diagnosis.h5 --format c -o arm.c
      excite export diagnosis.h5 --format ros2-package -o arm_dynamics
      excite export fit.h5 --format randomization --samples 100 --seed 1
    """
    from excite_cli.api.exporting import export_answer, export_file

    found = export_file(
        file,
        format_,
        output,
        chosen=_numbers(motion),
        rate=rate,
        equidistant=equidistant,
        periods=periods,
        slow=slow,
        start=start_from(posture, entry),
        thresholds=thresholds,
        samples=samples,
        seed=seed,
        allow_unproved=allow_unproved,
        lead=lead,
        overwrite=overwrite,
        tell=terminal.tell,
    )
    terminal.show(export_answer(found), after_export(found, file))


def _numbers(motion: str) -> list[int]:
    """The motion requested; none stands for all."""
    if motion != "all" and not (motion.isdecimal() and int(motion) > 0):
        raise ConfigError(f"--motion {motion}: give the number of a motion, from 1, or all.")
    return [] if motion == "all" else [int(motion)]
