"""Figures that do not depend on base parameters, for every shipped config.

    python -m benchmarks.efficiency [CONFIG …] [--seed 1]

The first motion by the condition number and by the deviation of predicted torques: that deviation
in units of the noise of one sample, the efficiency beside freely chosen states (from its lower
bound on), and the condition number with our columns.
"""

import argparse

import numpy as np
from threadpoolctl import threadpool_limits

from benchmarks.problems import problem
from excite_cli.excitation.free_design import FreeDesign
from excite_cli.excitation.invariant import design_for, invariants
from excite_cli.excitation.run import continue_run, new_result

CONFIGS = ("smoke", "ur10", "ur10_cell", "panda", "talos_arms", "talos_whole_body",
           "talos_standing")  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("configs", nargs="*", default=CONFIGS)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    print("| config | criterion | torque to | efficiency | condition number |")
    print("|---|---|---|---|---|")
    for name in given.configs:
        design: FreeDesign | None = None
        for kind in ("condition_number", "torque_deviation"):
            of = problem(name, f"seed={given.seed}", "sequence.motions=1", f"criterion.kind={kind}")
            design = design or design_for(of)
            result = continue_run(
                of, new_result(of, [], {}), lambda index: lambda told: None, lambda step, now: None
            )
            found = invariants(of, result.stack, design)
            assert found.efficiency is not None
            low = found.efficiency * np.exp(-design.slack)
            print(
                f"| {name} | `{kind}` | {found.torque_deviation:.2g} | "
                f"{100 * low:.2g} to {100 * found.efficiency:.2g} % | "
                f"{result.motions[-1].stacked_condition_number:.1f} |",
                flush=True,
            )


if __name__ == "__main__":
    with threadpool_limits(1):
        main()
