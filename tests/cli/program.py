"""The program as a user runs it: its command line, in this process or installed in one of its own.

Most tests look at what a command says and writes; starting Python and importing everything anew
would take most of their time. `Program` calls the entry point of the console script instead, as
`this_process.call` says; `Installed` starts the installed script.
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from tests.cli.this_process import call

ROOT = Path(__file__).resolve().parents[2]
SMOKE = ROOT / "configs" / "smoke.yaml"
# A few iterations only: what is tested here is the program, not how good the motions get.
BRIEF = ("--set", "optimizer.max_iterations=12")
_PATIENCE = 300.0  # s; for what hangs, on a busy machine too

_found = shutil.which("excite", path=f"{Path(sys.executable).parent}{os.pathsep}{os.defpath}")
EXCITE = (
    [_found] if _found else [sys.executable, "-c", "from excite_cli.cli.app import main; main()"]
)


def environment(cache: Path) -> dict[str, str]:
    """One thread, a plain and wide terminal, and a cache of its own."""
    plain = {"OPENBLAS_NUM_THREADS": "1", "COLUMNS": "140", "NO_COLOR": "1", "TERM": "dumb"}
    return {**os.environ, **plain, "XDG_CACHE_HOME": str(cache)}


class Program:
    """Runs `excite` in `folder`; robots are fitted once for all, in `cache`."""

    def __init__(self, folder: Path, cache: Path) -> None:
        self.folder, self.cache = folder, cache

    def __call__(self, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
        return call([*map(str, arguments)], self.folder, environment(self.cache), _PATIENCE)

    def start(self, *arguments: str | Path) -> subprocess.Popen[str]:
        """As a call, but in a process of its own and without waiting for its end."""
        return subprocess.Popen(
            [*EXCITE, *map(str, arguments)],
            cwd=self.folder,
            env=environment(self.cache),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            stdin=subprocess.DEVNULL,
            text=True,
        )

    def answer(self, *arguments: str | Path) -> Any:
        """What `--json` prints, after a run that succeeded."""
        return json.loads(self.good(*arguments, "--json").stdout)

    def good(self, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
        """A run that must succeed."""
        run = self(*arguments)
        assert run.returncode == 0, run.stderr
        return run

    def refused(self, *arguments: str | Path, status: int = 2) -> str:
        """The one message of a run that must fail, as one line; nothing else may be answered."""
        run = self(*arguments)
        assert run.returncode == status, run.stdout + run.stderr
        assert run.stdout == ""
        assert not run.stderr.startswith("Usage:")
        assert "Traceback" not in run.stderr
        assert "\x1b" not in run.stderr
        assert sum(line.startswith("error: ") for line in run.stderr.splitlines()) == 1, run.stderr
        return " ".join(run.stderr.split())


class Installed(Program):
    """The same, with the installed script in a process of its own for every call."""

    def __call__(self, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [*EXCITE, *map(str, arguments)],
            cwd=self.folder,
            env=environment(self.cache),
            capture_output=True,
            text=True,
            stdin=subprocess.DEVNULL,
            timeout=_PATIENCE,
            check=False,
        )
