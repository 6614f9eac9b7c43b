"""Processes that a measuring program is made of, as /proc shows them.

A process is named by its id and its start: an id alone may be another process's later. Where there
is no /proc (macOS), only a group is seen, as one.
"""

import ctypes
import os
import signal
import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import inf
from pathlib import Path

# In the environment of a program, and of all that it starts: the log that it is to write.
MARK = "EXCITE_CAMPAIGN_RECORDING"
_PROC = Path("/proc")
_SET_CHILD_SUBREAPER = 36  # of prctl
# Places in /proc/PID/stat, counted after the name, which may hold blanks and brackets.
_STATE, _PARENT, _GROUP, _SESSION, _THREADS, _START = 0, 1, 2, 3, 17, 19


@dataclass(frozen=True)
class Process:
    """One that runs. `start`: clock ticks after boot; 0 where this stands for a whole group."""

    pid: int
    group: int
    name: str = ""
    parent: int = 0
    session: int = 0
    start: int = 0

    def __str__(self) -> str:
        return f"process {self.pid} ({self.name})" if self.start else f"process group {self.group}"


def in_words(processes: Iterable[Process]) -> str:
    """`process 4711 (python), process 4712 (sh)`."""
    return ", ".join(map(str, processes))


def running() -> dict[int, Process]:
    """All that run, by their ids; none where there is no /proc.

    One that has ended and was not waited for yet (a zombie) does not run, unless threads of it do.
    """
    found = {}
    with suppress(OSError):
        for entry in os.scandir(_PROC):
            if entry.name.isdecimal() and (process := _read(int(entry.name))) is not None:
                found[process.pid] = process
    return found


def descendants(of: int) -> list[Process]:
    """What a process has started, and what that has, of those that run."""
    everything = running()
    children: dict[int, list[Process]] = {}
    for each in everything.values():
        children.setdefault(each.parent, []).append(each)
    found: list[Process] = []
    waiting = [of]
    while waiting:
        more = children.get(waiting.pop(), [])
        found += more
        waiting += [each.pid for each in more]
    return found


def in_group(group: int) -> list[Process]:
    """The group as one, if any process is left of it: for systems without /proc."""
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return []
    except PermissionError:
        pass
    return [Process(group, group)]


def marked(folder: Path) -> list[Process]:
    """Those whose environment says that they record into `folder`, but for this one.

    The environment of other users' processes cannot be read.
    """
    prefix = b"%s=%s/" % (MARK.encode(), os.fsencode(folder.resolve()))
    found = []
    for pid, process in running().items():
        with suppress(OSError):
            words = (_PROC / str(pid) / "environ").read_bytes().split(b"\0")
            if pid != os.getpid() and any(word.startswith(prefix) for word in words):
                found.append(process)
    return found


def of_session(session: int, start: int) -> list[Process]:
    """Those of the session that a process began which started at `start`.

    A session's id is not given away again while one of it runs: a process of that id that started
    at another time is a later one, and so is its session.
    """
    everything = running()
    if session in everything and everything[session].start != start:
        return []
    return [each for each in everything.values() if each.session == session]


def send(process: Process, number: int) -> None:
    """A signal to that process, never to a later one of its id; none if we may not."""
    with suppress(OSError):
        try:
            handle = os.pidfd_open(process.pid)
        except ProcessLookupError:
            return
        except OSError:  # an old kernel, or a container that does not allow it
            if start_of(process.pid) == process.start:
                os.kill(process.pid, number)
            return
        try:
            if start_of(process.pid) == process.start:
                signal.pidfd_send_signal(handle, number)
        finally:
            os.close(handle)


def send_to_all(processes: Sequence[Process], group: int, number: int) -> None:
    """A signal to `group` at once, as far as it is among them, then to each of the others."""
    if any(each.group == group for each in processes):
        with suppress(OSError):
            os.killpg(group, number)
    for each in processes:
        if each.group != group:
            send(each, number)


def adopt_orphans() -> bool:
    """Let processes whose parent ends become this one's children; False where that cannot be."""
    try:
        prctl = ctypes.CDLL(None).prctl
        nothing = ctypes.c_ulong(0)
        done = prctl(_SET_CHILD_SUBREAPER, ctypes.c_ulong(1), nothing, nothing, nothing) == 0
    except AttributeError:
        return False
    return done and start_of(os.getpid()) > 0


def start_of(pid: int) -> int:
    """Clock ticks from boot to the start of a process; 0 where it is not known."""
    process = _read(pid)
    return 0 if process is None else process.start


def boot() -> str:
    """Which boot of this machine this is; empty where it is not known."""
    with suppress(OSError):
        return (_PROC / "sys/kernel/random/boot_id").read_text().strip()
    return ""


def _read(pid: int) -> Process | None:
    """A process that runs."""
    try:
        text = (_PROC / str(pid) / "stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return None
    begin, end = text.index("("), text.rindex(")")
    fields = text[end + 2 :].split()
    if fields[_STATE] in "ZX" and int(fields[_THREADS]) <= 1:
        return None
    return Process(
        pid, int(fields[_GROUP]), text[begin + 1 : end], int(fields[_PARENT]),
        int(fields[_SESSION]), int(fields[_START]),
    )  # fmt: skip


# How processes are ended: SIGTERM first, SIGKILL after a while, or at once when asked again.

_KILLED = 2.0  # s after SIGKILL: what still runs then waits for hardware, or is another user's


class Escalation:
    """Ends all that `find` gives, `group` among them, in two stages.

    Each `request` begins the next stage; without a second one it begins after `grace` [s].
    Nothing happens but in `request` and `step`, which is to be called every now and then.
    """

    def __init__(self, find: Callable[[], Sequence[Process]], group: int, grace: float) -> None:
        self._find, self._group, self._grace = find, group, grace
        self._due = inf
        self.stage = 0

    def request(self) -> None:
        """SIGTERM to all that run now; the second time, SIGKILL, also to what is started then."""
        if self.stage == 0:
            self.stage, self._due = 1, time.monotonic() + self._grace
            found = self._find()
            for number in (signal.SIGTERM, signal.SIGCONT):  # one that is stopped hears nothing
                send_to_all(found, self._group, number)
        elif self.stage == 1:
            self.stage, self._due = 2, time.monotonic() + _KILLED
            self.step()

    def step(self) -> None:
        """Go on: SIGKILL once the grace is over, and again as long as something runs."""
        if self.stage == 1 and time.monotonic() >= self._due:
            self.request()
        elif self.stage == 2:
            send_to_all(self._find(), self._group, signal.SIGKILL)

    @property
    def in_vain(self) -> bool:
        """Whether SIGKILL has had its time."""
        return self.stage == 2 and time.monotonic() >= self._due
