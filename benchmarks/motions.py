"""Whole motions on the shipped configs: condition number, seconds, admissibility at 1 kHz, memory.

Memory is the peak of the whole command, libraries and all, as the system counts it.

Run: python -m benchmarks.motions [--seeds 1 2 3 4] [CONFIG …]
"""

import argparse
import tempfile
import time
from pathlib import Path

from threadpoolctl import threadpool_limits

from benchmarks.problems import CONFIGS, problem
from benchmarks.program import excite
from excite_cli.excitation.run import continue_run, new_result

NAMES = ("smoke", "ur10", "panda", "talos_arms")
_LIMIT = 500  # MB, for the paper's problem, which is that of TALOS' arms


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("configs", nargs="*", default=NAMES)
    parser.add_argument("--seeds", nargs="+", type=int, default=[1, 2])
    arguments = parser.parse_args()
    print(f"{'config':18} {'seed':>5} {'stacked condition numbers':32} {'s':>7} {'violations':>11}")
    for name in arguments.configs:
        for seed in arguments.seeds:
            of = problem(name, f"seed={seed}")
            began = time.perf_counter()
            result = continue_run(
                of,
                new_result(of, [], {}),
                lambda index: lambda progress: None,
                lambda step, current: None,
            )
            seconds = time.perf_counter() - began
            numbers = "  ".join(f"{m.stacked_condition_number:.2f}" for m in result.motions)
            broken = sum(w.violations for m in result.motions for w in m.margins.values())
            print(f"{name:18} {seed:5} {numbers:32} {seconds:7.1f} {broken:11}", flush=True)
    for name in ("talos_arms", "talos_whole_body"):
        with tempfile.TemporaryDirectory() as folder:
            output = Path(folder) / "motions.h5"
            found = excite("optimize", CONFIGS / f"{name}.yaml", "-o", output).memory
        goal = f"   goal < {_LIMIT} MB" if name == "talos_arms" else ""
        print(f"{name:18} {found:7.0f} MB at most{goal}", flush=True)


if __name__ == "__main__":
    with threadpool_limits(1):
        main()
