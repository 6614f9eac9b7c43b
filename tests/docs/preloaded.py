"""The program's entry point in a fresh process that has the slow imports behind it.

Half of a brief command is importing. A server process imports once and is forked for every command;
apart from that a command runs as it does when it is typed.
"""

import multiprocessing
import os
import sys
from dataclasses import dataclass
from pathlib import Path

_IMPORTED = [
    "excite_cli.cli.app",
    "excite_cli.api.checking",
    "excite_cli.api.diagnosing",
    "excite_cli.api.identifying",
    "excite_cli.api.planning",
    "excite_cli.api.simulating",
    "matplotlib.pyplot",
]


@dataclass(frozen=True)
class Done:
    """How a command ended, and what it wrote to stderr."""

    status: int
    stderr: str


class Preloaded:
    """Runs `excite`, with `environment` added to what there is."""

    def __init__(self, environment: dict[str, str], folder: Path) -> None:
        self._environment, self._folder = environment, folder
        self._context = multiprocessing.get_context("forkserver")
        self._context.set_forkserver_preload(_IMPORTED)

    def __call__(self, words: list[str], folder: Path) -> Done:
        """Run `excite` with `words` in `folder`."""
        told = self._folder / "stderr.txt"
        process = self._context.Process(
            target=_act, args=(words, str(folder), self._environment, str(told))
        )
        process.start()
        process.join(timeout=180)
        if process.is_alive():
            process.kill()
            return Done(-1, "took more than three minutes")
        return Done(process.exitcode or 0, told.read_text(encoding="utf-8"))


def _act(words: list[str], folder: str, environment: dict[str, str], told: str) -> None:
    os.environ.update(environment)
    os.chdir(folder)
    for number, name in ((0, os.devnull), (1, os.devnull), (2, told)):
        flags = os.O_RDONLY if number == 0 else os.O_WRONLY | os.O_CREAT | os.O_TRUNC
        os.dup2(os.open(name, flags), number)
    # What was imported before holds the old streams; these are as in a program just started.
    sys.stdin, sys.stdout, sys.stderr = (
        open(number, mode, encoding="utf-8", closefd=False)  # noqa: SIM115
        for number, mode in ((0, "r"), (1, "w"), (2, "w"))
    )
    sys.argv = ["excite", *words]
    from excite_cli.cli.app import main

    main()
