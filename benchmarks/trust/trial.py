"""One input tried: made, given to the entry that the commands use, and judged.

Good ends are `accepted` and `refused` (an `ExciteError` with a message that names the file and is
of a length that a person reads). Everything else is a fault: another exception, a signal, more
than `MOST_SECONDS`, more than `MOST_BYTES` of memory.
"""

import contextlib
import os
import resource
import signal
import time
import traceback
from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from excite_cli.errors import ConfigError, ExciteError

MOST_SECONDS = 10.0
MOST_BYTES = 2 * 2**30
LONGEST_MESSAGE = 8000  # characters
# Beyond what is allowed by so much, the machine is protected, and the fault still seen as ours.
_ADDRESS_SPACE = 12 * 2**30


class Fuzzer(ABC):
    """Random and hostile inputs of one parser.

    A fuzzer is prepared once (`bases` are made in a folder that all workers read), then makes
    input after input from a generator of random numbers, and hands each to the parser.
    """

    name: ClassVar[str]
    named: ClassVar[bool] = True  # messages must name the file; a ConfigError names its key

    def prepare(self, bases: Path) -> None:  # noqa: B027, many need nothing
        """Write the valid files that inputs are made from."""

    def open(self, bases: Path) -> None:  # noqa: B027
        """Load in a worker what every input needs."""

    @abstractmethod
    def make(self, rng: np.random.Generator, folder: Path) -> tuple[Path, str]:
        """Write an input into the empty `folder`; its path, and in a word how it was made."""

    @abstractmethod
    def enter(self, path: Path) -> None:
        """Do what the commands do with such a file."""


@dataclass(frozen=True)
class Verdict:
    """What came of one input: end is `accepted`, `refused` or the name of a fault."""

    index: int
    made: str
    end: str
    text: str
    seconds: float = 0.0
    cpu: float = 0.0
    memory: int = 0

    @property
    def good(self) -> bool:
        """Whether it ended as it should."""
        return self.end in ("accepted", "refused")


class _OutOfTime(BaseException):
    """Raised by the alarm; no `except Exception` of a reader holds it."""


def protect() -> None:
    """Limit what this process can take from the machine."""
    resource.setrlimit(resource.RLIMIT_AS, (_ADDRESS_SPACE, _ADDRESS_SPACE))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def generator(seed: int, fuzzer: Fuzzer, index: int) -> np.random.Generator:
    """Random numbers of one input; the same for the same seed, parser and index."""
    return np.random.default_rng([seed, *fuzzer.name.encode(), index])


def attempt(fuzzer: Fuzzer, path: Path, index: int, made: str) -> Verdict:
    """Hand `path` to the parser and judge what comes of it."""
    with contextlib.suppress(OSError):  # the kernel counts the peak anew, where it can
        Path("/proc/self/clear_refs").write_text("5")
    before, cpu = time.monotonic(), time.process_time()
    end, text = _ended(fuzzer, path)
    seconds, cpu = time.monotonic() - before, time.process_time() - cpu
    memory = _peak()
    if memory > MOST_BYTES:
        end, text = "memory", f"{memory / 2**30:.2f} GiB; {end}: {text}"
    return Verdict(index, made, end, text, seconds, cpu, memory)


def _ended(fuzzer: Fuzzer, path: Path) -> tuple[str, str]:
    try:
        with _alarm(MOST_SECONDS):
            fuzzer.enter(path)
    except ExciteError as error:
        return _told(fuzzer.named and not isinstance(error, ConfigError), path, str(error))
    except _OutOfTime as error:
        return "hang", _last(error)
    except (KeyboardInterrupt, SystemExit):
        raise
    except BaseException as error:
        return type(error).__name__, f"{str(error)[:300]} | {_last(error)}"
    return "accepted", ""


def _told(named: bool, path: Path, text: str) -> tuple[str, str]:
    if not text.strip():
        return "no message", ""
    if len(text) > LONGEST_MESSAGE:
        return "long message", f"{len(text)} characters: {text[:200]}"
    if named and path.name not in text and path.name.split(".")[0] not in text:
        return "file not named", text[:300]
    return "refused", text[:200]


def _last(error: BaseException) -> str:
    frames = traceback.extract_tb(error.__traceback__)[-4:]
    return " < ".join(f"{Path(f.filename).name}:{f.lineno}" for f in reversed(frames))


@contextmanager
def _alarm(seconds: float) -> Iterator[None]:
    def ring(number: int, frame: Any) -> None:
        raise _OutOfTime

    old = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, old)


def _peak() -> int:
    """Most memory held at once [bytes]."""
    with contextlib.suppress(OSError):
        for line in Path(f"/proc/{os.getpid()}/status").read_text(encoding="ascii").splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
