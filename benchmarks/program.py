"""Other programs, and ours as its user starts it: each a process whose time and memory are told."""

import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Timer
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
EXCITE = (sys.executable, "-P", "-c", "from excite_cli.cli.app import main; main()")
_ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")


@dataclass(frozen=True)
class Ended:
    """How a process ended: exit status (−signal), what it said, processor time [s], memory [MB]."""

    status: int
    output: str
    errors: str
    processor: float
    memory: float

    @property
    def answer(self) -> Any:
        """What `--json` answers; None where there is nothing."""
        return json.loads(self.output) if self.output.strip() else None

    @property
    def last(self) -> str:
        """The last line of its errors, or that it was ended."""
        if self.status == -signal.SIGKILL:
            return "it took too long and was ended"
        return (self.errors.strip().splitlines() or [""])[-1]


def ran(
    words: Sequence[str | Path], folder: Path | None = None, longest: float | None = None,
    **environment: str,
) -> Ended:  # fmt: skip
    """Run to its end, with one thread for its matrices; it is killed after `longest` seconds."""
    own = os.environ | _ONE_THREAD | {"PYTHONPATH": str(ROOT)} | environment
    own = {name: value for name, value in own.items() if value}  # an empty one is taken away
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        process = subprocess.Popen(
            [*map(str, words)], cwd=folder, env=own, stdin=subprocess.DEVNULL,
            stdout=out, stderr=err,
        )  # fmt: skip
        timer = Timer(longest or 1e6, process.kill)
        timer.daemon = True
        timer.start()
        _, status, used = os.wait4(process.pid, 0)
        timer.cancel()
        process.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0)
        err.seek(0)
        said = (out.read(), err.read())
    spent, memory = used.ru_utime + used.ru_stime, used.ru_maxrss * 1024 / 1e6
    return Ended(process.returncode, *said, spent, memory)


def excite(*words: str | Path, folder: Path | None = None, longest: float | None = None,
           good: Sequence[int] = (0,), **environment: str) -> Ended:  # fmt: skip
    """A command of ours.

    Raises
    ------
    RuntimeError
        Its exit status is none of the `good` ones.
    """
    found = ran([*EXCITE, *words], folder, longest, **environment)
    if found.status not in good:
        command = " ".join(map(str, words))
        raise RuntimeError(f"excite {command} ended with {found.status}\n{found.errors[-2000:]}")
    return found
