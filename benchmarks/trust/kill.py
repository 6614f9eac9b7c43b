"""Kills every command that writes, at random moments, and looks at what is left.

    python -m benchmarks.trust.kill --kills 500 --seed 1

Each command runs in a session of its own, as a copy of a process that has imported everything, and
is killed with SIGKILL, seven times of ten at one of the events in the folder that it writes to (a
temporary file is made, filled, closed, moved …), else at any instant of its run. Half of all series
begin with an old output. A series kills up to five times in one folder, `optimize --resume` among
them, and then lets a run end: its numbers must be those of an undisturbed run, to the last bit.
"""

import argparse
import importlib
import os
import pkgutil
import shutil
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from multiprocessing import get_context
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from benchmarks.trust.kill_commands import COMMANDS, INPUTS, Command
from benchmarks.trust.killing import Reference, Series, Tally, forked, undisturbed

IN_ONE_FOLDER = 5  # kills
_SEED_OF_OLD = "77"
_SHARES = {
    "optimize": 8.0,
    "diagnose": 0.5,
    "report": 0.5,
    "report --figures": 0.25,
}  # of kills, against 1


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--kills", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--only", help="this command alone")
    asked = parser.parse_args()
    commands = [each for each in COMMANDS if asked.only in (None, each.name)]
    import_everything()
    root = Path(tempfile.mkdtemp(prefix="excite-kill-"))
    try:
        os.environ["XDG_CACHE_HOME"] = str(root / "cache")
        sys.exit(_campaign(commands, root, asked.kills, asked.seed, asked.workers))
    finally:
        shutil.rmtree(root, ignore_errors=True)


def _campaign(commands: list[Command], root: Path, kills: int, seed: int, workers: int) -> int:
    began = time.monotonic()
    make_inputs(root)
    counts = _counts(commands, kills)
    tallies = {each.name: Tally() for each in commands}
    with ProcessPoolExecutor(workers, get_context("fork")) as pool:
        waiting = [
            (each.name, pool.submit(_command, each, root / f"{i}", counts[each.name], seed))
            for i, each in enumerate(commands)
        ]
        for name, each in waiting:
            tallies[name].add(each.result())
            _tell(name, tallies[name])
    total = Tally()
    for tally in tallies.values():
        total.add(tally)
    _tell("all", total)
    for why in total.broken:
        print(why)
    print(f"{time.monotonic() - began:.0f} s, seed {seed}")
    return 1 if total.broken else 0


def make_inputs(root: Path) -> None:
    """Motions, data and a fit, made by commands that nobody disturbs."""
    (root / "make").mkdir()
    (root / "inputs").mkdir()
    for command in INPUTS:
        made = undisturbed(forked, command, root / "made").folder
        for each in made.iterdir():
            each.rename(root / "inputs" / each.name)
        made.rmdir()


def _counts(commands: list[Command], kills: int) -> dict[str, int]:
    """Kills of each command, by its share."""
    shares = {each.name: _SHARES.get(each.name, 1.0) for each in commands}
    whole = sum(shares.values())
    return {name: max(1, round(kills * share / whole)) for name, share in shares.items()}


def _command(command: Command, root: Path, kills: int, seed: int) -> Tally:
    """All series of one command, until it was killed `kills` times."""
    root.mkdir()
    (root / "inputs").symlink_to(root.parent / "inputs")
    reference = undisturbed(forked, command, root / "reference")
    old = _old(command, reference, root)
    rng, tally, number = np.random.default_rng([seed, len(command.name), kills]), Tally(), 0
    while tally.kills < kills and not tally.broken:
        folder = root / f"series-{number}"
        series = Series(forked, command, reference, folder, old if number % 2 else None)
        tally.add(series.play(min(IN_ONE_FOLDER, kills - tally.kills), rng))
        if not tally.broken:
            shutil.rmtree(folder)
        number += 1
    return tally


def _old(command: Command, reference: Reference, root: Path) -> Path:
    """Files from before: for a command that resumes, those of another seed."""
    if not command.resumable:
        return reference.folder
    arguments = (*command.arguments, "--seed", _SEED_OF_OLD)
    return undisturbed(
        forked, Command(command.name, arguments, command.outputs), root / "old"
    ).folder


def import_everything() -> None:
    import excite_cli

    for module in pkgutil.walk_packages(excite_cli.__path__, "excite_cli."):
        with suppress(ImportError, SystemError):  # a compiled library is no module
            importlib.import_module(module.name)
    for name in ("matplotlib.pyplot", "mujoco", "rosbags.rosbag2", "PIL.Image", "embreex"):
        importlib.import_module(name)


def _tell(name: str, tally: Tally) -> None:
    states = ", ".join(f"{count} {state}" for state, count in sorted(tally.states.items()))
    print(
        f"{name:18} {tally.kills:4} kills ({tally.writing} while a file was written; {tally.late} "
        f"too late): {states}; {tally.swept} leftovers swept; {tally.finished} runs afterwards "
        f"good; {len(tally.broken)} broken",
        flush=True,
    )


if __name__ == "__main__":
    main()
