"""Does any rule of the diagnosis do nothing? Each switched off in turn, on decks of the battery.

    python -m benchmarks.ablations [--deck DECK …] [--cases N] [--seed S] [--workers W]
                                   [--rules NAME …]

Rules are those of `excite_cli.diagnosis.rules`. Of each is printed, without it and with all: in how
many cases the answer is good (no worse than the textbook's by 2 %, or the right names and no
alarm), the geometric mean of its error over the one that it is compared with, cases with wrong
names; and in how many cases names, and the error by more than 2 %, are others. A rule without which
nothing changes may go.
"""

import argparse
import os
from functools import partial

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from benchmarks.battery.decks import DECKS
from benchmarks.battery.judge import Outcome, outcome_of, outcomes_of
from benchmarks.battery.tables import AS_GOOD, is_clean
from excite_cli.diagnosis import rules

NO = float("inf")
# What a rule is where it says nothing.
OFF: dict[str, dict[str, float]] = {
    "SMALLEST": {"SMALLEST": 0.0},
    "PARENT_PRICE": {"PARENT_PRICE": 25.0},  # about its own price
    "ON_FEWER_ROWS": {"ON_FEWER_ROWS": 0.0},
    "MUCH": {"MUCH": NO},
    "LEAST_SIDE": {"LEAST_SIDE": 0.0},
    "RUNS_OF_A_DRIFT": {"RUNS_OF_A_DRIFT": 1},
    "CONFIDENCE": {"CONFIDENCE": 0.5},
    "AS_GOOD": {"AS_GOOD": 1.0},
    "MATTERS": {"MATTERS": NO},
    "IMAGINED": {"IMAGINED": 0.0},
    "OF_A_NAME": {"OF_A_NAME": 1e-9},
}


def without(rule: str, deck: str, seed: int, index: int) -> Outcome:
    """What the program says of a case without a rule; of none with all."""
    changed = OFF.get(rule, {})
    kept = {name: getattr(rules, name) for name in changed}
    try:
        for name, value in changed.items():
            setattr(rules, name, value)
        return outcome_of(seed, index, deck)
    finally:
        for name, value in kept.items():
            setattr(rules, name, value)


def line(rule: str, found: list[Outcome], with_all: list[Outcome], beside: str) -> str:
    """A row of the table."""
    pairs = [(a, b) for a, b in zip(found, with_all, strict=True) if not (a.error or b.error)]
    ratios = np.array([a.ratio for a, _ in pairs if np.isfinite(a.ratio)] or [np.nan])
    good = sum(
        a.ratio <= AS_GOOD if beside == "textbook" else not a.alarm if is_clean(a) else a.right
        for a, _ in pairs
    )
    return (
        f"{rule or 'all rules':18s} {good:4d} of {len(found)}  "
        f"{np.exp(np.log(ratios).mean()):6.3f}  {sum(bool(a.wrong) for a, _ in pairs):3d}  "
        f"{sum(names(a) != names(b) for a, b in pairs):6d}  "
        f"{sum(abs(np.log(a.after / b.after)) > np.log(AS_GOOD) for a, b in pairs):6d}"
    )


def names(of: Outcome) -> set[tuple[str, ...]]:
    """Kinds with their joints."""
    return {(each["kind"], *each["joints"]) for each in of.named}


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--deck", nargs="+", choices=DECKS, default=["as_they_are"])
    parser.add_argument("--cases", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--rules", nargs="+", choices=sorted(OFF), default=list(OFF))
    given = parser.parse_args()
    for deck in given.deck:
        print(f"{deck}: rule, good, error compared, wrong; others than with all: names, errors")
        first, with_all = DECKS[deck].first, list[Outcome]()
        for rule in ("", *given.rules):
            judged, cases = partial(without, rule, deck), range(first, first + given.cases)
            found = list(outcomes_of(judged, given.seed, cases, given.workers))
            found.sort(key=lambda each: each.index)
            with_all = with_all or found
            print(line(rule, found, with_all, DECKS[deck].beside), flush=True)


if __name__ == "__main__":
    main()
