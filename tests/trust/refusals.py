"""Hostile inputs must be refused: with one message, quickly, and without filling the memory."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.trust.fuzz_trial import Fuzzer, Verdict, attempt

MOST_GROWTH = 600 * 2**20  # bytes that a refusal may take at its peak, the whole process included


class _Entry(Fuzzer):
    name = "entry"

    def __init__(self, enter: Callable[[Path], Any]) -> None:
        self._enter = enter

    def make(self, rng: Any, folder: Path) -> tuple[Path, str]:
        raise AssertionError("this one is only entered: nothing is made for it")

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

    verdict: Verdict = attempt(_Entry(entered), path, 0, "")
    assert verdict.end == "refused", verdict
    assert verdict.memory < MOST_GROWTH, verdict
    return told[0]
