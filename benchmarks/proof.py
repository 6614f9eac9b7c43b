"""What proof between the instants costs: motions with and without certificates, in one run.

Per config and seed the same problem is solved twice, interleaved: `optimizer.certify` true, and
false (constraints kept on 1 kHz samples only). Seconds and condition numbers as ratios, the seconds
that a certificate takes, and what it says of the motions that were kept on samples only.

Run: python -m benchmarks.proof [--seeds 1 2 3] [CONFIG …]
"""

import argparse
import time

import numpy as np
from threadpoolctl import threadpool_limits

from benchmarks.problems import problem
from excite_cli.excitation.admissible import verdicts
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.excitation.run import continue_run, new_result

CONFIGS = ("talos_arms",)


def solved(name: str, seed: int, certify: bool) -> tuple[Problem, Result, float]:
    """The problem, its motions and the seconds they took."""
    of = problem(name, f"seed={seed}", f"optimizer.certify={str(certify).lower()}",
                 "optimizer.max_seconds=1000")  # fmt: skip
    began = time.perf_counter()
    result = continue_run(
        of,
        new_result(of, [], {}),
        lambda index: lambda progress: None,
        lambda step, current: None,
    )
    return of, result, time.perf_counter() - began


def states_of(of: Problem, result: Result) -> tuple[str, float]:
    """Verdicts of all motions in words, and the seconds per motion."""
    began = time.perf_counter()
    found = [v for m in result.motions for v in verdicts(of, m.coefficients)]
    seconds = (time.perf_counter() - began) / len(result.motions)
    counts = {state: sum(v.state == state for v in found) for state in ("proved", "broken")}
    counts["sampled"] = len(found) - sum(counts.values())
    return ", ".join(f"{count} {state}" for state, count in counts.items() if count), seconds


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("configs", nargs="*", default=CONFIGS)
    parser.add_argument("--seeds", nargs="+", type=int, default=[1, 2, 3])
    arguments = parser.parse_args()
    print(f"{'config':12} {'seed':>4} {'':9} {'stacked condition numbers':28} {'s':>6}  verdicts")
    for name in arguments.configs:
        times, conditions = [], []
        for seed in arguments.seeds:
            pair = []
            for words, certify in (("sampled", False), ("proved", True)):
                of, result, seconds = solved(name, seed, certify)
                told, each = states_of(of, result)
                numbers = [m.stacked_condition_number for m in result.motions]
                pair.append((seconds, numbers[-1]))
                shown = "  ".join(f"{number:.2f}" for number in numbers)
                print(
                    f"{name:12} {seed:4} {words:9} {shown:28} {seconds:6.1f}  {told} "
                    f"({each:.2f} s each)",
                    flush=True,
                )
            times.append(pair[1][0] / pair[0][0])
            conditions.append(pair[1][1] / pair[0][1])
        print(
            f"{name}: with proof {np.mean(times):.2f} times as long, condition number "
            f"{np.mean(conditions):.3f} times as high (means over {len(times)} seeds)"
        )


if __name__ == "__main__":
    with threadpool_limits(1):
        main()
