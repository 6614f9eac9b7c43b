"""The default: tasks are done one after the other in this process."""

from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from typing import Any

from excite_cli.workers.base import Answer, Function, Give, Tell, Workers


class Here(Workers):
    """No other process; what a task raises ends the rest."""

    count = 1
    in_this_thread = True

    @contextmanager
    def _round(self, function: Function, shared: Any) -> Iterator[Give]:
        def give(task: Any, tell: Tell) -> Future[Answer]:
            future: Future[Answer] = Future()
            try:
                future.set_result(("done", function(shared, task, tell)))
            except Exception as error:  # raised again by `map`, or kept
                future.set_result(("failed", error))
            return future

        yield give

    def close(self) -> None:
        """Nothing to end."""
