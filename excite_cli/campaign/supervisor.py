"""A process of its own that starts a measuring program, and outlives its campaign.

It adopts what the program starts, so that nothing can leave unseen: when it has no child any more,
nothing of the program runs. Until then it holds the lock of `one_at_a_time`. It keeps the limit of
time and records how the program ended, also where the campaign was killed meanwhile.

The campaign sends the job as one line, then a byte each time it asks for the program's end. News
come back as lines of JSON: `cannot` (the program cannot be run), `waits` (what a program that has
ended left running), and `ProgramExit`.
"""

import json
import os
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import partial
from math import inf
from pathlib import Path
from types import FrameType
from typing import Any

from excite_cli.campaign.process_table import (
    Escalation,
    Process,
    adopt_orphans,
    boot,
    descendants,
    in_group,
    in_words,
    start_of,
)
from excite_cli.campaign.same_motion import record_measured
from excite_cli.errors import ExciteError

_POLL, _KILLING, _IN_VAIN = 0.2, 0.02, 1.0  # s
_HEEDED = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)


@dataclass(frozen=True)
class Job:
    """What is to be run, and the log that it writes.

    `limit` [s]; `grace` [s] to stop the robot in; `lock`: the descriptor of the lock.
    """

    words: tuple[str, ...]
    log: str
    limit: float
    grace: float
    lock: int


@dataclass(frozen=True)
class ProgramExit:
    """How a program ended, in words where it is about processes.

    `status`: as of `subprocess`, None where it still runs. `why`: `limit` or `asked` where it was
    ended. `left`: what ran on after it, and was ended; `alive`: what could not be ended. `fault`:
    why its end could not be recorded.
    """

    status: int | None
    why: str = ""
    left: str = ""
    alive: str = ""
    fault: str = ""


def serve() -> None:
    """The process: its socket is the standard input, what the program says its output."""
    wake, woken = socket.socketpair()
    wake.setblocking(False)
    woken.setblocking(False)
    for each in (*_HEEDED, signal.SIGCHLD):
        if signal.getsignal(each) is not signal.SIG_IGN:  # as `nohup` does
            signal.signal(each, _noted)
    signal.set_wakeup_fd(wake.fileno())
    with socket.socket(fileno=os.dup(0)) as campaign:
        line = campaign.makefile("rb", buffering=0).readline()
        if line:
            given = json.loads(line)
            _Supervisor(Job(tuple(given.pop("words")), **given), campaign, woken).run()


def _noted(number: int, frame: FrameType | None) -> None:
    """The signal is read from the wakeup descriptor."""


class _Supervisor:
    def __init__(self, job: Job, campaign: socket.socket, woken: socket.socket) -> None:
        self._job, self._campaign, self._woken = job, campaign, woken
        self._heard: list[socket.socket] = [campaign, woken]
        self._status: int | None = None
        self._why = self._left = ""
        self._reported = False

    def run(self) -> None:
        """Start the program, and be there until nothing of it is."""
        adopts = adopt_orphans()
        try:
            program = subprocess.Popen(
                self._job.words,
                stdin=subprocess.DEVNULL,
                start_new_session=True,
                pass_fds=(self._job.lock,),
            )
        except (OSError, ValueError) as error:
            self._say({"cannot": getattr(error, "strerror", None) or str(error)})
            return
        self._pid = program.pid
        program.returncode = 0  # it is waited for here
        self._note_session()
        find = partial(descendants, os.getpid()) if adopts else partial(in_group, self._pid)
        self._find, self._adopts = find, adopts
        self._escalation = Escalation(find, self._pid, self._job.grace)
        self._watch(time.monotonic() + self._job.limit)
        self._report([])

    def _note_session(self) -> None:
        """In the lock's file, for a campaign that finds neither us nor its own mark."""
        found = {"boot": boot(), "session": self._pid, "start": start_of(self._pid)}
        with suppress(OSError):
            os.ftruncate(self._job.lock, 0)
            os.pwrite(self._job.lock, json.dumps(found).encode(), 0)

    def _watch(self, due: float) -> None:
        """Until all is gone. `due`: when the program must have ended, or what it has left."""
        ending, ended = self._escalation, False
        while not self._all_gone():
            if ending.stage == 0:
                if self._status and not ended:
                    due = -inf
                elif self._status == 0 and not ended:
                    due = time.monotonic() + self._job.grace
                    self._say({"waits": in_words(self._find())})
                ended = self._status is not None
                if time.monotonic() >= due:
                    self._left = in_words(self._find()) if ended else ""
                    self._why = "" if ended else "limit"
                    ending.request()
            ending.step()
            if ending.in_vain and not self._reported:
                self._report(self._find())
            self._wait(due)

    def _wait(self, due: float) -> None:
        """For a signal, for the campaign, or until something is to be done."""
        pause = (_POLL, _POLL, _IN_VAIN if self._reported else _KILLING)[self._escalation.stage]
        if self._escalation.stage == 0 and self._status is None:
            pause = max(0.0, due - time.monotonic())
        asked = 0
        for each in select.select(self._heard, [], [], min(pause, 60.0))[0]:
            try:
                said = each.recv(64)
            except OSError:
                said = b""
            if not said:  # the campaign is gone: we stay
                self._heard.remove(each)
            elif each is self._campaign:
                asked += len(said)
            else:
                asked += sum(number in _HEEDED for number in said)
        for _ in range(asked):
            self._why = self._why or "asked"
            self._escalation.request()

    def _all_gone(self) -> bool:
        """Whether nothing of the program runs any more: exactly so where orphans are adopted."""
        while True:
            try:
                pid, status = os.waitpid(-1, os.WNOHANG)
            except ChildProcessError:
                return self._adopts or not self._find()
            if pid == 0:
                return False
            if pid == self._pid:
                self._status = os.waitstatus_to_exitcode(status)

    def _report(self, alive: Sequence[Process]) -> None:
        """How it ended, once; that it ended well is first recorded on the disk."""
        if self._reported:
            return
        self._reported, fault = True, ""
        log = Path(self._job.log)
        if self._status == 0 and not self._why and not alive and log.exists():
            try:
                record_measured(log)
            except ExciteError as error:
                fault = str(error)
        ended = ProgramExit(self._status, self._why, self._left, in_words(alive), fault)
        self._say(asdict(ended))

    def _say(self, news: dict[str, Any]) -> None:
        with suppress(OSError):
            self._campaign.sendall(json.dumps(news).encode() + b"\n")


if __name__ == "__main__":
    sys.exit("this is started by `excite campaign`")
