"""Random and hostile inputs for every parser: `python -m benchmarks.trust.fuzz`.

Each input is made from a seed and its number, so that `--replay NUMBER` makes it again. Workers are
processes of their own: one that dies by a signal, or does not come back, is a fault of the input
that it was at, and is replaced.
"""

import argparse
import collections
import json
import os
import shutil
import signal
import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from benchmarks.trust.bag_files import BagFuzzer
from benchmarks.trust.data_files import CsvFuzzer, MotionFuzzer
from benchmarks.trust.hdf5_files import Hdf5Fuzzer, ResultFuzzer
from benchmarks.trust.robot_files import ConfigFuzzer, UrdfFuzzer
from benchmarks.trust.trial import MOST_SECONDS, Fuzzer, Verdict, attempt, generator, protect

FUZZERS: dict[str, type[Fuzzer]] = {
    fuzzer.name: fuzzer
    for fuzzer in (
        ConfigFuzzer, CsvFuzzer, Hdf5Fuzzer, ResultFuzzer, BagFuzzer, MotionFuzzer, UrdfFuzzer,
    )
}  # fmt: skip
_PATIENCE = 3 * MOST_SECONDS  # for what an alarm cannot interrupt


_at_work: dict[str, Any] = {}  # of a worker: its parser, a folder, the seed


def _begin(name: str, seed: int, bases: Path) -> None:
    """In a worker, once."""
    fuzzer = FUZZERS[name]()
    fuzzer.open(bases)
    protect()
    quiet = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(quiet, stream)  # libraries in C++ print there
    folder = Path(tempfile.mkdtemp(prefix="input_", dir=bases))
    _at_work.update(fuzzer=fuzzer, seed=seed, folder=folder)


def _tried(number: int) -> Verdict:
    """In a worker: one input, made and handed over."""
    fuzzer, place = _at_work["fuzzer"], _at_work["folder"] / "input"
    place.mkdir()
    try:
        try:
            path, made = fuzzer.make(generator(_at_work["seed"], fuzzer, number), place)
        except Exception as error:  # ours, and to be mended before anything is believed
            return Verdict(number, "-", "not made", repr(error)[:300])
        return attempt(fuzzer, path, number, made)
    finally:
        shutil.rmtree(place, ignore_errors=True)


def run(name: str, count: int, seed: int, workers: int, bases: Path) -> list[Verdict]:
    """Try `count` inputs of a parser."""
    FUZZERS[name]().prepare(bases)
    shares = [range(k, count, workers) for k in range(workers)]
    with ThreadPoolExecutor(workers) as threads:
        found = threads.map(lambda numbers: list(_by_one(name, seed, bases, numbers)), shares)
        return [verdict for each in found for verdict in each]


def _by_one(name: str, seed: int, bases: Path, numbers: range) -> Iterator[Verdict]:
    """What one worker says; another one goes on behind an input that ends it or keeps it."""
    worker: ProcessPoolExecutor | None = None
    for number in numbers:
        if worker is None:
            own = (name, seed, bases)
            worker = ProcessPoolExecutor(1, get_context("spawn"), _begin, own)
            worker.submit(int).result()  # it has begun
        (process,) = worker._processes.values()
        try:
            yield worker.submit(_tried, number).result(_PATIENCE)
        except (BrokenProcessPool, TimeoutError):
            process.kill()
            process.join()
            status, worker = process.exitcode or 0, None
            word = signal.Signals(-status).name if status < 0 else f"status {status}"
            yield Verdict(number, "-", word, "the process died")
    if worker is not None:
        worker.shutdown()


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
            found[name] = run(name, asked.count, asked.seed, asked.workers, Path(folder))
            faults += _tell(name, found[name])
    if asked.json is not None:
        data = {name: [asdict(each) for each in verdicts] for name, verdicts in found.items()}
        asked.json.write_text(json.dumps(data, indent=1), encoding="utf-8")
    return int(bool(faults))


if __name__ == "__main__":
    raise SystemExit(main())
