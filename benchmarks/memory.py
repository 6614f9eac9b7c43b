"""Peak memory of whole commands, libraries and all, as the system counts it.

Run: python -m benchmarks.memory
"""

import tempfile
from pathlib import Path

from benchmarks.problems import CONFIGS
from benchmarks.program import excite

_LIMIT = 500  # MB
_PROBLEMS = {"the paper's problem, three motions": "talos_arms", "whole body": "talos_whole_body"}


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        for words, name in _PROBLEMS.items():
            output = Path(folder) / f"{name}.h5"
            found = excite("optimize", CONFIGS / f"{name}.yaml", "-o", output).memory
            goal = f"   goal < {_LIMIT} MB" if name == "talos_arms" else ""
            print(f"{words:40} {found:7.0f} MB{goal}", flush=True)


if __name__ == "__main__":
    main()
