"""Many independent tasks, done somewhere: what all kinds of workers have in common.

A task is an argument of a function that can be imported by name, `function(shared, task, tell)`.
`shared` is the same for all tasks and reaches every worker once. What a function returns may
depend on its arguments only: then it does not matter where, when and in which order tasks are
done, nor whether one is done twice because a worker was lost.
"""

import io
import pickle
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sized
from concurrent.futures import Future
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from queue import SimpleQueue
from typing import Any, Self

import numpy as np

from excite_cli.errors import ExciteError
from excite_cli.out_of_core import Spool, attached, reference_to
from excite_cli.shown.note import unheard

# Messages between processes of one machine, in which large arrays are named and not copied.
#
# An array that lies in a file of this process (`out_of_core`) travels as the place in that file,
# and the other process maps it. What lies in memory and is large is written to such a file first.

# Bytes of an array that is written to a file, and of one that lies in one already.
_LARGE, _WORTH_NAMING = 2**18, 2**12
POSSIBLE = Path("/proc/self/fd").is_dir()


def packed(message: Any, spool: Spool | None = None) -> bytes:
    """A pickle of `message`; with a `spool`, which is to live until it is read, of little size."""
    if not POSSIBLE:
        return pickle.dumps(message, pickle.HIGHEST_PROTOCOL)
    buffer = io.BytesIO()
    _Packer(buffer, spool).dump(message)
    return buffer.getvalue()


class _Packer(pickle.Pickler):
    def __init__(self, buffer: io.BytesIO, spool: Spool | None) -> None:
        super().__init__(buffer, pickle.HIGHEST_PROTOCOL)
        self._spool = spool

    def reducer_override(self, value: Any) -> Any:
        if type(value) is not np.ndarray or value.nbytes < _WORTH_NAMING or value.dtype.hasobject:
            return NotImplemented
        if not any(value.strides):  # one value, repeated
            return np.broadcast_to, (value.flat[0], value.shape)
        if self._spool is not None and value.nbytes >= _LARGE:
            value = self._spool.keep(value)
        reference = reference_to(value)
        return NotImplemented if reference is None else (attached, (reference,))


Tell = Callable[[Any], None]
Function = Callable[[Any, Any, Tell], Any]
Answer = tuple[str, Any]  # ("done", result) or ("failed", error)
Give = Callable[[Any, Tell], Any]  # (task, tell) → a future of its answer


class LostWorkersError(ExciteError):
    """A task takes its worker with it each time."""


class NoWorkersError(ExciteError):
    """There are no workers, or they cannot do our tasks."""


@dataclass(frozen=True)
class News:
    """What happened last: task `index` told `word` while it runs, or ended with `result`.

    With `keep_failures` the result may be an exception.

    `done` of `total` tasks are done, `running` are being done.
    """

    done: int
    running: int
    total: int
    index: int
    word: Any = None
    result: Any = None


Watch = Callable[[News], None]


class Workers(ABC):
    """A place where tasks are done; to be closed, best with `with`."""

    reads_our_files = False  # what lies on the disk of this process is named, and not copied
    in_this_thread = False

    @property
    @abstractmethod
    def count(self) -> int:
        """How many tasks are done at once."""

    @property
    def ahead(self) -> int:
        """How many tasks are given at once."""
        return self.count

    def map(
        self,
        function: Function,
        shared: Any,
        tasks: Iterable[Any],
        watch: Watch = unheard,
        *,
        keep_failures: bool = False,
    ) -> list[Any]:
        """`function(shared, task, tell)` of every task, in their order.

        The next of `tasks` is taken when a worker is there to do it. `watch` is called in the
        caller's thread whenever a task ends or tells a word. If tasks raise, the exception of the
        first one (in their order) is raised, and the rest is not done; with `keep_failures` an
        exception stands in the place of a result, and the rest is done.

        Raises
        ------
        LostWorkersError
            A task takes its worker with it each time.
        NoWorkersError
            There are no workers, or they cannot do our tasks.
        """
        total = len(tasks) if isinstance(tasks, Sized) else None
        if total == 0:
            return []
        state = _Map(self, watch, total, keep_failures)
        heard: SimpleQueue[tuple[int, Any, Any]] = SimpleQueue()  # task, its word or its future
        source = enumerate(tasks)

        def tell(index: int) -> Tell:
            if self.in_this_thread:
                return partial(state.hear, index)
            return lambda word: heard.put((index, word, None))

        with self._round(function, shared) as give:
            while True:
                while len(state.running) < self.ahead and not state.failures:
                    index, task = next(source, (-1, None))
                    if index < 0:
                        break
                    state.running.add(index)
                    future = give(task, tell(index))
                    future.add_done_callback(lambda it, k=index: heard.put((k, None, it)))
                if not state.awaited:
                    break
                state.hear(*heard.get())
            if state.failures:
                raise state.failures[min(state.failures)]
        return [state.results[index] for index in sorted(state.results)]

    @abstractmethod
    def _round(self, function: Function, shared: Any) -> AbstractContextManager[Give]:
        """Within the block, how a task is given; what still runs at its end is dropped."""

    def answer(self, future: Any) -> Answer:
        """What became of a task that has ended, or raises `LostWorkersError`."""
        return future.result()

    def begin(self) -> None:  # noqa: B027 - most need not
        """Make ready for the first tasks, where that takes a while; not needed."""

    @abstractmethod
    def close(self) -> None:
        """End the workers; what they are doing is dropped."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        self.close()


@dataclass
class _Map:
    """The state of one `map`."""

    workers: Workers
    watch: Watch
    total: int | None
    keep_failures: bool
    running: set[int] = field(default_factory=set)
    results: dict[int, Any] = field(default_factory=dict)
    failures: dict[int, Exception] = field(default_factory=dict)

    @property
    def awaited(self) -> bool:
        """Whether a task runs whose end matters: after a failure, only those before it do."""
        return any(index < min(self.failures, default=index + 1) for index in self.running)

    def hear(self, index: int, word: Any, ended: Any = None) -> None:
        """A word of a task, or the future of one that has ended."""
        given = len(self.results) + len(self.failures) + len(self.running)
        total = given if self.total is None else self.total
        result = None
        if ended is not None:
            self.running.discard(index)
            try:
                kind, result = self.workers.answer(ended)
            except LostWorkersError as error:
                text = f"Task {index + 1} of {total} was given up: {error}"
                kind, result = "failed", LostWorkersError(text)
            if isinstance(result, NoWorkersError):
                raise result
            if kind == "failed" and not self.keep_failures:
                self.failures[index] = result
                return
            self.results[index] = result
        running = min(len(self.running), self.workers.count)
        self.watch(News(len(self.results), running, total, index, word, result))


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
