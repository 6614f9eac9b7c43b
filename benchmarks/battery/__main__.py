"""The benchmark behind the diagnosis: effects planted in simulated robots, found or not.

    python -m benchmarks.battery [--deck DECK] [--cases N] [--seed S] [--workers W] [--json FILE]
                                 [--kind KIND] [--only INDEX …]

A case follows from (deck, seed, index) alone: a robot whose inertias are off its URDF, recordings,
of which one is held out, a declared model, and something planted that it lacks, or nothing.

- `catalogue`: four motions of 10 s; a kind of the catalogue, two of them, one that is absorbed, one
  that no name fits, or none. What is planted is 3–30 % of the torque of the joint where it is
  strongest, some near the noise.
- `hard`: what a search gets wrong, by topic. `history`: friction with memory, Dahl's, integrated in
  another way than in the catalogue, and another form.
- `campaigns`: runs that differ, short moves, faulty packets, unknown maps, by sixteen groups; names
  count with their runs, and so do sizes and a large rest that is not told. `columns`: logs with
  further columns.
- `as_they_are`: geared arms of which nothing is declared, with other friction than the catalogue's.
  Asked is whether the answer is ever worse than a textbook's fit, and whether what is *confirmed*
  is there.

Seeds below 1000 are for development, and so is every seed that led to a change since it was run.
The figures that are quoted are of a seed from 5000 on that nobody had looked at, run once.
"""

import argparse
import os
import time
from functools import partial
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from threadpoolctl import threadpool_limits

from benchmarks.battery import tables
from benchmarks.battery.decks import DECKS
from benchmarks.battery.judge import Outcome, judge, outcome_of, outcomes_of, write


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--deck", choices=DECKS, default="catalogue", help="which cases")
    parser.add_argument("--cases", type=int, default=66)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--json", type=Path, help="write all outcomes here")
    parser.add_argument("--kind", help="only cases about this kind or group")
    parser.add_argument("--only", type=int, nargs="+", help="these cases, with all details")
    given = parser.parse_args()
    deck = DECKS[given.deck]
    if given.only is not None:
        with threadpool_limits(1):
            for index in given.only:
                judged = judge(given.seed, deck.first + index, given.deck)
                print(tables.in_detail(judged), flush=True)
        return
    every = range(deck.first, deck.first + given.cases)
    chosen = [i for i in every if given.kind is None or given.kind in deck.label(given.seed, i)]
    began = time.perf_counter()
    print(tables.HEADER, flush=True)
    outcomes: list[Outcome] = []
    judged_one = partial(outcome_of, deck=given.deck)
    for outcome in outcomes_of(judged_one, given.seed, chosen, given.workers):
        outcomes.append(outcome)
        print(tables.line(outcome), flush=True)
        if given.json is not None:
            write(given.json, given.seed, outcomes)
    print("\n".join(["", "failures", *tables.failures(outcomes), "", *tables.groups(outcomes), ""]))
    print("\n".join(rate.text() for rate in tables.rates(outcomes, given.deck)))
    print(f"{len(outcomes)} cases in {time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    main()
