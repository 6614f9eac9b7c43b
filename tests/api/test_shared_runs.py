"""Runs that workers share: the same numbers to the last bit, whoever does them."""

import os
import signal
from collections.abc import Sequence
from typing import Any

import pytest

from excite_cli import diagnose, identify
from excite_cli.workers.base import Function, Watch, Workers, unwatched
from excite_cli.workers.processes import Processes
from tests.api.conftest import Loop
from tests.api.test_on_disk import same


class Deadly(Workers):
    """Two processes, one of which is killed in the middle of the second round of tasks."""

    def __init__(self) -> None:
        self.place, self.rounds, self.killed = Processes(2), 0, 0

    @property
    def count(self) -> int:
        return 2

    def map(
        self,
        function: Function,
        shared: Any,
        tasks: Sequence[Any],
        watch: Watch = unwatched,
        *,
        keep_failures: bool = False,
    ) -> list[Any]:
        self.rounds += 1
        if self.rounds == 2:
            self.killed = self.place.pids[0]
            os.kill(self.killed, signal.SIGKILL)
        return self.place.map(function, shared, tasks, watch, keep_failures=keep_failures)

    def close(self) -> None:
        self.place.close()


@pytest.mark.parametrize("task", [identify, diagnose])
def test_the_same_numbers_on_two_processes_of_which_one_dies(task: Any, loop: Loop) -> None:
    alone = task(loop.problem, loop.data)
    with Deadly() as workers:
        shared = task(loop.problem, loop.data, workers=workers)
        assert workers.killed
        assert workers.rounds > 5
    assert same(alone, shared)
