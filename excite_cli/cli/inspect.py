"""`excite inspect`: log and model, before any physics."""

from pathlib import Path
from typing import Annotated

import typer

from excite_cli.cli import options
from excite_cli.cli.console import Terminal
from excite_cli.cli.help_page import OUTPUT


def inspect(
    config: options.Config,
    data: Annotated[
        list[Path] | None,
        typer.Argument(help="Measured data: HDF5, CSV, MATLAB, parquet, bags.", show_default=False),
    ] = None,
    apply: Annotated[
        Path | None,
        typer.Option(
            "--apply",
            metavar="NEW.yaml",
            help="Write the config with the keys that resolve faults and doubts, comments kept.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="PAGE.html",
            help="A page with all checks and their evidence.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    power: Annotated[
        bool,
        typer.Option("--power", help="Also the sizes of effects that a diagnosis would name."),
    ] = False,
    overrides: options.Set = None,
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
    no_progress: options.NoProgress = False,
) -> None:
    """Check log and model for set-up errors: mount, zeros, signs, order, units, clock, bodies.

    One row per check: ok, doubt or fault, the joints, the evidence, and the key of the config that
    resolves it. Set-up errors are judged by fits of the textbook's model: a set-up with which it
    explains far more of the torque is taken as right. Without data, only the robot's description
    is checked.

    Exit status 1: at least one fault was found.

    Examples:
      excite inspect ur10.yaml measured.h5 --apply corrected.yaml
      excite inspect ur10.yaml measured.h5 --power
    """
    from excite_cli.api.inspecting import inspect as inspect_data
    from excite_cli.api.inspecting import inspection_answer
    from excite_cli.api.loading import load_case
    from excite_cli.api.working import single_threaded
    from excite_cli.errors import ConfigError

    terminal = Terminal(as_json, quiet, verbose, not no_progress)
    files = data or []
    if power and not files:
        raise ConfigError("--power is of measured data: give their files.")
    with single_threaded():
        found = inspect_data(
            load_case(config, overrides or ()),
            files,
            apply=apply,
            output=output,
            power=power,
            overwrite=overwrite,
            tell=terminal.tell,
        )
    written = None if apply is None else str(apply)
    page = None if output is None else str(output)
    terminal.show(inspection_answer(found, str(config), tuple(map(str, files)), written, page))
