"""A program that runs under a supervisor, as its campaign sees it: followed to its very end."""

import fcntl
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

from excite_cli.campaign.measure import StillRunningError
from excite_cli.campaign.process_table import (
    MARK,
    Escalation,
    Process,
    boot,
    in_words,
    marked,
    of_session,
)
from excite_cli.campaign.supervisor import Job, ProgramExit
from excite_cli.errors import FileError, refusal
from excite_cli.robot.confinement import command
from excite_cli.shown.note import Level, Note, Tell

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
    ending = Escalation(lambda: left_in(folder), _noted(folder)[0], job.grace)
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


# One program at a time moves the robot, even after the campaign that started it was killed.
#
# Three things say that one still runs. Its supervisor holds a lock (on an open file, so that it
# lasts as long as the supervisor, whatever became of the campaign), and so does the program. Its
# processes have a mark in their environment. The lock's file names its session, and when that
# began.

_LOCK = ".moving.lock"
_POLL_OTHER = 0.2  # s
_SAID = 1.0  # s of waiting after which a person wants to know why


@contextmanager
def held_while_it_runs(folder: Path, patience: float, tell: Tell) -> Iterator[int]:
    """A descriptor for a program to inherit; waits for one of before that still runs.

    Raises
    ------
    StillRunningError
        A program of before still runs after `patience` [s].
    """
    path = folder / _LOCK
    try:
        handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as error:
        raise FileError(f"{path} cannot be written: {refusal(error)}") from error
    try:
        _wait_until_free(handle, folder, patience, tell)
        yield handle
    finally:
        os.close(handle)


def left_in(folder: Path) -> list[Process]:
    """What runs of programs that record into `folder`, as far as it can be found."""
    found = {each.pid: each for each in marked(folder)}
    session, start = _noted(folder)
    if session:
        found.update((each.pid, each) for each in of_session(session, start))
    return list(found.values())


def _noted(folder: Path) -> tuple[int, int]:
    """Session and its start as the supervisor noted them since the last boot; else 0, 0."""
    try:
        found = json.loads((folder / _LOCK).read_bytes())
        if found["boot"] and found["boot"] == boot():
            return int(found["session"]), int(found["start"])
    except (OSError, ValueError, KeyError, TypeError):
        pass
    return 0, 0


def _wait_until_free(handle: int, folder: Path, patience: float, tell: Tell) -> None:
    begun, said = time.monotonic(), False
    while not _locked(handle) or left_in(folder):
        waited = time.monotonic() - begun
        if waited > patience:
            raise StillRunningError(
                f"still running: {_who(folder)}, of an earlier run of this campaign. The robot may "
                "move: stop it by hand, then go on with --resume."
            )
        if waited > _SAID and not said:
            said = True
            text = f"still running: {_who(folder)}, of an earlier run of this campaign"
            tell(Note(Level.WARNING, f"{text}. Nothing is played before that has ended."))
        time.sleep(_POLL_OTHER)


def _who(folder: Path) -> str:
    """Processes in words, or that there is one that cannot be seen from here."""
    return in_words(left_in(folder)) or (
        f"a program that cannot be seen from here, as {folder / _LOCK} is locked (by another user "
        "or machine?)"
    )


def _locked(handle: int) -> bool:
    """Whether the lock is ours; where the file system has none, nothing can be said: it is."""
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True
