"""The program `excite`: its commands, and the way out."""

import inspect
import sys
from collections.abc import Callable

import typer

from excite_cli import __version__
from excite_cli.cli.check import check
from excite_cli.cli.compare_random import compare_random
from excite_cli.cli.console import INTERRUPTED, run_guarded
from excite_cli.cli.diagnose import diagnose
from excite_cli.cli.export import export
from excite_cli.cli.identify import identify
from excite_cli.cli.optimize import optimize
from excite_cli.cli.report import report
from excite_cli.cli.robots import robots
from excite_cli.cli.schema import schema
from excite_cli.cli.simulate import simulate
from excite_cli.cli.verify_gradient import verify_gradient
from excite_cli.errors import ConfigError, nearest

app = typer.Typer(
    name="excite",
    help="Plan robot motions that make inertial parameters visible, and trace what a robot's model "
    "lacks from what was measured.",
    epilog="Example:  excite optimize configs/ur10.yaml -o ur10.h5",
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _unwrapped(docstring: str) -> str:
    """Paragraphs on one line each: the terminal wraps them to its own width."""
    paragraphs = inspect.cleandoc(docstring).split("\n\n")
    return "\n\n".join(" ".join(paragraph.split("\n")) for paragraph in paragraphs)


_COMMANDS: dict[str, Callable[..., None]] = {
    "optimize": optimize,
    "verify-gradient": verify_gradient,
    "compare-random": compare_random,
    "check": check,
    "identify": identify,
    "simulate": simulate,
    "diagnose": diagnose,
    "export": export,
    "report": report,
    "robots": robots,
    "schema": schema,
}
for _name, _command in _COMMANDS.items():
    app.command(_name, help=_unwrapped(_command.__doc__ or ""))(_command)


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
    """Plan exciting robot motions; trace what the model lacks from measured data."""


# Typer brings its own copy of click in some versions: take the base from one of its errors.
_USAGE_ERROR: type[Exception] = next(
    c for c in typer.BadParameter.__mro__ if c.__name__ == "ClickException"
)


def _mistyped(error: Exception, words: list[str]) -> ConfigError | None:
    """A helpful error when the first word is no command, else None."""
    word = next((word for word in words if not word.startswith("-")), None)
    if word is None or word in _COMMANDS or "ommand" not in str(error):
        return None
    return ConfigError(
        f"there is no command '{word}'.{nearest(word, _COMMANDS)} Commands: {', '.join(_COMMANDS)}."
    )


def main() -> None:
    """Entry point of the console script."""
    command = typer.main.get_command(app)

    def act() -> None:
        try:
            status = command.main(standalone_mode=False)
        except typer.Abort as error:
            raise KeyboardInterrupt from error
        except _USAGE_ERROR as error:
            better = _mistyped(error, sys.argv[1:])
            if better is not None:
                raise better from error
            show = getattr(error, "show", None)
            if show is not None:
                show()
            raise SystemExit(2) from error
        if status == INTERRUPTED:  # typer turns Ctrl-C into this status
            raise KeyboardInterrupt
        if isinstance(status, int) and status:
            raise SystemExit(status)

    sys.exit(run_guarded(act))
