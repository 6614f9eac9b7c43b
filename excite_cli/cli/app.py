"""The program `excite`: its commands, and the way out."""

import sys
from collections.abc import Callable
from typing import Any

import typer

from excite_cli import __version__
from excite_cli.cli.campaign import campaign
from excite_cli.cli.check import check
from excite_cli.cli.compare import compare
from excite_cli.cli.compare_random import compare_random
from excite_cli.cli.console import told_warnings
from excite_cli.cli.diagnose import diagnose
from excite_cli.cli.exit_status import INTERRUPTED, run_guarded
from excite_cli.cli.export import export
from excite_cli.cli.help_page import HelpfulCommand, HelpfulGroup, split_docstring
from excite_cli.cli.identify import identify
from excite_cli.cli.init import init
from excite_cli.cli.inspect import inspect
from excite_cli.cli.optimize import optimize
from excite_cli.cli.replay import replay
from excite_cli.cli.report import report
from excite_cli.cli.robots import robots
from excite_cli.cli.schema import schema
from excite_cli.cli.score import score
from excite_cli.cli.selftest import selftest
from excite_cli.cli.simulate import simulate
from excite_cli.cli.stopping import heed_signals
from excite_cli.cli.streams import steady_streams
from excite_cli.cli.study import study
from excite_cli.cli.usage_errors import USAGE_ERROR, in_our_words
from excite_cli.cli.verify_gradient import verify_gradient
from excite_cli.cli.view import view

_RENAMED = {"sealed": "held-out"}  # options of version 0.2, which scripts may still give


app = typer.Typer(
    name="excite",
    cls=HelpfulGroup,
    help="Plan robot motions that excite the inertial parameters, and find from measured data what "
    "a robot's model lacks. `excite COMMAND --help` has examples of each command.",
    epilog="excite init --robot ur10 -o ur10.yaml\nexcite optimize ur10.yaml -o ur10.h5",
    no_args_is_help=True,
    add_completion=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={
        "help_option_names": ["-h", "--help"],
        "max_content_width": 100,
        "token_normalize_func": lambda word: _RENAMED.get(word, word),
    },
)

_COMMANDS: dict[str, Callable[..., None]] = {
    "optimize": optimize,
    "verify-gradient": verify_gradient,
    "compare-random": compare_random,
    "check": check,
    "inspect": inspect,
    "identify": identify,
    "simulate": simulate,
    "selftest": selftest,
    "diagnose": diagnose,
    "score": score,
    "compare": compare,
    "replay": replay,
    "study": study,
    "campaign": campaign,
    "export": export,
    "report": report,
    "view": view,
    "robots": robots,
    "init": init,
    "schema": schema,
}
_GROUPS = {
    "Get started": ("robots", "init", "schema"),
    "Plan motions": ("optimize", "check", "compare-random", "verify-gradient"),
    "Inspect and export": ("report", "view", "export"),
    "From measured data": (
        "simulate",
        "inspect",
        "identify",
        "diagnose",
        "score",
        "compare",
        "replay",
    ),
    "The whole loop": ("campaign",),
    "Many cases": ("study", "selftest"),
}
_ORDER = [name for names in _GROUPS.values() for name in names]
_ORDER += [name for name in _COMMANDS if name not in _ORDER]
for _name in _ORDER:
    if _name in _COMMANDS:
        _words, _examples = split_docstring(_COMMANDS[_name].__doc__ or "")
        app.command(
            _name,
            cls=HelpfulCommand,
            help=_words,
            epilog=_examples,
            rich_help_panel=next((g for g, names in _GROUPS.items() if _name in names), None),
        )(_COMMANDS[_name])


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


def main() -> None:
    """Entry point of the console script."""
    command: Any = typer.main.get_command(app)

    def act() -> None:
        try:
            status = command.main(prog_name="excite", standalone_mode=False)
        except typer.Abort as error:
            raise KeyboardInterrupt from error
        except USAGE_ERROR as error:
            told = in_our_words(error, sys.argv[1:], command.commands)
            if told is not None:
                raise told from error
            typer.echo(str(error), err=True)  # no words at all: the page of help
            raise SystemExit(2) from error
        if status == INTERRUPTED:  # typer turns Ctrl-C into this status
            raise KeyboardInterrupt
        if isinstance(status, int) and status:
            raise SystemExit(status)

    heed_signals()
    with steady_streams(), told_warnings():
        sys.exit(run_guarded(act))
