"""Worker processes on this machine; one that dies is replaced and its task done again.

`concurrent.futures` has a pool too, but there the death of one process is the end of all. Here
every worker has a socket of its own, so a death concerns the task that it was doing, nothing else.
"""

import contextlib
import json
import os
import socket
import subprocess
import sys
from collections import deque
from collections.abc import Iterable, Iterator, Sequence, Sized
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from typing import Any

from excite_cli.out_of_core import Spool
from excite_cli.workers.base import (
    LOSSES,
    POSSIBLE,
    Function,
    LostWorkersError,
    News,
    Watch,
    Workers,
    packed,
    unwatched,
)

# The parent's path of imports comes first, so that a checkout finds itself; until it is set, `-P`
# keeps the current folder out: a json.py that lies there is no part of us.
_BOOT = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[3]); "
    "from excite_cli.workers.worker_main import serve; "
    "serve(int(sys.argv[1]), int(sys.argv[2]), json.loads(sys.argv[4]))"
)
_OURS, _NOT_NEEDED = "excite_cli.", "excite_cli.cli."
_THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
_PATIENCE = 1.0  # [s] that a worker has to end


class _Worker:
    """One process with the socket to it; `task` is what it does, `knows` what it was sent."""

    def __init__(self, threads: int) -> None:
        ours, theirs = socket.socketpair()
        with ours, theirs:
            descriptor, path = theirs.fileno(), json.dumps(sys.path)
            modules = json.dumps([name for name in sys.modules if _of_tasks(name)])
            self.process = subprocess.Popen(
                [sys.executable, "-P", "-c", _BOOT, str(descriptor), str(threads), path, modules],
                pass_fds=[descriptor],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,  # stdout is the answer of the command
                env={**os.environ, **dict.fromkeys(_THREAD_VARIABLES, str(threads))},
                process_group=0,  # Ctrl-C is for the parent
            )
            self.connection = Connection(ours.detach())
        self.ready = False
        self.knows: bytes | None = None
        self.task: int | None = None

    def end(self) -> int | None:
        """Close the socket, which ends the process; its exit status."""
        with contextlib.suppress(OSError):
            self.connection.close()
        try:
            return self.process.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            return self.process.wait()


@dataclass
class _Round:
    """The state of one `map`."""

    function: Function
    shared: bytes
    source: Iterator[Any]
    total: int | None
    watch: Watch
    keep_failures: bool
    spool: Spool
    tasks: list[Any] = field(default_factory=list)
    waiting: deque[int] = field(default_factory=deque)
    results: dict[int, Any] = field(default_factory=dict)
    failures: dict[int, Exception] = field(default_factory=dict)
    losses: dict[int, int] = field(default_factory=dict)
    running: int = 0
    ended: bool = False

    def tell(self, index: int, word: Any = None, result: Any = None) -> None:
        total = len(self.tasks) if self.total is None else self.total
        self.watch(News(len(self.results), self.running, total, index, word, result))

    def done(self, index: int, result: Any) -> None:
        """Keep a result, and tell."""
        self.results[index] = result
        self.tell(index, result=result)

    def fail(self, index: int, error: Exception) -> None:
        """Tasks are handed out in order: what comes after a failure need not be begun."""
        if self.keep_failures:
            self.done(index, error)
        else:
            self.failures[index] = error
            self.waiting = deque(each for each in self.waiting if each < index)
            self.ended = True

    def take(self) -> int | None:
        """The next task, taken from the source when a worker is there to do it."""
        if self.waiting:
            return self.waiting.popleft()
        if self.ended:
            return None
        try:
            self.tasks.append(next(self.source))
        except StopIteration:
            self.ended = True
            return None
        self.ended = len(self.tasks) == self.total
        return len(self.tasks) - 1


class Processes(Workers):
    """`count` processes, each with `threads` threads of linear algebra; started when needed."""

    def __init__(self, count: int, threads: int = 1) -> None:
        self._count, self._threads = count, threads
        self._workers: list[_Worker] = []
        self._failed_starts = 0

    @property
    def count(self) -> int:
        """Number of processes."""
        return self._count

    @property
    def pids(self) -> tuple[int, ...]:
        """Process ids of the workers that are running."""
        return tuple(worker.process.pid for worker in self._workers)

    def map(
        self,
        function: Function,
        shared: Any,
        tasks: Iterable[Any],
        watch: Watch = unwatched,
        *,
        keep_failures: bool = False,
    ) -> list[Any]:
        """As `Workers.map`; the next of `tasks` is taken when a worker is there to do it."""
        total = len(tasks) if isinstance(tasks, Sized) else None
        if total == 0:
            return []
        spool = Spool(0)
        round_ = _Round(
            function, packed(shared, spool), iter(tasks), total, watch, keep_failures, spool
        )
        try:
            self._start(self._count if total is None else total)
            for worker in list(self._workers):
                self._hand_out(worker, round_)
            while self._awaited(round_):
                for connection in wait([worker.connection for worker in self._workers]):
                    worker = next(w for w in self._workers if w.connection is connection)
                    self._listen(worker, round_)
        except BaseException:
            self.close()  # tasks may be running that nobody waits for any more
            raise
        if round_.failures:
            self._drop_running()
            raise round_.failures[min(round_.failures)]
        return [round_.results[index] for index in range(len(round_.tasks))]

    @property
    def reads_our_files(self) -> bool:
        """Where the system has /proc."""
        return POSSIBLE

    def begin(self) -> None:
        """Start the processes."""
        self._start(self._count)

    def _start(self, needed: int) -> None:
        while len(self._workers) < min(self._count, needed):
            self._workers.append(_Worker(self._threads))

    def close(self) -> None:
        """End all processes."""
        _end(self._workers)
        self._workers = []

    def _awaited(self, round_: _Round) -> bool:
        """Whether a task is open whose end matters: after a failure, only those before it do."""
        if round_.waiting or not round_.ended:
            return True
        first = min(round_.failures, default=len(round_.tasks))
        return any(worker.task is not None and worker.task < first for worker in self._workers)

    def _drop_running(self) -> None:
        """End the processes that are at work; the idle ones stay."""
        _end([worker for worker in self._workers if worker.task is not None])
        self._workers = [worker for worker in self._workers if worker.task is None]

    def _hand_out(self, worker: _Worker, round_: _Round) -> None:
        """Send the next task to a worker that is ready and idle."""
        if not worker.ready or worker.task is not None or (index := round_.take()) is None:
            return
        worker.task = index
        round_.running += 1
        body = packed((round_.function, round_.tasks[index]), round_.spool)
        try:
            if worker.knows != round_.shared:
                worker.connection.send(("shared", round_.shared))
                worker.knows = round_.shared
            worker.connection.send(("task", body))
        except OSError:
            self._replace(worker, round_)

    def _listen(self, worker: _Worker, round_: _Round) -> None:
        """Take one message of a worker, or notice that it is gone."""
        try:
            kind, value = worker.connection.recv()
        except (EOFError, OSError):
            self._replace(worker, round_)
            return
        if kind == "ready":
            worker.ready, self._failed_starts = True, 0
        else:
            assert worker.task is not None
            index = worker.task
            if kind == "told":
                round_.tell(index, word=value)
                return
            worker.task = None
            round_.running -= 1
            if kind == "failed":
                round_.fail(index, value)
            else:
                round_.done(index, value)
        self._hand_out(worker, round_)

    def _replace(self, worker: _Worker, round_: _Round) -> None:
        """A new worker for one that died; its task comes next.

        Raises
        ------
        LostWorkersError
            Workers cannot be started.
        """
        status = worker.end()
        if worker.task is not None:
            index = worker.task
            round_.running -= 1
            round_.losses[index] = round_.losses.get(index, 0) + 1
            if round_.losses[index] >= LOSSES:
                lost = LostWorkersError(
                    f"Task {index + 1} of {len(round_.tasks)} was given up: {LOSSES} times its "
                    f"worker ended while doing it ({_words(status)}). Often memory is short: take "
                    "fewer --workers."
                )
                round_.fail(index, lost)
            elif not any(failed < index for failed in round_.failures):
                round_.waiting.appendleft(index)
        elif not worker.ready:
            self._failed_starts += 1
            if self._failed_starts >= LOSSES:
                raise LostWorkersError(
                    f"Workers cannot be started: {LOSSES} ended at once ({_words(status)}). Run "
                    "without --workers, or take fewer."
                )
        self._workers[self._workers.index(worker)] = _Worker(self._threads)


def _of_tasks(module: str) -> bool:
    """Whether a module may be needed for tasks, so that a worker imports it before they come."""
    return module.startswith(_OURS) and not module.startswith(_NOT_NEEDED)


def _end(workers: Sequence[_Worker]) -> None:
    for worker in workers:
        with contextlib.suppress(OSError):
            worker.connection.close()  # all of them at once, then wait
    for worker in workers:
        worker.end()


def _words(status: int | None) -> str:
    if status is not None and status < 0:
        return f"killed by signal {-status}"
    return f"exit status {status}"
