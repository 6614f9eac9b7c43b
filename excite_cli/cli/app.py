"""The program `excite`: its commands, and the way out."""

import sys
from collections.abc import Callable

import click
import typer

from excite_cli import __version__
from excite_cli.cli.check import check
from excite_cli.cli.compare_random import compare_random
from excite_cli.cli.console import run_guarded
from excite_cli.cli.optimize import optimize
from excite_cli.cli.robots import robots
from excite_cli.cli.schema import schema
from excite_cli.cli.verify_gradient import verify_gradient
from excite_cli.errors import ConfigError, nearest

app = typer.Typer(
    name="excite",
    help="Plan robot motions that make inertial parameters visible.",
    epilog="Example:  excite optimize configs/ur10.yaml -o ur10.h5",
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
_COMMANDS: dict[str, Callable[..., None]] = {
    "optimize": optimize,
    "verify-gradient": verify_gradient,
    "compare-random": compare_random,
    "check": check,
    "robots": robots,
    "schema": schema,
}
for _name, _command in _COMMANDS.items():
    app.command(_name)(_command)


def _version(value: bool) -> None:
    if value:
        print(f"excite {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: bool = typer.Option(
        False, "--version", callback=_version, is_eager=True, help="Print the version."
    ),
) -> None:
    """Plan robot motions that make inertial parameters visible."""


def main() -> None:
    """Entry point of the console script."""
    command = typer.main.get_command(app)

    def act() -> None:
        try:
            status = command.main(standalone_mode=False)
        except click.exceptions.Abort as error:
            raise KeyboardInterrupt from error
        except click.exceptions.ClickException as error:
            known = getattr(command, "commands", {})
            text = error.format_message()
            if text.startswith("No such command"):
                wrong = text.split("'")[1]
                raise ConfigError(
                    f"there is no command '{wrong}'.{nearest(wrong, known)} "
                    f"Commands: {', '.join(known)}."
                ) from error
            error.show()
            raise SystemExit(2) from error
        if isinstance(status, int) and status:
            raise SystemExit(status)

    sys.exit(run_guarded(act))
