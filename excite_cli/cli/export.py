"""`excite export`: motions for controllers, identified models for simulators."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from excite_cli.api.outputs import check_outputs
from excite_cli.cli import options
from excite_cli.cli.completion import complete_format
from excite_cli.cli.console import Terminal
from excite_cli.cli.help_page import OUTPUT
from excite_cli.errors import ConfigError, FileError, nearest

if TYPE_CHECKING:
    from excite_cli.export.motion_exporter import MotionExporter

_MODELS = {"urdf": ".urdf", "mjcf": ".xml", "yaml": ".yaml"}


def export(
    file: Annotated[
        Path,
        typer.Argument(help="A result file, a fit, or a motion (CSV, …).", show_default=False),
    ],
    format_: Annotated[
        str,
        typer.Option(
            "--format",
            "-f",
            metavar="FORMAT",
            help="csv, ros2, rosbag2, mcap, moveit, npz of motions; urdf, mjcf, yaml of a fit.",
            autocompletion=complete_format,
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="File, or folder of a bag. Default: named after FILE.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    motion: Annotated[
        str, typer.Option("--motion", metavar="I|all", help="Which motion of a result file.")
    ] = "all",
    rate: Annotated[float, typer.Option("--rate", help="Instants per second [Hz].")] = 1000.0,
    equidistant: Annotated[
        bool,
        typer.Option("--equidistant", help="Stretch the step so that all are equal up to the end."),
    ] = False,
    periods: Annotated[
        int, typer.Option("--periods", min=1, help="Play a motion that closes this many times.")
    ] = 1,
    slow: Annotated[
        float | None,
        typer.Option(
            "--slow",
            metavar="SHARE",
            help="Slow down until speeds and accelerations keep this share of their limits.",
        ),
    ] = None,
    entry: Annotated[
        bool,
        typer.Option("--entry", help="Enter the motion from rest at a posture, and go back to it."),
    ] = False,
    posture: Annotated[
        str | None,
        typer.Option(
            "--from",
            metavar="JOINT=VALUE,…",
            help="The posture of --entry [rad, m]; joints not named are at robot.posture.",
        ),
    ] = None,
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
    no_progress: options.NoProgress = False,
) -> None:
    """Write motions in the formats that controllers take, or a fit as a robot model.

    Positions, speeds and accelerations come from the motion's coefficients, so they are exact at
    any rate. The last instant is the motion's end; where the duration is no whole number of steps,
    the last step is between half and one and a half of the others. Several motions go to files with
    their numbers in the name. With --entry the robot starts and ends at rest. Units: s, rad (m).

    Examples:
      excite export ur10.h5 --format csv --motion 1 -o motion.csv
      excite export ur10.h5 --format ros2 --entry --rate 500
      excite export ur10.h5 --format csv --motion 1 --slow 0.3 -o slow.csv
      excite export fit.h5 --format mjcf -o identified.xml
    """
    from excite_cli.cli.entry_program import durations_of
    from excite_cli.cli.exported_chains import Wanted, chains_of
    from excite_cli.cli.setup import single_threaded
    from excite_cli.export.motions import MOTION_EXPORTERS
    from excite_cli.export.timed import timed_motion
    from excite_cli.store.fit_file import is_fit

    terminal = Terminal(as_json, quiet, verbose, not no_progress)
    formats = [*MOTION_EXPORTERS, *_MODELS]
    if format_ not in formats:
        raise ConfigError(
            f"--format {format_}: unknown.{nearest(format_, formats)} Known: {', '.join(formats)}."
        )
    if not 0.0 < rate <= 1e6:
        raise ConfigError(f"--rate {rate:g}: give instants per second, above 0 and up to 1e6 Hz.")
    if not file.exists():
        raise FileError(f"There is no file {file}.")
    if is_fit(file) != (format_ in _MODELS):
        what, own = ("a fit", _MODELS) if is_fit(file) else ("no fit", MOTION_EXPORTERS)
        raise FileError(
            f"{file} is {what}: it cannot be exported as {format_}. Its formats: {', '.join(own)}."
        )
    if format_ in _MODELS:
        _export_model(terminal, file, format_, output, overwrite)
        return
    exporter = MOTION_EXPORTERS[format_]
    with single_threaded():
        chains = chains_of(terminal, file, Wanted(motion, periods, slow, entry, posture))
    paths = _paths(file, output, exporter, [each.name for each in chains])
    _check_paths(paths, exporter, overwrite)
    written = []
    for path, each in zip(paths, chains, strict=True):
        timed = timed_motion(
            each.name, each.joint_names, each.chain, rate, equidistant, exporter.whole_nanoseconds
        )
        exporter.write(path, timed)
        written.append(
            {
                "motion": each.name,
                "output": str(path),
                "instants": len(timed.t),
                "duration": timed.duration,
                "durations": durations_of(each.chain),
                "pace": each.pace,
            }
        )
    if slow is not None:
        terminal.say(
            "a slowed motion needs other torques: judge what was written, `excite check CONFIG "
            f"{paths[0]}`, before it is played"
        )
    lines = [
        f"{path}: {each.name}, {record['instants']} instants, {record['duration']:.6g} s"
        + (f", at {100 * each.pace:.4g} % of its pace" if slow is not None else "")
        for path, each, record in zip(paths, chains, written, strict=True)
    ]
    terminal.answer(lines, {"format": format_, "rate": rate, "motions": written})


def _paths(
    file: Path,
    output: Path | None,
    exporter: "MotionExporter",
    names: list[str],
) -> list[Path]:
    """Where each motion goes; several get their numbers before the suffix."""
    base = output or Path(f"{file.stem}_{names[0]}{exporter.suffix}")
    if output is None and len(names) > 1:
        base = Path(f"{file.stem}_motion{exporter.suffix}")
    if len(names) == 1:
        return [base]
    numbers = (name.removeprefix("motion_") for name in names)
    return [base.with_name(f"{base.stem}_{number}{base.suffix}") for number in numbers]


def _check_paths(paths: list[Path], exporter: "MotionExporter", overwrite: bool) -> None:
    if not exporter.folder:
        check_outputs({f"output ({path})": path for path in paths}, overwrite)
        return
    from excite_cli.claim import claim
    from excite_cli.export.motion_rosbag2 import is_bag

    for path in paths:
        claim(path)
        if path.exists() and not (overwrite and is_bag(path)):
            replace = ", or replace it with --overwrite" if is_bag(path) else ""
            raise FileError(f"{path} exists already. Give another name{replace}.")


def _export_model(
    terminal: Terminal, file: Path, format_: str, output: Path | None, overwrite: bool
) -> None:
    """A fit as URDF, MJCF or YAML, as `excite identify` writes them."""
    from excite_cli.cli.models import write_models
    from excite_cli.config.load import parse_spec
    from excite_cli.robot.model import build_robot
    from excite_cli.store.fit_file import read_fit

    path = output or Path(f"{file.stem}{_MODELS[format_]}")
    check_outputs({"output": path}, overwrite)
    stored = read_fit(file)
    spec = parse_spec(stored.config, f"the config stored in {file}")
    robot = build_robot(spec.robot, Path(stored.config_folder))
    if robot.fingerprint() != stored.fingerprint:
        raise FileError(
            f"{file} was made with another robot than the URDF gives now ({spec.robot.urdf}). "
            "Identify again."
        )
    option = "parameters" if format_ == "yaml" else format_
    for note in write_models(robot, stored.fit, **{option: path}):
        terminal.say(f"note: {note}")
    terminal.answer([str(path)], {"format": format_, "output": str(path)})
