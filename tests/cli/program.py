"""The installed program, run as a user runs it."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
SMOKE = ROOT / "configs" / "smoke.yaml"
# A few iterations only: what is tested here is the program, not how good the motions get.
BRIEF = ("--set", "optimizer.max_iterations=12")

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
        return subprocess.run(
            [*EXCITE, *map(str, arguments)],
            cwd=self.folder,
            env=environment(self.cache),
            capture_output=True,
            text=True,
            stdin=subprocess.DEVNULL,
            timeout=120,
            check=False,
        )

    def start(self, *arguments: str | Path) -> subprocess.Popen[str]:
        """As a call, without waiting for the end."""
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
        """What `--json` prints, after a good end."""
        run = self(*arguments, "--json")
        assert run.returncode == 0, run.stderr
        return json.loads(run.stdout)
