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
import time
from collections.abc import Iterator
from dataclasses import asdict
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from pathlib import Path

from benchmarks.trust.bag_files import BagFuzzer
from benchmarks.trust.data_files import CsvFuzzer, Hdf5Fuzzer, MotionFuzzer, ResultFuzzer
from benchmarks.trust.robot_files import ConfigFuzzer, UrdfFuzzer
from benchmarks.trust.trial import MOST_SECONDS, Fuzzer, Verdict, attempt, generator, protect

FUZZERS: dict[str, type[Fuzzer]] = {
    fuzzer.name: fuzzer
    for fuzzer in (
        ConfigFuzzer, CsvFuzzer, Hdf5Fuzzer, ResultFuzzer, BagFuzzer, MotionFuzzer, UrdfFuzzer,
    )
}  # fmt: skip
_PATIENCE = 3 * MOST_SECONDS  # for what an alarm cannot interrupt


def work(out: Connection, name: str, seed: int, bases: Path, numbers: range) -> None:
    """In a worker: try inputs, and say of each that it begins and how it ended."""
    fuzzer = FUZZERS[name]()
    fuzzer.open(bases)
    protect()
    quiet = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(quiet, stream)  # libraries in C++ print there
    with tempfile.TemporaryDirectory(prefix="fuzz_") as folder:
        for number in numbers:
            out.send(number)
            out.send(_tried(fuzzer, seed, number, Path(folder)))


def _tried(fuzzer: Fuzzer, seed: int, number: int, folder: Path) -> Verdict:
    place = folder / "input"
    place.mkdir()
    try:
        try:
            path, made = fuzzer.make(generator(seed, fuzzer, number), place)
        except Exception as error:  # ours, and to be mended before anything is believed
            return Verdict(number, "-", "not made", repr(error)[:300])
        return attempt(fuzzer, path, number, made)
    finally:
        shutil.rmtree(place, ignore_errors=True)


class _Worker:
    """A process that works off every n-th number; started again behind an input that ends it."""

    def __init__(self, name: str, seed: int, bases: Path, numbers: range) -> None:
        self.arguments = (name, seed, bases)
        self.start(numbers)

    def start(self, numbers: range) -> None:
        """A new process for what is left."""
        self.left, self.at, self.since = numbers, -1, time.monotonic()
        processes = get_context("spawn")
        self.pipe, theirs = processes.Pipe(duplex=False)
        self.process = processes.Process(target=work, args=(theirs, *self.arguments, numbers))
        self.process.start()
        theirs.close()

    def heard(self) -> Verdict | None:
        """A verdict, if one has come; the process's own end is one where it died."""
        self.since = time.monotonic()
        try:
            said = self.pipe.recv()
        except EOFError:
            return self._ended()
        if isinstance(said, Verdict):
            return said
        self.at = said
        return None

    def _ended(self) -> Verdict | None:
        self.process.join()
        status, left = self.process.exitcode or 0, self.left
        self.left = range(0)
        if status == 0:
            return None
        if self.at < 0:
            raise SystemExit(f"a worker of {self.arguments[0]} did not start (status {status})")
        word = signal.Signals(-status).name if status < 0 else f"status {status}"
        lost = Verdict(self.at, "-", word, "the process died")
        if rest := range(self.at + left.step, left.stop, left.step):
            self.start(rest)
        return lost

    def end_if_late(self) -> None:
        """Kill it where it has not come back for too long."""
        if self.at >= 0 and time.monotonic() - self.since > _PATIENCE:
            self.process.kill()


def run(name: str, count: int, seed: int, workers: int, bases: Path) -> Iterator[Verdict]:
    """Try `count` inputs of a parser."""
    FUZZERS[name]().prepare(bases)
    crew = [_Worker(name, seed, bases, range(k, count, workers)) for k in range(workers)]
    while busy := [worker for worker in crew if worker.left]:
        ready = wait([worker.pipe for worker in busy], timeout=1.0)
        for worker in busy:
            if worker.pipe not in ready:
                worker.end_if_late()
            elif (verdict := worker.heard()) is not None:
                yield verdict


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
            found[name] = list(run(name, asked.count, asked.seed, asked.workers, Path(folder)))
            faults += _tell(name, found[name])
    if asked.json is not None:
        data = {name: [asdict(each) for each in verdicts] for name, verdicts in found.items()}
        asked.json.write_text(json.dumps(data, indent=1), encoding="utf-8")
    return int(bool(faults))


if __name__ == "__main__":
    raise SystemExit(main())
