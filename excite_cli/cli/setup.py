"""From command-line arguments to a problem."""

from pathlib import Path

from excite_cli.api import loading
from excite_cli.api.threads import single_threaded as single_threaded
from excite_cli.cli.console import Terminal
from excite_cli.excitation.problem import Problem


def load_problem(terminal: Terminal, config: Path, overrides: list[str] | None) -> Problem:
    """Load, override, build; tell what was understood."""
    return loading.load_problem(config, overrides or (), terminal.tell)
