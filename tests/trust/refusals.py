"""Hostile inputs must be refused: with one message, quickly, and without filling the memory."""

import resource
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.trust.trial import Fuzzer, Verdict, attempt

# Bytes that a refusal may take at its peak beyond what this process, with whatever was run in it
# before, holds already.
MOST_GROWTH = 350 * 2**20


class Entry(Fuzzer):
    """Only entered: nothing is made for it."""

    name = "entry"

    def __init__(self, enter: Callable[[Path], Any]) -> None:
        self._enter = enter

    def make(self, rng: Any, folder: Path) -> tuple[Path, str]:
        raise AssertionError(self.__doc__)

    def enter(self, path: Path) -> None:
        self._enter(path)


def refused(enter: Callable[[Path], Any], path: Path) -> str:
    """The message with which `path` is refused."""
    told: list[str] = []

    def entered(given: Path) -> None:
        try:
            enter(given)
        except Exception as error:
            told.append(str(error))
            raise

    before = _resident()
    verdict: Verdict = attempt(Entry(entered), path, 0, "")
    assert verdict.end == "refused", verdict
    assert verdict.memory - before < MOST_GROWTH, (verdict, before)
    return told[0]


def _resident() -> int:
    """Memory that this process holds now [bytes]; where the system does not say, its peak."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    return pages * resource.getpagesize()
