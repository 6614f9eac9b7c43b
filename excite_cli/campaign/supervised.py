"""A program that runs under a supervisor, as its campaign sees it: followed to its very end."""

import json
import os
import select
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict
from math import inf
from pathlib import Path
from types import FrameType
from typing import Any, BinaryIO

from excite_cli.campaign.one_at_a_time import left_in, session_of
from excite_cli.campaign.process_table import MARK, Escalation, in_words
from excite_cli.campaign.supervisor import Job, ProgramExit
from excite_cli.robot.confinement import command

# Signals that ask this process to end are counted, and delivered once something else has ended.
#
# Raised at any instant, as Python does it for Ctrl-C, they would cut off whatever ends the robot's
# program; and the second one would cut off what the first one began.

_ASK_TO_END = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)


class Held:
    """Signals that came: `count`, and which was the `first` (0: none did)."""

    count = 0
    first = 0

    def _note(self, number: int, frame: FrameType | None) -> None:
        self.count += 1
        self.first = self.first or number

    def deliver(self) -> None:
        """Let the first signal do what it would have done, after `held_signals` has ended."""
        if not self.first:
            return
        handler = signal.getsignal(self.first)
        if callable(handler):
            handler(self.first, None)
        else:
            os.kill(os.getpid(), self.first)


@contextmanager
def held_signals() -> Iterator[Held]:
    """Count SIGINT, SIGTERM, SIGHUP and SIGQUIT, but for those that are ignored.

    Only the main thread hears signals: in another one nothing is held, and nothing needs to be.
    """
    held = Held()
    before = {each: signal.getsignal(each) for each in _ASK_TO_END}
    mine = [each for each, handler in before.items() if handler not in (signal.SIG_IGN, None)]
    try:
        for each in mine:
            signal.signal(each, held._note)
    except ValueError:
        mine = []
    try:
        yield held
    finally:
        if mine:
            signal.pthread_sigmask(signal.SIG_BLOCK, mine)
            for each in mine:
                signal.signal(each, before[each])
            signal.pthread_sigmask(signal.SIG_UNBLOCK, mine)


_POLL = 0.1  # s
_SILENT = 5.0  # s beyond what an end takes, after which the supervisor counts as lost
News = dict[str, Any]
Say = Callable[[str], None]


class CannotRunError(Exception):
    """The program cannot be run; the argument says why."""


class _LostError(Exception):
    """The supervisor is gone without a word, or silent: it was killed or stopped."""


def followed(job: Job, diary: BinaryIO, held: Held, say: Say) -> ProgramExit:
    """Run the program until nothing of it runs, or what cannot be ended is known.

    Every signal that is `held` asks for its end. So does any exception in here, which is raised
    again after it.

    Raises
    ------
    CannotRunError
        There is no such program, or it may not be run.
    """
    program = _Supervised(job, diary)
    try:
        ended = _to_its_end(program, job, held, say)
    except CannotRunError:
        program.wait()
        raise
    except _LostError:
        return _ended_without_supervisor(program, job, held)
    except BaseException:
        if not _end_whatever_comes(program, job, held).alive:
            program.wait()
        raise
    if not ended.alive:  # else the supervisor stays, and with it the lock
        program.wait()
    return ended


class _Supervised:
    def __init__(self, job: Job, diary: BinaryIO) -> None:
        self._socket, theirs = socket.socketpair()
        self._text = b""
        with theirs:
            self._process = subprocess.Popen(
                command("excite_cli.campaign.supervisor"),
                stdin=theirs.fileno(),
                stdout=diary,
                stderr=subprocess.STDOUT,
                env={**os.environ, MARK: str(Path(job.log).resolve())},
                start_new_session=True,
                pass_fds=(job.lock,),
            )
        with suppress(OSError):
            self._socket.sendall(json.dumps(asdict(job)).encode() + b"\n")

    def request_end(self) -> None:
        """SIGTERM to all of the program; the second time SIGKILL."""
        with suppress(OSError):  # `news` finds out
            self._socket.sendall(b".")

    def news(self) -> News | None:
        """What the supervisor says next, if it says something soon."""
        while b"\n" not in self._text:
            if not select.select([self._socket], [], [], _POLL)[0]:
                return None
            more = b""
            with suppress(OSError):
                more = self._socket.recv(4096)
            if not more:
                raise _LostError
            self._text += more
        line, self._text = self._text.split(b"\n", 1)
        found: News = json.loads(line)
        return found

    def wait(self) -> None:
        """For the supervisor's own end."""
        self._socket.close()
        self._process.wait()

    def kill(self) -> None:
        """End the supervisor itself, if it is only silent."""
        self._socket.close()
        self._process.kill()
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(_SILENT)


def _to_its_end(program: _Supervised, job: Job, held: Held, say: Say) -> ProgramExit:
    asked, lost = 0, inf
    while True:
        while asked < held.count:
            asked += 1
            program.request_end()
            lost = min(lost, time.monotonic() + job.grace + _SILENT)
            if asked == 1:
                text = (
                    "the program is asked to stop the robot and to end (SIGTERM). In "
                    f"{job.grace:g} s all of it is ended by force (SIGKILL); Ctrl-C again does "
                    "that at once"
                )
                with suppress(Exception):  # to a terminal that has closed, say
                    say(text)
        news = program.news()
        if news is None:
            if time.monotonic() > lost:
                raise _LostError
        elif "cannot" in news:
            raise CannotRunError(news["cannot"])
        elif "waits" in news:
            say(
                f"the program has ended, and left running: {news['waits']}. The next motion waits "
                f"for that; what still runs in {job.grace:g} s is ended"
            )
        else:
            return ProgramExit(**news)


def _end_whatever_comes(program: _Supervised, job: Job, held: Held) -> ProgramExit:
    """Asked to end once more for everything that is raised meanwhile."""
    while True:
        try:
            held.count += 1
            return _to_its_end(program, job, held, lambda text: None)
        except (_LostError, CannotRunError):
            return _ended_without_supervisor(program, job, held)
        except BaseException:
            continue


def _ended_without_supervisor(program: _Supervised, job: Job, held: Held) -> ProgramExit:
    """End what can be found of a program that has lost its supervisor."""
    folder = Path(job.log).parent
    ending = Escalation(lambda: left_in(folder), session_of(folder), job.grace)
    before = min(held.count, 1)
    ending.request()
    while left_in(folder) and not ending.in_vain:
        if held.count > before:
            before = held.count
            ending.request()
        ending.step()
        time.sleep(_POLL)
    program.kill()
    return ProgramExit(None, "lost", alive=in_words(left_in(folder)))
