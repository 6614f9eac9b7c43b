"""Options that several commands share, written once."""

import functools
import inspect
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from excite_cli.cli.completion import complete_key
from excite_cli.cli.console import Terminal
from excite_cli.cli.help_page import MESSAGES, OUTPUT, WORK
from excite_cli.errors import ConfigError

# The recording of a simulated robot, and the posture of --from.

_recorded = partial(typer.Option, rich_help_panel="Recording")
TorqueNoise = Annotated[
    float, _recorded("--torque-noise", help="Torque noise as a share of the joint's RMS torque.")
]
NoiseCorrelation = Annotated[
    float,
    _recorded("--noise-correlation", help="Correlation of the noise from sample to sample."),
]
Encoder = Annotated[float, _recorded("--encoder", help="Resolution of the encoders, in rad (m).")]
InertiaError = Annotated[
    float,
    typer.Option(
        "--inertia-error",
        help="Deviation of the robot's inertias from the URDF; 0: none.",
        rich_help_panel="Simulated robot",
    ),
]


def start_from(text: str | None, entry: bool) -> dict[str, float] | None:
    """Positions by joint of `joint=value,joint=value`; None without --entry.

    Raises
    ------
    ConfigError
        The text cannot be read, or is given without --entry.
    """
    if text is not None and not entry:
        raise ConfigError("--from says where --entry starts: give both.")
    given: dict[str, float] = {}
    for part in () if text is None else (piece.strip() for piece in text.split(",")):
        name, equals, value = part.partition("=")
        try:
            number = float(value)
        except ValueError:
            equals = ""
        if not equals:
            raise ConfigError(f"--from: '{part}' is not joint=value [rad or m].")
        if name.strip() in given:
            raise ConfigError(f"--from: {name.strip()} is given twice.")
        given[name.strip()] = number
    return given if entry else None


Config = Annotated[Path, typer.Argument(help="The problem, a YAML file.", show_default=False)]
Data = Annotated[
    list[Path],
    typer.Argument(help="Measured data: {readers}.", show_default=False),
]
MaybeData = Annotated[
    list[Path] | None,
    typer.Argument(help="Measured data: {readers}.", show_default=False),
]
HeldOut = Annotated[
    str | None,
    typer.Option("--held-out", metavar="RUN", help="Run kept out of the fit. Default: the last."),
]
OwnHeldOut = Annotated[
    bool,
    typer.Option("--held-out", help="Of the model's own data, use only the held-out part."),
]
Link = Annotated[
    str | None,
    typer.Option("--link", help="Link that carries the payload. Default: the last one."),
]
Motions = Annotated[int | None, typer.Option("--motions", min=1, help="Override sequence.motions.")]
MotionFile = Annotated[
    Path,
    typer.Argument(help="A result file, or a motion: {motion_formats}.", show_default=False),
]
Output = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        help="Result file. Default: <config name>.h5 here.",
        rich_help_panel=OUTPUT,
    ),
]
Set = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY.PATH=VALUE",
        help="Override a value of the config (may be repeated).",
        autocompletion=complete_key,
    ),
]
Seed = Annotated[int | None, typer.Option("--seed", min=0, help="Override the config's seed.")]
Overwrite = Annotated[
    bool, typer.Option("--overwrite", help="Replace existing files.", rich_help_panel=OUTPUT)
]
Threads = Annotated[
    int, typer.Option("--threads", min=1, help="Threads of the linear algebra library.")
]
Workers = Annotated[
    int,
    typer.Option(
        "--workers",
        min=1,
        metavar="N",
        help="Processes on this machine that share the work.",
        rich_help_panel=WORK,
    ),
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        "--scheduler",
        metavar="ADDRESS",
        help="Share the work on the dask cluster of this scheduler, as tcp://host:8786.",
        rich_help_panel=WORK,
    ),
]


def changes(
    overrides: list[str] | None,
    *,
    seed: int | None = None,
    motions: int | None = None,
    restarts: int | None = None,
    iterations: int | None = None,
) -> list[str]:
    """What changes the config: --set, then the options that have names of their own."""
    named = {
        "sequence.motions": motions,
        "seed": seed,
        "optimizer.restarts": restarts,
        "optimizer.max_iterations": iterations,
    }
    given = [f"{key}={value}" for key, value in named.items() if value is not None]
    return [*(overrides or []), *given]


StoredModel = Annotated[
    Path,
    typer.Argument(
        metavar="MODEL",
        help="A fit, a diagnosis, or a config that `diagnose --apply` wrote.",
        show_default=False,
    ),
]


def written(*names: str, **settings: Any) -> Any:
    """An option that names a file to write."""
    return typer.Option(None, *names, rich_help_panel=OUTPUT, **settings)


_MESSAGES = {
    "as_json": (["--json"], "Print the answer as JSON, errors too."),
    "quiet": (["--quiet", "-q"], "Only the answer, and errors."),
    "verbose": (["--verbose", "-v"], "More detail."),
    "no_progress": (["--no-progress"], "No progress line."),
}


def with_messages(run: Callable[..., None]) -> Callable[..., None]:
    """A command with the options of its messages in place of its first parameter, a `Terminal`."""

    @functools.wraps(run)
    def talking(
        *, as_json: bool, quiet: bool, verbose: bool, no_progress: bool, **given: Any
    ) -> None:
        run(Terminal(as_json, quiet, verbose, not no_progress), **given)

    _, *own = inspect.signature(run).parameters.values()
    shared = [
        inspect.Parameter(
            name,
            inspect.Parameter.POSITIONAL_OR_KEYWORD,
            default=typer.Option(False, *names, help=words, rich_help_panel=MESSAGES),
            annotation=bool,
        )
        for name, (names, words) in _MESSAGES.items()
    ]
    talking.__signature__ = inspect.Signature([*own, *shared])  # type: ignore[attr-defined]
    talking.__annotations__ = {each.name: each.annotation for each in [*own, *shared]}
    return talking


def command(run: Callable[..., None]) -> Callable[..., None]:
    """A command `with_messages` that calculates: in as many threads as `threads` says, else one."""

    @functools.wraps(run)
    def limited(terminal: Terminal, **given: Any) -> None:
        with terminal.waiting(run.__name__.replace("_", "-")):
            from excite_cli.api.working import single_threaded

            with single_threaded(given.get("threads", 1)):
                run(terminal, **given)

    return with_messages(limited)
