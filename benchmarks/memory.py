"""Peak memory of whole commands, libraries and all, as the system counts it.

Run: python -m benchmarks.memory
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.problems import CONFIGS

_LIMIT = 500  # MB
_PROBLEMS = {"the paper's problem, three motions": "talos_arms", "whole body": "talos_whole_body"}


def peak(*command: str) -> float:
    """Largest resident memory [MB] of the command.

    Raises
    ------
    RuntimeError
        The command failed.
    """
    silent = subprocess.DEVNULL
    process = subprocess.Popen(command, stdout=silent, stderr=silent)
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        raise RuntimeError(
            f"{' '.join(command)} ended with status {os.waitstatus_to_exitcode(status)}"
        )
    return usage.ru_maxrss * 1024 / 1e6


def main() -> None:
    program = str(Path(sys.executable).with_name("excite"))
    with tempfile.TemporaryDirectory() as folder:
        for words, name in _PROBLEMS.items():
            output = str(Path(folder) / f"{name}.h5")
            found = peak(program, "optimize", str(CONFIGS / f"{name}.yaml"), "-o", output)
            goal = f"   goal < {_LIMIT} MB" if name == "talos_arms" else ""
            print(f"{words:40} {found:7.0f} MB{goal}", flush=True)


if __name__ == "__main__":
    main()
