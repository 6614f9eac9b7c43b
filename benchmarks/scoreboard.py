"""The public score board: several ways of finding a robot's dynamics, one judge, one command.

    python -m benchmarks.scoreboard [--figaroh E/bin/python] [--sysid F/bin/python] [--tools NAME …]
                                    [--only NAME …] [--first M] [--simulated N] [--seed S]

Real logs of `data/`, then N simulated robots. Every tool is given the same training runs and asked
for torques at the same states of the same held-out run. Results are kept in docs/scoreboard.json
after each log; a tool that is not run keeps its last results, with their date. The page, the short
table and the README get theirs between marks. See docs/scoreboard.md for what was chosen, and why.
"""

import argparse
import datetime
import os
import platform
from importlib import metadata
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from benchmarks.peers.exchange import write_given
from benchmarks.peers.log_judge import Case, judge_of
from benchmarks.peers.log_table import PART, page_part, percent, short_table
from benchmarks.peers.plain_urdf import plain_urdf
from benchmarks.peers.simulated import simulated
from benchmarks.peers.tools import (
    Entry,
    diagnosed,
    merged,
    read_entries,
    tools,
    tried,
    write_entries,
)
from benchmarks.program import ROOT

DATA, DOCS = ROOT / "data", ROOT / "docs"
STORED = DOCS / "scoreboard.json"
REAL = (
    Case("tx40", "Stäubli TX40", DATA / "tx40" / "tx40.yaml", DATA / "tx40" / "tx40.h5",
         coupled=("joint_5", "joint_6")),
    Case("ur10", "UR10 (CB3)", DATA / "ur10_cb" / "ur10_cb.yaml",
         DATA / "ur10_cb" / "ur10_exciting_trajectory.db3"),
    Case("kr300", "KUKA KR300", DATA / "kr300" / "kr300.yaml", DATA / "kr300" / "kr300.h5", "C"),
    Case("tiago", "PAL TIAGo", DATA / "tiago" / "tiago.yaml", DATA / "tiago" / "tiago.h5"),
)  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--figaroh", type=Path, help="interpreter that has figaroh")
    parser.add_argument("--sysid", type=Path, help="interpreter that has mujoco[sysid]")
    parser.add_argument("--only", nargs="*", help="these real logs (default: all)")
    parser.add_argument("--simulated", type=int, default=20)
    parser.add_argument("--first", type=int, default=0, help="number of the first simulated robot")
    parser.add_argument("--seed", type=int, default=7001)
    parser.add_argument("--tools", nargs="+", help="run these only, keep the others")
    parser.add_argument("--folder", type=Path, default=Path("results/scoreboard"))
    parser.add_argument("--tables", action="store_true", help="write pages anew, run nothing")
    parser.add_argument("--readme", type=Path, help="put the short table between the marks there")
    arguments = parser.parse_args()
    entries = {each.name: each for each in read_entries(STORED)}
    if not arguments.tables:
        for case in cases(arguments):
            try:
                new = entry(case, arguments)
            except Exception as error:  # one log that cannot be made must not end the others
                print(f"{case.name}: {type(error).__name__}: {error}", flush=True)
                continue
            entries = {each.name: each for each in read_entries(STORED)}
            entries[case.name] = merged(entries.get(case.name), new)
            write_entries(STORED, _ordered(entries))
    publish(_ordered(entries), arguments.readme)


def cases(arguments: argparse.Namespace):
    """Real logs, then simulated robots as they are made."""
    for case in REAL:
        if arguments.only is None or case.name in arguments.only:
            yield case
    for index in range(arguments.first, arguments.simulated):
        try:
            yield simulated(arguments.seed, index, arguments.folder / "simulated")
        except RuntimeError as error:
            print(f"simulated {index}: {error}", flush=True)


def entry(case: Case, arguments: argparse.Namespace) -> Entry:
    """All tools on one log."""
    judge, folder = judge_of(case), arguments.folder / case.name
    write_given(folder, plain_urdf(judge.case.robot), judge.given(folder))
    wanted = arguments.tools
    results = diagnosed(case, judge, folder) if wanted is None or "excite" in wanted else []
    for tool in tools(arguments.figaroh, arguments.sysid, case):
        if wanted is None or tool.name in wanted:
            results.append(tried(tool, judge, folder))
    told = [f"{r.tool} {percent(r.verdict.mean) if r.verdict else r.told}" for r in results]
    print(f"{case.name} ({case.words}): {'; '.join(told)}", flush=True)
    dates = dict.fromkeys([each.tool for each in results], datetime.date.today().isoformat())
    return Entry(case.name, case.words, case.is_real, tuple(results), dates)


def publish(entries: list[Entry], readme: Path | None) -> None:
    """The page, the short table, and the README if it is given."""
    PART.write(DOCS / "scoreboard.md", page_part(entries, setting(entries)))
    for path in (DOCS / "scoreboard_table.md", *([] if readme is None else [readme])):
        PART.write(path, short_table(entries))


def setting(entries: list[Entry]) -> str:
    """Versions and machine in sentences."""
    told = sorted({r.told for each in entries for r in each.results if r.verdict and r.told})
    own = f"excite {metadata.version('excite-cli')}, Pinocchio {metadata.version('pin')}"
    dates = sorted({date for each in entries for date in each.dates.values()})
    return (
        f"Measured {' to '.join(dict.fromkeys((dates[0], dates[-1])))} on {platform.machine()}, "
        f"one thread for each tool, other work beside it. {'; '.join([own, *told])}."
    )


def _ordered(entries: dict[str, Entry]) -> list[Entry]:
    real = [each.name for each in REAL]
    return sorted(entries.values(), key=lambda e: (real.index(e.name) if e.real else 99, e.name))


if __name__ == "__main__":
    main()
