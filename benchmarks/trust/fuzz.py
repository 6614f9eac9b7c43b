"""Random and hostile inputs for every parser: `python -m benchmarks.trust.fuzz`.

Each input is made from a seed and its number, so that `--replay NUMBER` makes it again. Workers are
processes of their own: one that dies by a signal, or does not come back, is a fault of the input
that it was at, and is replaced.
"""

import argparse
import collections
import json
import os
import selectors
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.trust.fuzz_catalogue import FUZZERS, fuzzer_named
from benchmarks.trust.fuzz_trial import (
    MOST_SECONDS,
    Fuzzer,
    Verdict,
    attempt,
    generator,
    protect,
)

_PATIENCE = 3 * MOST_SECONDS  # for what an alarm cannot interrupt


@dataclass
class Tally:
    """What came of all inputs of a parser."""

    accepted: int = 0
    refused: int = 0
    seconds: float = 0.0
    cpu: float = 0.0
    memory: int = 0
    faults: list[Verdict] = field(default_factory=list)
    kinds: collections.Counter[str] = field(default_factory=collections.Counter)

    def add(self, verdict: Verdict) -> None:
        """Count one."""
        self.accepted += verdict.end == "accepted"
        self.refused += verdict.end == "refused"
        self.seconds = max(self.seconds, verdict.seconds)
        self.cpu = max(self.cpu, verdict.cpu)
        self.memory = max(self.memory, verdict.memory)
        self.kinds[f"{verdict.made}: {verdict.end}"] += 1
        if not verdict.good:
            self.faults.append(verdict)


def work(name: str, seed: int, bases: Path, numbers: range) -> None:
    """In a worker: try inputs, and say of each on stdout that it begins and how it ended."""
    fuzzer = fuzzer_named(name)
    fuzzer.open(bases)
    protect()
    out = os.fdopen(os.dup(1), "w", buffering=1)
    quiet = os.open(os.devnull, os.O_WRONLY)
    os.dup2(quiet, 1)
    os.dup2(quiet, 2)  # libraries in C++ print there
    print(json.dumps({"ready": os.getpid()}), file=out)
    with tempfile.TemporaryDirectory(prefix="fuzz_") as folder:
        for number in numbers:
            print(json.dumps({"begin": number}), file=out)
            print(json.dumps(_tried(fuzzer, seed, number, Path(folder)).as_data()), file=out)


def _tried(fuzzer: Fuzzer, seed: int, number: int, folder: Path) -> Verdict:
    place = folder / "input"
    place.mkdir()
    try:
        try:
            path, made = fuzzer.make(generator(seed, fuzzer, number), place)
        except Exception as error:  # ours, and to be mended before anything is believed
            return Verdict(number, "-", "not made", repr(error)[:300], 0.0, 0.0, 0)
        return attempt(fuzzer, path, number, made)
    finally:
        shutil.rmtree(place, ignore_errors=True)


class _Worker:
    """A process that works off every n-th number; started again behind an input that ends it."""

    def __init__(self, name: str, seed: int, bases: Path, numbers: range) -> None:
        self.arguments = (name, seed, bases)
        self.step, self.stop = numbers.step, numbers.stop
        self.at = numbers.start
        self.process: subprocess.Popen[bytes] | None = None
        self.rest = b""
        self.since = time.monotonic()
        self.ready = False
        self.start(numbers.start)

    def start(self, first: int) -> None:
        """A new process from `first` on."""
        self.at, self.ready, self.since = first, False, time.monotonic()
        if first >= self.stop:
            self.process = None
            return
        name, seed, bases = self.arguments
        command = [sys.executable, "-m", "benchmarks.trust.fuzz", "--parser", name]
        command += ["--seed", str(seed), "--bases", str(bases)]
        command += ["--work", f"{first}:{self.stop}:{self.step}"]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, bufsize=0)
        self.rest = b""

    def lines(self) -> list[bytes] | None:
        """Whole lines that have come; None at the end."""
        assert self.process is not None
        assert self.process.stdout is not None
        more = os.read(self.process.stdout.fileno(), 1 << 16)
        if not more:
            return None
        *whole, self.rest = (self.rest + more).split(b"\n")
        return whole

    def take(self, line: bytes) -> Verdict | None:
        """A verdict, if the line is one."""
        self.since = time.monotonic()
        data = json.loads(line)
        if "ready" in data:
            self.ready = True
            return None
        if "begin" in data:
            self.at = data["begin"]
            return None
        return Verdict(**data)

    def ended(self) -> Verdict | None:
        """The process is gone: nothing if it was done, else a fault; the next one takes over."""
        assert self.process is not None
        status = self.process.wait()
        if status == 0:
            self.process = None
            return None
        if not self.ready:
            raise SystemExit(f"a worker of {self.arguments[0]} did not start (status {status})")
        word = signal.Signals(-status).name if status < 0 else f"status {status}"
        lost = Verdict(self.at, "-", word, "the process died", 0.0, 0.0, 0)
        self.start(self.at + self.step)
        return lost

    def late(self) -> bool:
        """Whether it has not come back for too long."""
        return self.ready and time.monotonic() - self.since > _PATIENCE


def run(name: str, count: int, seed: int, workers: int, bases: Path, verbose: bool) -> Tally:
    """Try `count` inputs of a parser."""
    tally = Tally()
    crew = [_Worker(name, seed, bases, range(k, count, workers)) for k in range(workers)]
    while busy := [worker for worker in crew if worker.process is not None]:
        with selectors.DefaultSelector() as selector:
            for worker in busy:
                assert worker.process is not None
                assert worker.process.stdout is not None
                selector.register(worker.process.stdout, selectors.EVENT_READ, worker)
            ready = [key.data for key, _ in selector.select(timeout=1.0)]
        for worker in busy:
            if worker in ready:
                lines = worker.lines()
                came = [worker.ended()] if lines is None else [worker.take(x) for x in lines]
                for verdict in filter(None, came):
                    tally.add(verdict)
                    if verbose and not verdict.good:
                        print(f"  {verdict}", file=sys.stderr, flush=True)
            elif worker.late():
                worker.process.kill()  # type: ignore[union-attr]
    return tally


def prepared(name: str, bases: Path) -> None:
    """Valid files that the inputs of a parser are made from; kept if they are there."""
    fuzzer_named(name).prepare(bases)


def _replay(name: str, seed: int, number: int, bases: Path, keep: Path | None) -> None:
    fuzzer = fuzzer_named(name)
    fuzzer.prepare(bases)
    fuzzer.open(bases)
    protect()
    folder = keep or Path(tempfile.mkdtemp(prefix="fuzz_"))
    folder.mkdir(parents=True, exist_ok=True)
    path, made = fuzzer.make(generator(seed, fuzzer, number), folder)
    print(f"{path} ({made})")
    verdict = attempt(fuzzer, path, number, made)
    print(verdict)
    if not verdict.good:
        fuzzer.enter(path)  # with its traceback


def _table(name: str, tally: Tally, count: int) -> str:
    return (
        f"{name:8} {count:7d} {tally.accepted:9d} {tally.refused:8d} {len(tally.faults):7d} "
        f"{tally.seconds:8.2f} {tally.cpu:8.2f} {tally.memory / 2**20:9.0f}"
    )


def main() -> int:
    """Run; status 1 if there was a fault."""
    names = [fuzzer.name for fuzzer in FUZZERS]
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--parser", choices=[*names, "all"], default="all")
    parser.add_argument("--count", type=int, default=10_000, help="inputs per parser")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--replay", type=int, help="make and try this input again")
    parser.add_argument("--keep", type=Path, help="where --replay leaves the input")
    parser.add_argument("--json", type=Path, help="write what was found")
    parser.add_argument("--verbose", action="store_true", help="tell faults as they come")
    parser.add_argument("--bases", type=Path, help="folder of the valid files inputs are made from")
    parser.add_argument("--work", help=argparse.SUPPRESS)
    options = parser.parse_args()
    bases = options.bases or Path(tempfile.mkdtemp(prefix="fuzz_bases_"))
    bases.mkdir(parents=True, exist_ok=True)
    if options.work is not None:
        work(options.parser, options.seed, bases, range(*map(int, options.work.split(":"))))
        return 0
    if options.replay is not None:
        _replay(options.parser, options.seed, options.replay, bases, options.keep)
        return 0
    found = {}
    print("parser    inputs  accepted  refused  faults  seconds  cpu [s]  peak [MiB]")
    for name in names if options.parser == "all" else [options.parser]:
        prepared(name, bases)
        tally = run(name, options.count, options.seed, options.workers, bases, options.verbose)
        found[name] = tally
        print(_table(name, tally, options.count), flush=True)
        for (end, text), count in collections.Counter(
            (fault.end, fault.text[-120:]) for fault in tally.faults
        ).most_common(40):
            example = next(f for f in tally.faults if (f.end, f.text[-120:]) == (end, text))
            print(f"    {count} × {end}: {example.text} (--replay {example.index}, {example.made})")
    if options.json is not None:
        data = {
            name: {
                "accepted": tally.accepted,
                "refused": tally.refused,
                "seconds": tally.seconds,
                "cpu": tally.cpu,
                "memory": tally.memory,
                "kinds": dict(sorted(tally.kinds.items())),
                "faults": [fault.as_data() for fault in tally.faults],
            }
            for name, tally in found.items()
        }
        options.json.write_text(json.dumps(data, indent=1), encoding="utf-8")
    if options.bases is None:
        shutil.rmtree(bases, ignore_errors=True)
    return int(any(tally.faults for tally in found.values()))


if __name__ == "__main__":
    raise SystemExit(main())
