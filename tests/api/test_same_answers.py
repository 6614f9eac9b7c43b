"""Answers depend neither on where large arrays lie nor on who does the work, to the last bit."""

import os
import signal
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
import pytest

import excite_cli.out_of_core
from excite_cli import diagnose, identify, load_data
from excite_cli.workers.processes import Processes
from tests.api.conftest import Loop


def same(one: Any, other: Any) -> bool:
    """Whether two records hold the same to the last bit."""
    if is_dataclass(one) and not isinstance(one, type):
        names = [each.name for each in fields(one) if each.name not in {"seconds"}]
        return all(same(getattr(one, name), getattr(other, name)) for name in names)
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[k], other[k]) for k in one)
    if isinstance(one, tuple | list):
        return len(one) == len(other) and all(map(same, one, other))
    return one is other or one == other or one != one


class Deadly(Processes):
    """Two processes, one of which is killed before the second round of tasks."""

    rounds, killed = 0, False

    def map(self, *arguments: Any, **options: Any) -> list[Any]:
        self.rounds += 1
        if self.rounds == 2:
            os.kill(self.pids[0], signal.SIGKILL)
            self.killed = True
        return super().map(*arguments, **options)


@pytest.mark.long
@pytest.mark.parametrize("task", [identify, diagnose])
def test_the_same_on_disk_and_on_two_processes_of_which_one_dies(
    task: Any, loop: Loop, monkeypatch: pytest.MonkeyPatch
) -> None:
    alone = task(loop.problem, load_data(loop.problem, loop.data))
    with Deadly(2) as workers:
        shared = task(loop.problem, loop.data, workers=workers)
        assert workers.killed
        assert workers.rounds > 5
    assert same(alone, shared)
    monkeypatch.setattr(excite_cli.out_of_core, "ROOM", 0)  # every array on disk
    assert same(alone, task(loop.problem, load_data(loop.problem, loop.data)))
