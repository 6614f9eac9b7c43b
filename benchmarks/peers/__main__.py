"""Peers on the UR10 of FIGAROH's example, in one run: same robot, limits and samples.

    python -m benchmarks.peers --figaroh-python ENV/bin/python --markdown docs/peers_table.md

Contestants take turns, seed by seed, each in a process of its own on one thread: FIGAROH with
self-collision and without, this program by FIGAROH's columns and by its own, with forward
differences in place of its exact gradient, and without self-collision. Times are processor times,
which other programs on the machine hardly change. Without FIGAROH the others run, by their own
columns. docs/peers.md says how it is kept fair.
"""

import argparse
import os
import platform
import time
from importlib import metadata
from pathlib import Path

from benchmarks.peers import races
from benchmarks.peers.motion_judge import CONTESTANTS, Judge, race_of_ours
from benchmarks.peers.motion_table import PART, Comparison, Entry, dated_goals, markdown
from benchmarks.peers.races import Measure, Race
from benchmarks.problems import CONFIGS
from excite_cli.atomic import write_text_atomically

CONFIG = CONFIGS / "ur10_figaroh.yaml"
_FOUND = "best by FIGAROH's columns {:.2f}, by excite's {:.2f}, in {:.1f} s"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", nargs="+", type=int, default=[1, 2])
    parser.add_argument("--figaroh-python", type=Path, help="interpreter that has FIGAROH")
    parser.add_argument("--config", type=Path, default=CONFIG, help="ours; FIGAROH gets its URDF")
    parser.add_argument("--seconds", type=float, default=250.0, help="FIGAROH's, processor time")
    parser.add_argument("--markdown", type=Path, help="write the table there too")
    parser.add_argument("--goals", type=Path, help="put the goals between the marks of this page")
    arguments = parser.parse_args()
    judge = Judge(arguments.config.resolve())
    peer = races.find(arguments.figaroh_python, judge.problem.robot.description)
    if peer is None:
        print(races.HOW_TO_INSTALL, "\nGoing on with the others.\n", flush=True)
    judge.keeps_config(judge.problem.still(judge.problem.robot.posture), True)  # fills all caches
    entries: list[Entry] = []
    for seed in arguments.seeds:
        entries += one_seed(judge, peer, seed, arguments.seconds)
    told = setting(judge, [entry.race for entry in entries])
    comparison = Comparison(time.strftime("%Y-%m-%d"), told, tuple(entries))
    text = markdown(comparison)
    print(text)
    if arguments.goals is not None:
        PART.write(arguments.goals, dated_goals(comparison))
    if arguments.markdown is not None:
        write_text_atomically(arguments.markdown, text)


def one_seed(judge: Judge, peer: races.Figaroh | None, seed: int, seconds: float) -> list[Entry]:
    """All contestants, one after the other."""
    columns: tuple[int, ...] | None = None
    entries = []
    if peer is not None:
        for self_collision in (True, False):
            for race in peer.races(seed, self_collision, seconds, judge.columns):
                columns = race.columns
                entries.append(_judged(judge, race, columns))
    for name in CONTESTANTS:
        entries.append(_judged(judge, race_of_ours(judge, name, seed, columns), columns))
    return entries


def _judged(judge: Judge, race: Race, columns: tuple[int, ...] | None) -> Entry:
    last = (*(race.best(measure) for measure in Measure), race.processor)
    told = _FOUND.format(*last) if len(race.curve) else f"no motion in {race.processor:.1f} s"
    print(f"seed {race.seed}, {race.contestant}: {told}", flush=True)
    return Entry(race, judge.judge(race, columns))


def setting(judge: Judge, races: list[Race]) -> str:
    """Machine, versions and sizes, in sentences."""
    versions = ", ".join(f"{name} {metadata.version(name)}" for name in ("pin", "numpy", "scipy"))
    chosen = {race.columns for race in races if race.columns is not None}
    of_peer = {0: "FIGAROH not installed, our own columns", 1: "FIGAROH's columns and ours"}.get(
        len(chosen), "FIGAROH's columns, other ones from seed to seed, and ours"
    )
    free = judge.problem.boundary.free.shape[1] * judge.problem.robot.n
    return (
        f"{platform.machine()}, {os.cpu_count()} cores, one thread for each program, {versions}. "
        f"Condition numbers: {of_peer}, {len(judge.cost)} samples. Variables: FIGAROH 36, excite "
        f"{free}. Times are processor times from the start of the search (seconds); a number in "
        "brackets is the worst over the seeds."
    )


if __name__ == "__main__":
    main()
