"""Worker processes on this machine; one that dies is replaced and its task done again.

Each task under way has a thread of a `ThreadPoolExecutor`, which gives it to an idle process and
waits for the answer. Every process has a socket of its own, so a death concerns the task that it
was doing, nothing else; in the pools of `concurrent.futures` and loky it is the end of all.
"""

import json
import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from contextlib import contextmanager
from hashlib import sha256
from multiprocessing.connection import Connection
from threading import Lock
from typing import Any

import numpy as np

from excite_cli.out_of_core import Spool
from excite_cli.workers.base import (
    POSSIBLE,
    Answer,
    Function,
    Give,
    LostWorkersError,
    NoWorkersError,
    Tell,
    Workers,
    packed,
)
from excite_cli.workers.worker_main import share_heap

# The parent's path of imports comes first, so that a checkout finds itself; until it is set, `-P`
# keeps the current folder out: a json.py that lies there is no part of us.
_BOOT = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[2]); "
    "from excite_cli.workers.worker_main import serve; "
    "serve(int(sys.argv[1]), json.loads(sys.argv[3]))"
)
_OURS, _NOT_NEEDED = "excite_cli.", "excite_cli.cli."
_THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
LOSSES = 3  # times that a task may take its worker with it before it is given up


class _Process:
    """A process of ours and the socket to it."""

    def __init__(self, threads: int) -> None:
        ours, theirs = socket.socketpair()
        # What we have imported may be needed for tasks: it is imported before they come.
        modules = [each for each in list(sys.modules) if each.startswith(_OURS)]
        modules = [each for each in modules if not each.startswith(_NOT_NEEDED)]
        with ours, theirs:
            descriptor = theirs.fileno()
            arguments = (str(descriptor), json.dumps(sys.path), json.dumps(modules))
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-c", _BOOT, *arguments],
                pass_fds=[descriptor],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,  # stdout is the answer of the command
                env={**os.environ, **dict.fromkeys(_THREAD_VARIABLES, str(threads))},
                process_group=0,  # Ctrl-C is for the parent
            )
            self._connection = Connection(ours.detach())
        self.pid, self.kill = self._process.pid, self._process.kill
        self.ready = False

    def answer(self, job: bytes, tell: Tell) -> Answer:
        """What becomes of a task; `OSError` or `EOFError` if the process ends before."""
        self._connection.send_bytes(job)
        while True:
            kind, value = self._connection.recv()
            if kind == "ready":
                self.ready = True
            elif kind == "told":
                tell(value)
            else:
                return kind, value

    def end(self) -> str:
        """Kill it, unless it has ended by itself; in words, how it ended."""
        self.kill()
        status = self._process.wait()
        return f"killed by signal {-status}" if status < 0 else f"exit status {status}"


class Processes(Workers):
    """`count` processes, each with `threads` threads of linear algebra; started when needed."""

    reads_our_files = POSSIBLE

    def __init__(self, count: int, threads: int = 1) -> None:
        self._count, self._threads = count, threads
        self._all: set[_Process] = set()
        self._idle: list[_Process] = []
        self._lock, self._closing = Lock(), False
        share_heap()

    @property
    def count(self) -> int:
        """Number of processes."""
        return self._count

    @property
    def pids(self) -> tuple[int, ...]:
        """Process ids of the workers that are running."""
        return tuple(process.pid for process in self._all)

    def begin(self) -> None:
        """Start the processes."""
        self._closing = False
        self._idle = [self._taken() for _ in range(self._count)]

    def close(self) -> None:
        """End all processes."""
        with self._lock:
            self._closing, ending = True, self._all
            self._all, self._idle = set(), []
        for process in ending:
            process.kill()  # all of them at once, then wait
        for process in ending:
            process.end()

    @contextmanager
    def _round(self, function: Function, shared: Any) -> Iterator[Give]:
        spool, self._closing = Spool(0), False
        blob = packed(shared, spool)
        key, common = sha256(blob).hexdigest(), spool.keep(np.frombuffer(blob, np.uint8))

        def give(task: Any, tell: Tell) -> Future[Answer]:
            job = packed((key, common, packed((function, task), spool)))
            return threads.submit(self._done, job, tell)

        with ThreadPoolExecutor(self._count) as threads:
            try:
                yield give
            except BaseException:
                self.close()  # tasks may be running whose results are of no use any more
                raise

    def _done(self, job: bytes, tell: Tell) -> Answer:
        """In a thread: have it done by an idle process, or by another one if that dies."""
        for _ in range(LOSSES):
            process = self._taken()
            try:
                answer = process.answer(job, tell)
            except (EOFError, OSError):
                how = process.end()
                self._all.discard(process)
                continue
            self._idle.append(process)
            return answer
        if process.ready:
            raise LostWorkersError(
                f"{LOSSES} times its worker ended while doing it ({how}). Often memory is short: "
                "take fewer --workers."
            )
        raise NoWorkersError(
            f"Workers cannot be started: {LOSSES} ended at once ({how}). Run without --workers, or "
            "take fewer."
        )

    def _taken(self) -> _Process:
        """An idle process, else a new one."""
        with self._lock:
            if self._closing:
                raise CancelledError
            if self._idle:
                return self._idle.pop()
            process = _Process(self._threads)
            self._all.add(process)
            return process
