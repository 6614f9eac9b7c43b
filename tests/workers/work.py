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


def later_first(shared: float, task: int, tell: Tell) -> int:
    """The first tasks take longest."""
    time.sleep(shared / (1 + task))
    return task


def fails(shared: Any, task: int, tell: Tell) -> int:
    if task == shared:
        time.sleep(0.2)
        raise ConfigError(f"task {task} is wrong")
    if task > shared:
        raise ConfigError("a later one, sooner")
    return task


def fails_beside_a_long_one(shared: Any, task: int, tell: Tell) -> int:
    if task:
        time.sleep(60.0)
    time.sleep(0.2)
    raise ConfigError("the first is wrong")


def long_winded(shared: Any, task: int, tell: Tell) -> int:
    raise LongWindedError("no way", task)


def bug(shared: Any, task: int, tell: Tell) -> int:
    return {}["nothing"]


def dies_once(shared: str, task: int, tell: Tell) -> int:
    """Kills its process in the middle of the work; the first attempt of every task."""
    mark = Path(shared) / f"tried_{task}"
    if not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return task**2


def always_dies(shared: Any, task: int, tell: Tell) -> int:
    os.kill(os.getpid(), signal.SIGKILL)
    return task


def begun(folder: str, task: int, tell: Tell) -> int:
    """The process that did it: it says that it has begun, and waits for the file `go`."""
    (Path(folder) / f"{os.getpid()}.begun").touch()
    while not (Path(folder) / "go").exists():
        time.sleep(0.01)
    return os.getpid()


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
