"""Does any rule of the diagnosis do nothing? Every one switched off in turn, on robots as they are.

    python -m benchmarks.ablations [--cases N] [--seed S] [--workers W] [--rules NAME …]

Rules are those of `excite_cli.diagnosis.rules`. Of each is printed, without it and with all: how
many answers are no worse than the textbook's by 2 %, the geometric mean of answer over textbook,
cases with wrong names confirmed; and in how many cases names, and the error by more than 2 %, are
others. A rule without which nothing changes may go.
"""

import argparse
import os
from functools import partial

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from benchmarks.battery.processes import outcomes_of
from benchmarks.robots_as_they_are import AS_GOOD, Outcome, outcome_of
from excite_cli.diagnosis import rules

NO = float("inf")
# What a rule is where it says nothing.
OFF: dict[str, dict[str, float]] = {
    "SMALLEST": {"SMALLEST": 0.0},
    "PARENT_PRICE": {"PARENT_PRICE": 25.0},  # about its own price
    "ON_FEWER_ROWS": {"ON_FEWER_ROWS": 0.0},
    "FARTHER": {"FARTHER": NO},
    "LEAST_SIDE": {"LEAST_SIDE": 0.0},
    "RUNS_OF_A_DRIFT": {"RUNS_OF_A_DRIFT": 1},
    "CONFIDENCE": {"CONFIDENCE": 0.5, "OF_ONE_RECORDING": 0.5},
    "OF_ONE_RECORDING": {"OF_ONE_RECORDING": rules.CONFIDENCE},
    "AS_GOOD": {"AS_GOOD": 1.0},
    "MATTERS": {"MATTERS": NO},
    "OF_WHAT_IS_LEFT": {"OF_WHAT_IS_LEFT": NO},
    "IMAGINED": {"IMAGINED": 0.0},
    "OF_A_NAME": {"OF_A_NAME": 1e-9},
    "HIGHER": {"HIGHER": NO},
}


def without(rule: str, seed: int, index: int) -> Outcome:
    """What the program says of a case without a rule; of none with all."""
    changed = OFF.get(rule, {})
    kept = {name: getattr(rules, name) for name in changed}
    try:
        for name, value in changed.items():
            setattr(rules, name, value)
        return outcome_of(seed, index)
    finally:
        for name, value in kept.items():
            setattr(rules, name, value)


def line(rule: str, found: list[Outcome], with_all: list[Outcome]) -> str:
    """A row of the table."""
    pairs = [(a, b) for a, b in zip(found, with_all, strict=True) if not (a.failure or b.failure)]
    ratios = np.array([a.ratio for a, _ in pairs])
    return (
        f"{rule or 'all rules':18s} {np.count_nonzero(ratios <= AS_GOOD):4d} of {len(found)}  "
        f"{np.exp(np.log(ratios).mean()):6.3f}  {sum(bool(a.wrong) for a, _ in pairs):3d}  "
        f"{sum(set(a.names) != set(b.names) for a, b in pairs):6d}  "
        f"{sum(abs(np.log(a.answer / b.answer)) > np.log(AS_GOOD) for a, b in pairs):6d}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--rules", nargs="+", choices=sorted(OFF), default=list(OFF))
    given = parser.parse_args()
    print("rule               as good  of textbook  wrong  names  errors (others than with all)")
    with_all: list[Outcome] = []
    for rule in ("", *given.rules):
        judged = partial(without, rule)
        found = list(outcomes_of(judged, given.seed, range(given.cases), given.workers))
        found.sort(key=lambda each: each.index)
        with_all = with_all or found
        print(line(rule, found, with_all), flush=True)


if __name__ == "__main__":
    main()
