"""Campaigns as robots make them: runs that differ, short moves, faulty packets, unknown maps.

    python -m benchmarks.campaign_battery [--cases N] [--seed S] [--workers W] [--json FILE]
                                          [--group GROUP] [--columns] [--only INDEX …]

A case is a MuJoCo robot whose inertias are 10–30 % off its URDF, two to eight runs of which one is
held out, and something that the config does not declare; see `benchmarks/campaigns/cases.py` for
the sixteen groups. Cases follow from (seed, index) alone. Each is diagnosed from a file, as by a
user. What was said is compared to what was planted: names, the runs they are of, sizes, and whether
a rest that is large by the truth is said to be there.

Seeds below 1000 are for development; the figures that are quoted are of a seed from 5000 on that
nobody had looked at.
"""

import argparse
import os
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from threadpoolctl import threadpool_limits

from benchmarks.battery.processes import outcomes_of, write
from benchmarks.campaigns import tables
from benchmarks.campaigns.cases import FIRST_WITH_COLUMNS, GROUPS, WITH_COLUMNS, group_of
from benchmarks.campaigns.judge import Outcome, judge


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=208)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--json", type=Path, help="write all outcomes and rates here")
    parser.add_argument("--group", choices=(*GROUPS, *WITH_COLUMNS), help="only cases of it")
    parser.add_argument("--columns", action="store_true", help="logs with further columns")
    parser.add_argument("--only", type=int, nargs="+", help="these cases, with all details")
    arguments = parser.parse_args()
    if arguments.only is not None:
        with threadpool_limits(1):
            for index in arguments.only:
                print(tables.in_detail(judge(arguments.seed, index)), flush=True)
        return
    first = FIRST_WITH_COLUMNS if arguments.columns else 0
    chosen = [
        index
        for index in range(first, first + arguments.cases)
        if arguments.group in (None, group_of(arguments.seed, index))
    ]
    began = time.perf_counter()
    print(tables.HEADER, flush=True)
    outcomes: list[Outcome] = []
    for outcome in outcomes_of(_outcome, arguments.seed, chosen, arguments.workers):
        outcomes.append(outcome)
        print(tables.line(outcome), flush=True)
        if arguments.json is not None:
            write(arguments.json, arguments.seed, tables.rates(outcomes), outcomes)
    print("\n".join(["", "failures", *tables.failures(outcomes), "", *tables.groups(outcomes), ""]))
    print("\n".join(rate.text() for rate in tables.rates(outcomes)))
    print(f"{len(outcomes)} cases in {time.perf_counter() - began:.0f} s")


def _outcome(seed: int, index: int) -> Outcome:
    return judge(seed, index).outcome


if __name__ == "__main__":
    main()
