"""Is a robot's program really stopped, however it resists?

    python -m benchmarks.trust.stubborn --times 20

Three kinds of stubborn programs, each stopped in four ways (the limit of time, one Ctrl-C, two,
SIGTERM) through `excite campaign`, with its real 10 s of grace. A trial holds where
nothing of the program is alive 11 s after the first signal (3 s where a second signal followed) and
the campaign has ended with the exit status of its way. Linux only.
"""

import argparse
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Lock

from benchmarks.trust.kill_commands import ROOT, SMOKE
from benchmarks.trust.stubborn_programs import KINDS, alive, command_of, noted

_LIMIT = 3.0  # s of --timeout: a busy machine must have started the program by then
_SECOND = 0.5  # s from the first Ctrl-C to the second
_STARTED = 120.0  # s


@dataclass(frozen=True)
class Way:
    """How a program is stopped: signals to the campaign, `within` what time [s], exit status."""

    signals: tuple[int, ...]
    within: float
    status: int


WAYS = {
    "the limit of time": Way((), 11.0, 1),
    "one Ctrl-C": Way((signal.SIGINT,), 11.0, 130),
    "two Ctrl-C": Way((signal.SIGINT, signal.SIGINT), 3.0, 130),
    "SIGTERM": Way((signal.SIGTERM,), 11.0, 143),
}
_EXCITE = (sys.executable, "-c", "from excite_cli.cli.app import main; main()")
_BRIEF = ("--set", "optimizer.max_iterations=3", "--set", "optimizer.restarts=1", "--plain")
_CAMPAIGN = ("campaign", "smoke.yaml", "--no-entry", "--retries", "0", *_BRIEF)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--times", type=int, default=20)
    parser.add_argument("--at-once", type=int, default=6, help="trials that run beside each other")
    asked = parser.parse_args()
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background ignores it
    root = Path(tempfile.mkdtemp(prefix="excite-stubborn-"))
    begun = time.monotonic()
    try:
        planned = _planned(root)
        with ThreadPoolExecutor(asked.at_once) as pool:
            trials = {
                (kind, way): [
                    pool.submit(_trial, root, planned, kind, WAYS[way]) for _ in range(asked.times)
                ]
                for kind in KINDS
                for way in WAYS
            }
            faults = sum(
                _shown(kind, way, [each.result() for each in tries])
                for (kind, way), tries in trials.items()
            )
    finally:
        shutil.rmtree(root, ignore_errors=True)
    print(f"{time.monotonic() - begun:.0f} s; {faults} faults")
    sys.exit(1 if faults else 0)


def _shown(kind: str, way: str, tries: list[tuple[float, str]]) -> int:
    """Print what came of the trials of one kind and way; how many failed."""
    good = [seconds for seconds, fault in tries if not fault]
    longest = f", the slowest gone after {max(good):.1f} s" if good else ""
    print(f"{kind}; {way}: {len(good)} of {len(tries)}{longest}", flush=True)
    for fault in sorted({fault for _, fault in tries if fault}):
        print(f"    {fault}")
    return len(tries) - len(good)


def _planned(root: Path) -> Path:
    """A folder with a campaign whose first motion is planned and not measured yet."""
    folder = root / "planned"
    folder.mkdir()
    text = Path(SMOKE).read_text(encoding="utf-8").replace("../data", str(ROOT / "data"))
    (folder / "smoke.yaml").write_text(text, encoding="utf-8")
    run = subprocess.run(
        [*_EXCITE, *_CAMPAIGN, "--measure", "false {motion} {data}"],
        cwd=folder, env=_environment(root), capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert "was not measured in 1 tries" in run.stderr, run.stderr
    return folder


def _environment(root: Path) -> dict[str, str]:
    return {**os.environ, "OPENBLAS_NUM_THREADS": "1", "XDG_CACHE_HOME": str(root / "cache")}


_one_at_a_time = Lock()  # planning and checks take a whole processor


def _trial(root: Path, planned: Path, kind: str, way: Way) -> tuple[float, str]:
    """Seconds from the first signal until nothing was alive, and what was wrong."""
    folder = Path(tempfile.mkdtemp(prefix="trial-", dir=root))
    shutil.copytree(planned, folder, dirs_exist_ok=True)
    line = command_of(kind, folder)
    limit = ("--timeout", str(_LIMIT if not way.signals else 600))
    with _one_at_a_time:
        process = subprocess.Popen(
            [*_EXCITE, *_CAMPAIGN, "--resume", "--measure", line, *limit],
            cwd=folder, env=_environment(root), text=True, stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, stderr=(folder / "said.txt").open("w"),
        )  # fmt: skip
        end = time.monotonic() + _STARTED
        while len(noted(folder)) < KINDS[kind][0]:
            if process.poll() is not None or time.monotonic() > end:
                return 0.0, "never started: " + (folder / "said.txt").read_text()
            time.sleep(0.05)
    try:
        return _stopped(process, folder, way)
    finally:
        with suppress(ProcessLookupError):
            process.kill()
        for pid in alive(folder):
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        process.wait()


def _stopped(process: subprocess.Popen[str], folder: Path, way: Way) -> tuple[float, str]:
    first = time.monotonic() + (0.0 if way.signals else _LIMIT)
    for place, number in enumerate(way.signals):
        time.sleep(_SECOND if place else 0.0)
        process.send_signal(number)
    while alive(folder) and time.monotonic() < first + way.within:
        time.sleep(0.05)
    seconds = time.monotonic() - first
    if left := alive(folder):
        return seconds, f"{len(left)} of {len(noted(folder))} alive after {way.within:.0f} s"
    try:
        status = process.wait(30.0)
    except subprocess.TimeoutExpired:
        return seconds, "the campaign did not end"
    said = (folder / "said.txt").read_text()
    if status != way.status or "Traceback" in said:
        return seconds, f"exit status {status}: {said[-500:]}"
    return seconds, ""


if __name__ == "__main__":
    main()
