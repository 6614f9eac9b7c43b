"""`excite inspect`: log and model, before any physics."""

from pathlib import Path

import typer

from excite_cli.cli import options
from excite_cli.cli.console import Terminal


@options.command
def inspect(
    terminal: Terminal,
    config: options.Config,
    data: list[Path] | None = typer.Argument(
        None, help="Measured data: HDF5, CSV, MATLAB, parquet, bags.", show_default=False
    ),
    apply: Path | None = options.written(
        "--apply",
        metavar="NEW.yaml",
        help="Write the config with the keys that resolve faults and doubts, comments kept.",
    ),
    output: Path | None = options.written(
        "-o", "--output", metavar="PAGE.html", help="A page with all checks and their evidence."
    ),
    power: bool = typer.Option(
        False, "--power", help="Also the sizes of effects that a diagnosis would name."
    ),
    overrides: options.Set = None,
    overwrite: options.Overwrite = False,
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
    from excite_cli.errors import ConfigError

    files = data or []
    if power and not files:
        raise ConfigError("--power is of measured data: give their files.")
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
