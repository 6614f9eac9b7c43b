"""Functions that the workers of the tests import."""

import os
import signal
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_info

from excite_cli.errors import ConfigError, NoAdmissibleMotionError
from excite_cli.workers.base import Tell


class LongWindedError(NoAdmissibleMotionError):
    """An error that does not survive a pickle."""

    def __init__(self, message: str, detail: int) -> None:
        super().__init__(message)
        self.detail = detail


def square(shared: int, task: int, tell: Tell) -> int:
    tell(f"at {task}")
    return shared + task**2


def fails(shared: int, task: int, tell: Tell) -> int:
    if task >= shared:
        raise ConfigError(f"task {task} is wrong")
    return task


def long_winded(shared: Any, task: int, tell: Tell) -> int:
    raise LongWindedError("no way", task)


def bug(shared: Any, task: int, tell: Tell) -> int:
    return {}["nothing"]


def unpicklable(shared: Any, task: int, tell: Tell) -> Any:
    return lambda: None


def forever(shared: Any, task: int, tell: Tell) -> None:
    tell("begun")
    while True:
        signal.pause()


def after_the_next(folder: str, task: int, tell: Tell) -> int:
    """Even tasks wait until the next one is done; 10 fails then, and 11 never ends."""
    (Path(folder) / f"{task}").touch()
    while task % 2 == 0 and not (Path(folder) / f"{task + 1}").exists():
        time.sleep(0.01)
    if task == 10:
        raise ConfigError("the first is wrong")
    return task if task != 11 else forever(None, task, tell)


def dies_once(shared: str, task: int, tell: Tell) -> int:
    """Kills its process in the middle of the work; the first attempt of every task."""
    mark = Path(shared) / f"tried_{task}"
    if not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return task**2


def always_dies_at(shared: int, task: int, tell: Tell) -> int:
    if task == shared:
        os.kill(os.getpid(), signal.SIGKILL)
    return task


def search_path(shared: Any, task: Any, tell: Tell) -> list[str]:
    return sys.path


def threads(shared: Any, task: int, tell: Tell) -> list[int]:
    np.linalg.qr(np.eye(3))
    return [each["num_threads"] for each in threadpool_info()]


def table(size: int, factor: float, tell: Tell) -> NDArray[np.float64]:
    return factor * np.arange(float(size))


def doubled_half(
    shared: None, values: NDArray[np.float64], tell: Tell
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """All of it doubled, and the second half of it as it came."""
    return 2.0 * values, values[len(values) // 2 :]


def imported(shared: str, task: int, tell: Tell) -> bool:
    """Whether a module is there that no task needs."""
    return shared in sys.modules
