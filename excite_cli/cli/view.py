"""`excite view`: motions on the robot, in the browser or as a picture."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from excite_cli.cli import options
from excite_cli.cli.console import Terminal

if TYPE_CHECKING:
    from excite_cli.excitation.problem import Problem
    from excite_cli.trajectory.chain import Segment
    from excite_cli.view.pictures import View

_SECONDS = 5.0  # of a GIF, unless the motion is shorter
_LARGEST = 4096  # pixels


def view(
    file: options.MotionFile,
    motion: Annotated[
        int | None,
        typer.Option("--motion", min=1, help="Motion of a result file. Default: all; pictures: 1."),
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option(
            "--config", help="The YAML file: for motions that are no result, or a relative URDF."
        ),
    ] = None,
    overrides: options.Set = None,
    png: Annotated[
        Path | None, typer.Option("--png", metavar="OUT.png", help="Write one instant as PNG.")
    ] = None,
    gif: Annotated[
        Path | None, typer.Option("--gif", metavar="OUT.gif", help="Write the motion as GIF.")
    ] = None,
    time: Annotated[
        float | None,
        typer.Option(
            "--time", min=0.0, help="Instant of the PNG [s]. Default: where things are nearest."
        ),
    ] = None,
    ghosts: Annotated[
        int, typer.Option("--ghosts", min=0, max=20, help="Faint other instants in the PNG.")
    ] = 0,
    size: Annotated[
        str | None,
        typer.Option("--size", metavar="WxH", help="Pixels. Default: 1280x960; GIF: 640x480."),
    ] = None,
    angles: Annotated[
        str,
        typer.Option(
            "--view", metavar="AZIMUTH,ELEVATION", help="From where [°]: 0,0 is along the x axis."
        ),
    ] = "35,18",
    fps: Annotated[
        float, typer.Option("--fps", min=1.0, max=50.0, help="Frames per second of the GIF.")
    ] = 12.0,
    duration: Annotated[
        float | None,
        typer.Option("--duration", min=0.2, max=120.0, help="Length of the GIF [s]. Default: ≤ 5."),
    ] = None,
    capsules: Annotated[
        bool, typer.Option("--capsules/--no-capsules", help="Show the capsules.")
    ] = True,
    distance: Annotated[
        bool, typer.Option("--distance/--no-distance", help="Show the nearest distance.")
    ] = True,
    mass: Annotated[
        bool | None,
        typer.Option(
            "--mass/--no-mass", help="Show the centre of mass. Default: if balance is asked for."
        ),
    ] = None,
    caption: Annotated[
        bool, typer.Option("--caption/--no-caption", help="Words in pictures.")
    ] = True,
    port: Annotated[
        int, typer.Option("--port", min=1, max=65535, help="Port, or the next free one.")
    ] = 8080,
    host: Annotated[
        str, typer.Option("--host", help="Address to serve at; 0.0.0.0: for the whole network.")
    ] = "127.0.0.1",
    browser: Annotated[
        bool | None,
        typer.Option("--open/--no-open", help="Open the browser. Default: from a terminal."),
    ] = None,
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
    no_progress: options.NoProgress = False,
) -> None:
    """Play motions on the robot in the browser, or draw them without a display (--png, --gif).

    Shows the URDF's meshes, the capsules, the nearest pair with its distance, the centre of mass
    over its region, payload and surroundings; beside them the margins of all constraints and the
    joint positions at every instant. Takes result files, and with --config any motion that `excite
    check` takes. Ctrl-C ends it.

    Example:  excite view ur10.h5

    Example:  excite view ur10.h5 --png ur10.png --ghosts 4

    Example:  excite view ur10.h5 --motion 2 --gif ur10.gif --duration 6
    """
    from excite_cli.cli.setup import single_threaded
    from excite_cli.errors import ConfigError, FileError

    terminal = Terminal(as_json, quiet, verbose, not no_progress)
    if png is not None and gif is not None:
        raise ConfigError("--png and --gif: give one of them.")
    azimuth, elevation = _angles(angles)
    with single_threaded():
        if png is None and gif is None:
            from excite_cli.view.browser import Serving

            problem, segments = _motions(terminal, file, motion, config, overrides)
            serving = Serving(host, port, azimuth, elevation, capsules, distance, mass)
            _serve(terminal, problem, segments, serving, browser)
            return
        from excite_cli.view.pictures import View

        pixels = _size(size or ("1280x960" if png is not None else "640x480"))
        look = View(
            pixels, azimuth, elevation, capsules, distance, mass, caption, ghosts if png else 0
        )
        target = png or gif
        assert target is not None
        if not file.is_file():
            raise FileError(f"There is no file {file}.")
        _check_target(target, ".png" if png is not None else ".gif", overwrite)
        problem, segments = _motions(terminal, file, motion, config, overrides)
        segment = segments[0]
        if time is not None and time > segment.trajectory.duration:
            raise ConfigError(
                f"--time {time:g}: {segment.name} ends at {segment.trajectory.duration:g} s."
            )
        data = _draw(terminal, problem, segment, look, target, time, fps, duration)
    terminal.answer(str(target), data)


def _draw(
    terminal: Terminal,
    problem: "Problem",
    segment: "Segment",
    look: "View",
    target: Path,
    time: float | None,
    fps: float,
    duration: float | None,
) -> dict[str, Any]:
    from excite_cli.atomic import write_atomically
    from excite_cli.view.pictures import frame_count, motion_gif, still_png

    if target.suffix.lower() == ".png":
        with terminal.live("drawing"):
            content = still_png(problem, segment, look, time, terminal.say)
        more: dict[str, Any] = {}
    else:
        seconds = duration or min(_SECONDS, segment.trajectory.duration)
        with terminal.live("drawing", frame_count(fps, seconds)) as show:
            content = motion_gif(problem, segment, look, fps, seconds, show, terminal.say)
        more = {"frames": frame_count(fps, seconds), "seconds": seconds}

    def write(path: Path) -> None:
        path.write_bytes(content)

    write_atomically(target, write)
    return {"picture": str(target), "motion": segment.name, "bytes": len(content), **more}


def _serve(
    terminal: Terminal,
    problem: "Problem",
    segments: "list[Segment]",
    serving: Any,
    browser: bool | None,
) -> None:
    """Until Ctrl-C, which is the way to end it and no error."""
    import sys
    import webbrowser

    from excite_cli.view.browser import play_in_browser

    opens = browser if browser is not None else sys.stdout.isatty() and not terminal.as_json

    def ready(url: str, port: int) -> None:
        if port != serving.port:
            terminal.say(f"Port {serving.port} is taken; {port} is the next free one.")
        terminal.answer(f"{url}   (Ctrl-C ends it)", {"url": url, "port": port})
        sys.stdout.flush()
        if opens:
            webbrowser.open(url)

    try:
        play_in_browser(problem, segments, serving, ready, say=terminal.say)
    except KeyboardInterrupt:
        terminal.say("Ended.")


def _motions(
    terminal: Terminal,
    file: Path,
    motion: int | None,
    config: Path | None,
    overrides: list[str] | None,
) -> "tuple[Problem, list[Segment]]":
    """The problem and the motions to be shown.

    Raises
    ------
    FileError
        The file is missing, or is no result and no config says what moves.
    """
    from excite_cli.api.motions import load_motions, motions_of
    from excite_cli.cli.rebuilt import rebuilt_problem
    from excite_cli.cli.setup import load_problem
    from excite_cli.errors import ConfigError, FileError
    from excite_cli.store.result_file import is_result, read_result

    if not file.exists():
        raise FileError(f"There is no file {file}.")
    chosen = [motion] if motion is not None else []
    if is_result(file):
        if overrides:
            raise ConfigError("--set: a result file has its own config; leave it out.")
        result = read_result(file)
        return rebuilt_problem(file, result, config), motions_of(result, chosen, str(file))
    if config is None:
        raise FileError(
            f"{file} is no result file, so the robot is not known: give --config CONFIG.yaml."
        )
    problem = load_problem(terminal, config, overrides)
    return problem, load_motions(problem, file, chosen, terminal.tell)


def _check_target(target: Path, suffix: str, overwrite: bool) -> None:
    from excite_cli.api.outputs import claim_file
    from excite_cli.errors import FileError

    if target.suffix.lower() != suffix:
        raise FileError(f"--{suffix[1:]} {target}: give a name that ends in {suffix}.")
    claim_file(target)
    if target.exists() and not overwrite:
        raise FileError(f"{target} exists already. Give another name, or --overwrite.")


def _size(text: str) -> tuple[int, int]:
    """`640x480` as pixels across and down."""
    from excite_cli.errors import ConfigError

    parts = text.lower().replace("×", "x").split("x")
    if len(parts) == 2 and all(part.strip().isdigit() for part in parts):
        width, height = (int(part) for part in parts)
        if min(width, height) >= 16 and max(width, height) <= _LARGEST:
            return width, height
    raise ConfigError(f"--size {text}: give WIDTHxHEIGHT in pixels, 16 to {_LARGEST}: 1280x960.")


def _angles(text: str) -> tuple[float, float]:
    """`35,18` as degrees."""
    import math

    from excite_cli.errors import ConfigError

    try:
        azimuth, elevation = (float(part) for part in text.split(","))
    except ValueError:
        azimuth = elevation = math.nan
    if not (math.isfinite(azimuth) and -90 <= elevation <= 90):
        raise ConfigError(
            f"--view {text}: give AZIMUTH,ELEVATION in degrees, elevation -90 to 90: 35,18."
        )
    return azimuth, elevation
