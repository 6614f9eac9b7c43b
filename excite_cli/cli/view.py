"""`excite view`: motions on the robot, in the browser or as a picture."""

import math
import sys
from pathlib import Path

import typer

from excite_cli.cli import options
from excite_cli.cli.console import Terminal
from excite_cli.cli.next_step import next_step
from excite_cli.errors import ConfigError, FileError


@options.command
def view(
    terminal: Terminal,
    file: options.MotionFile,
    motion: int | None = typer.Option(
        None, "--motion", min=1, help="Motion of a result file. Default: all; pictures: 1."
    ),
    config: Path | None = typer.Option(
        None,
        "--config",
        help="The YAML file: for motions without a result file, or a relative URDF.",
    ),
    overrides: options.Set = None,
    png: Path | None = typer.Option(
        None, "--png", metavar="OUT.png", help="Write one instant as PNG."
    ),
    gif: Path | None = typer.Option(
        None, "--gif", metavar="OUT.gif", help="Write the motion as GIF."
    ),
    time: float | None = typer.Option(
        None, "--time", min=0.0, help="Instant of the PNG [s]. Default: at the nearest distance."
    ),
    ghosts: int = typer.Option(
        0, "--ghosts", min=0, max=20, help="Further instants, drawn faintly in the PNG."
    ),
    size: str | None = typer.Option(
        None, "--size", metavar="WxH", help="Pixels. Default: 1280x960; GIF: 640x480."
    ),
    angles: str = typer.Option(
        "35,18",
        "--view",
        metavar="AZIMUTH,ELEVATION",
        help="Direction of view [°]; 0,0: along the x axis.",
    ),
    fps: float = typer.Option(
        12.0, "--fps", min=1.0, max=50.0, help="Frames per second of the GIF."
    ),
    duration: float | None = typer.Option(
        None, "--duration", min=0.2, max=120.0, help="Length of the GIF [s]. Default: ≤ 5."
    ),
    capsules: bool = typer.Option(True, "--capsules/--no-capsules", help="Show the capsules."),
    distance: bool = typer.Option(
        True, "--distance/--no-distance", help="Show the nearest distance."
    ),
    mass: bool | None = typer.Option(
        None,
        "--mass/--no-mass",
        help="Show the centre of mass. Default: if balance is constrained.",
    ),
    caption: bool = typer.Option(True, "--caption/--no-caption", help="Captions in pictures."),
    port: int = typer.Option(8080, "--port", min=1, max=65535, help="Port, or the next free one."),
    host: str = typer.Option(
        "127.0.0.1", "--host", help="Address to serve at; 0.0.0.0: for the whole network."
    ),
    browser: bool | None = typer.Option(
        None, "--open/--no-open", help="Open the browser. Default: from a terminal."
    ),
    overwrite: options.Overwrite = False,
    workers: options.Workers = 1,
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
    from excite_cli.api.showing import Answer
    from excite_cli.api.viewing import Serving, View, draw_motion, drawing_answer, view_motions
    from excite_cli.api.working import working

    target = _target(png, gif)
    azimuth, elevation = _angles(angles)
    chosen = [motion] if motion is not None else []
    if target is None:

        def ready(url: str, port: int) -> None:
            words = f"{url}   (Ctrl-C ends it)"
            terminal.show(Answer((words,), {"url": url, "port": port}))
            sys.stdout.flush()

        view_motions(
            file,
            config,
            overrides or (),
            chosen=chosen,
            serving=Serving(host, port, azimuth, elevation, capsules, distance, mass),
            browser=sys.stdout.isatty() and not terminal.as_json if browser is None else browser,
            ready=ready,
            tell=terminal.tell,
        )
        return
    pixels = _size(size or ("1280x960" if png is not None else "640x480"))
    look = View(pixels, azimuth, elevation, capsules, distance, mass, caption, ghosts)
    with working(workers, None, 1, terminal.tell) as place, terminal.live("drawing") as line:
        found = draw_motion(
            file,
            target,
            config,
            overrides or (),
            chosen=chosen,
            look=look,
            time=time,
            fps=fps,
            seconds=duration,
            overwrite=overwrite,
            progress=line,
            workers=place,
            tell=terminal.tell,
        )
    following = () if config else next_step("see margins and figures of it", "report", file)
    terminal.show(drawing_answer(found), following)


def _target(png: Path | None, gif: Path | None) -> Path | None:
    """The picture that was requested, with the suffix of its option."""
    if png is not None and gif is not None:
        raise ConfigError("--png and --gif: give one of them.")
    for option, path in (("png", png), ("gif", gif)):
        if path is not None and path.suffix.lower() != f".{option}":
            raise FileError(f"--{option} {path}: give a name that ends in .{option}.")
    return png or gif


def _size(text: str) -> tuple[int, int]:
    """`640x480` as pixels across and down."""
    parts = text.lower().replace("×", "x").split("x")
    if len(parts) == 2 and all(part.strip().isdigit() for part in parts):
        width, height = (int(part) for part in parts)
        return width, height
    raise ConfigError(f"--size {text}: give WIDTHxHEIGHT in pixels, 16 to 4096: 1280x960.")


def _angles(text: str) -> tuple[float, float]:
    """`35,18` as degrees."""
    try:
        azimuth, elevation = (float(part) for part in text.split(","))
    except ValueError:
        azimuth = elevation = math.nan
    if not (math.isfinite(azimuth) and -90 <= elevation <= 90):
        raise ConfigError(
            f"--view {text}: give AZIMUTH,ELEVATION in degrees, elevation -90 to 90: 35,18."
        )
    return azimuth, elevation
