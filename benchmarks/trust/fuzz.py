"""Random and hostile inputs for every parser: `python -m benchmarks.trust.fuzz`.

Each input is made from a seed and its number, so that `--replay NUMBER` makes it again. They are
tried in worker processes: one that dies by a signal, or does not come back, is a fault of the input
that it was at, which is tried twice more.
"""

import argparse
import collections
import faulthandler
import json
import os
import tempfile
from dataclasses import asdict
from functools import cache
from pathlib import Path

from benchmarks.trust.bag_files import BagFuzzer
from benchmarks.trust.data_files import CsvFuzzer, MotionFuzzer
from benchmarks.trust.hdf5_files import Hdf5Fuzzer, ResultFuzzer
from benchmarks.trust.robot_files import ConfigFuzzer, UrdfFuzzer
from benchmarks.trust.trial import MOST_SECONDS, Fuzzer, Verdict, attempt, generator, protect
from excite_cli.workers.base import Tell, Workers
from excite_cli.workers.processes import Processes

FUZZERS: dict[str, type[Fuzzer]] = {
    fuzzer.name: fuzzer
    for fuzzer in (
        ConfigFuzzer, CsvFuzzer, Hdf5Fuzzer, ResultFuzzer, BagFuzzer, MotionFuzzer, UrdfFuzzer,
    )
}  # fmt: skip
_PATIENCE = 3 * MOST_SECONDS  # s, for what an alarm cannot interrupt: then the process ends


@cache
def _opened(name: str, bases: Path) -> Fuzzer:
    """The fuzzer, once in every worker."""
    fuzzer = FUZZERS[name]()
    fuzzer.open(bases)
    protect()
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # libraries in C++ print there
    return fuzzer


def tried(shared: tuple[str, int, Path], number: int, tell: Tell) -> Verdict:
    """In a worker: make an input and try it."""
    name, seed, bases = shared
    fuzzer = _opened(name, bases)
    with tempfile.TemporaryDirectory(prefix="fuzz_") as folder:
        try:
            path, made = fuzzer.make(generator(seed, fuzzer, number), Path(folder))
        except Exception as error:  # ours, and to be mended before anything is believed
            return Verdict(number, "-", "not made", repr(error)[:300])
        faulthandler.dump_traceback_later(_PATIENCE, exit=True)
        try:
            return attempt(fuzzer, path, number, made)
        finally:
            faulthandler.cancel_dump_traceback_later()


def run(name: str, count: int, seed: int, workers: Workers, bases: Path) -> list[Verdict]:
    """Try `count` inputs of a parser; the end of a worker is a fault of its input."""
    from benchmarks.trust.fuzz import tried  # workers import it by this name, not from __main__

    FUZZERS[name]().prepare(bases)
    found = workers.map(tried, (name, seed, bases), range(count), keep_failures=True)
    return [
        each if isinstance(each, Verdict) else Verdict(k, "-", type(each).__name__, str(each))
        for k, each in enumerate(found)
    ]


def _replay(name: str, seed: int, number: int, bases: Path, keep: Path | None) -> None:
    fuzzer = FUZZERS[name]()
    fuzzer.prepare(bases)
    fuzzer.open(bases)
    protect()
    folder = keep or Path(tempfile.mkdtemp(prefix="fuzz_"))
    folder.mkdir(parents=True, exist_ok=True)
    path, made = fuzzer.make(generator(seed, fuzzer, number), folder)
    verdict = attempt(fuzzer, path, number, made)
    print(f"{path} ({made})\n{verdict}")
    if not verdict.good:
        fuzzer.enter(path)  # with its traceback


def _tell(name: str, verdicts: list[Verdict]) -> list[Verdict]:
    """A row of the table and its faults, which are returned."""
    ends = collections.Counter(each.end for each in verdicts)
    faults = [each for each in verdicts if not each.good]
    most = [max(getattr(v, x) for v in verdicts) for x in ("seconds", "cpu", "memory")]
    print(
        f"{name:8} {len(verdicts):7d} {ends['accepted']:9d} {ends['refused']:8d} "
        f"{len(faults):7d} {most[0]:8.2f} {most[1]:8.2f} {most[2] / 2**20:9.0f}",
        flush=True,
    )
    alike = collections.Counter((fault.end, fault.text[-120:]) for fault in faults)
    for (end, text), count in alike.most_common(40):
        example = next(f for f in faults if (f.end, f.text[-120:]) == (end, text))
        print(f"    {count} × {end}: {example.text} (--replay {example.index}, {example.made})")
    return faults


def main() -> int:
    """Run; status 1 if there was a fault."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--parser", choices=[*FUZZERS, "all"], default="all")
    parser.add_argument("--count", type=int, default=10_000, help="inputs per parser")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--replay", type=int, help="make and try this input again")
    parser.add_argument("--keep", type=Path, help="where --replay leaves the input")
    parser.add_argument("--json", type=Path, help="write all verdicts there")
    asked = parser.parse_args()
    found, faults = {}, list[Verdict]()
    with tempfile.TemporaryDirectory(prefix="fuzz_bases_") as folder:
        if asked.replay is not None:
            _replay(asked.parser, asked.seed, asked.replay, Path(folder), asked.keep)
            return 0
        print("parser    inputs  accepted  refused  faults  seconds  cpu [s]  peak [MiB]")
        for name in FUZZERS if asked.parser == "all" else [asked.parser]:
            with Processes(asked.workers) as workers:  # of one parser: libraries keep their state
                found[name] = run(name, asked.count, asked.seed, workers, Path(folder))
            faults += _tell(name, found[name])
    if asked.json is not None:
        data = {name: [asdict(each) for each in verdicts] for name, verdicts in found.items()}
        asked.json.write_text(json.dumps(data, indent=1), encoding="utf-8")
    return int(bool(faults))


if __name__ == "__main__":
    raise SystemExit(main())
