"""Starting `excite`, killing it at an instant or an event in its folder, judging what is there."""

import ctypes
import os
import re
import select
import shutil
import signal
import struct
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.trust.kill_commands import N_MOTIONS, Command, Content, numbers

# Of inotify: made, written to, closed after writing, moved in or out, removed, attributes.
_EVENTS = 0x100 | 0x2 | 0x8 | 0xC0 | 0x200 | 0x4
_HEAD = struct.calcsize("iIII")


@dataclass(frozen=True)
class Moment:
    """When to kill: `seconds` after the start, or after event number `event` in the folder."""

    seconds: float
    event: int | None = None


@dataclass(frozen=True)
class Ended:
    """How a run ended: killed by us or by itself, with which status, when, after how many events.

    `first` is the time of the first event [s], None if there was none.
    """

    killed: bool
    status: int
    seconds: float
    events: int
    first: float | None


Start = Callable[[Sequence[str], Path, Mapping[str, str]], int]


def forked(
    arguments: Sequence[str],
    folder: Path,
    environment: Mapping[str, str],
    powerless: bool = False,
) -> int:
    """The program as a copy of this process, in a session of its own; returns its process id.

    `powerless`: without the rights of root, to whom no folder is closed.
    """
    process = os.fork()
    if process:
        return process
    status = 70
    try:
        os.setsid()
        os.chdir(folder)
        os.environ.update(environment)
        said = os.open(folder.parent / "said.txt", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        for number in (1, 2):
            os.dup2(said, number)
        sys.stdout, sys.stderr = os.fdopen(1, "w"), os.fdopen(2, "w", buffering=1)
        sys.argv = ["excite", *arguments]
        if powerless:
            _drop_capabilities()
        status = _main()
    finally:
        os._exit(status)


def _drop_capabilities() -> None:
    libc = ctypes.CDLL(None, use_errno=True)
    head = (ctypes.c_uint32 * 2)(0x20080522, 0)  # third version, this process
    if libc.capset(head, (ctypes.c_uint32 * 6)()):
        raise OSError(ctypes.get_errno(), "capset")


def _main() -> int:
    import atexit

    from excite_cli.cli.app import main

    try:
        main()
    except SystemExit as end:
        atexit._run_exitfuncs()
        sys.stdout.flush()
        return end.code if isinstance(end.code, int) else 0
    return 0


def run(start: Start, arguments: Sequence[str], folder: Path, moment: Moment | None = None,
        environment: Mapping[str, str] | None = None) -> Ended:  # fmt: skip
    """Start the program in `folder`; with a moment, kill its whole process group then."""
    watch = _watch(folder)
    began = time.monotonic()
    process = start(arguments, folder, environment or {})
    end = os.pidfd_open(process)
    events, first, killed = 0, None, False
    try:
        while True:
            left = None
            if moment is not None and moment.event is None:
                left = max(0.0, began + moment.seconds - time.monotonic())
            ready, _, _ = select.select([end, watch], [], [], left)
            if watch in ready:
                events += _count(watch)
                first = time.monotonic() - began if first is None else first
            by_event = moment is not None and moment.event is not None and events >= moment.event
            if by_event and moment is not None:
                time.sleep(moment.seconds)
            if by_event or not ready:
                killed = _kill(process)
                break
            if end in ready:
                break
        _, status = os.waitpid(process, 0)
        killed = killed and os.WIFSIGNALED(status)
    finally:
        os.close(end)
        os.close(watch)
    return Ended(killed, status, time.monotonic() - began, events, first)


def _kill(process: int) -> bool:
    try:
        os.killpg(process, signal.SIGKILL)
    except ProcessLookupError:  # it has not made its session yet, or is gone
        os.kill(process, signal.SIGKILL)
    return True


def _watch(folder: Path) -> int:
    libc = ctypes.CDLL(None, use_errno=True)
    watch = int(libc.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC))
    assert watch >= 0, os.strerror(ctypes.get_errno())
    assert libc.inotify_add_watch(watch, os.fsencode(folder), _EVENTS) >= 0
    return watch


def _count(watch: int) -> int:
    """How many events are waiting; they are taken away."""
    data, count, at = os.read(watch, 65536), 0, 0
    while at < len(data):
        at += _HEAD + struct.unpack_from("iIII", data, at)[3]
        count += 1
    return count


_LEFT = re.compile(r"\..+\.(lock|[a-z0-9_]{8}\.part)")
_AT_EVENTS = 0.7  # share of kills at an event in the folder; the others at any instant
_DELAY = 0.002  # s, mean, of every second kill at an event


@dataclass
class Tally:
    """What came of the kills of one command; `broken` must stay empty."""

    kills: int = 0
    late: int = 0  # the run ended before it could be killed
    writing: int = 0  # kills that left a temporary file: they came while one was written
    states: dict[str, int] = field(default_factory=dict)
    swept: int = 0  # temporary files that a later run removed
    finished: int = 0  # runs after kills, until their end: `--resume`, or the same once more
    broken: list[str] = field(default_factory=list)

    def add(self, other: "Tally") -> None:
        """Count what `other` counted."""
        for name in ("kills", "late", "writing", "swept", "finished"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        for state, count in other.states.items():
            self.states[state] = self.states.get(state, 0) + count
        self.broken += other.broken


@dataclass(frozen=True)
class Reference:
    """A run that nobody disturbed: its files in `folder`, their content, its time and events."""

    folder: Path
    contents: dict[str, Content]
    ended: Ended


def undisturbed(start: Start, command: Command, folder: Path) -> Reference:
    """Run `command` in the new folder `folder` to its end."""
    folder.mkdir()
    ended = run(start, (*command.arguments, "--overwrite"), folder)
    said = (folder.parent / "said.txt").read_text()
    assert ended.status == 0, f"{command.name} failed undisturbed: {said}"
    contents = {name: read(folder / name) for name, read in command.outputs.items()}
    return Reference(folder, contents, ended)


class Series:
    """Kills in one folder, which begins empty or with the old files of `old`."""

    def __init__(
        self, start: Start, command: Command, reference: Reference, folder: Path, old: Path | None
    ) -> None:
        self.start, self.command, self.reference = start, command, reference
        self.folder, self.tally = folder, Tally()
        if old is None:
            folder.mkdir()
        else:
            shutil.copytree(old, folder, ignore=shutil.ignore_patterns(".*"))
        self.fresh = self._stats()

    def play(self, kills: int, rng: np.random.Generator) -> Tally:
        """Kill `kills` times, then run to the end and compare with the reference."""
        try:
            for _ in range(kills):
                before = self._stats()
                ended = run(self.start, self._arguments(), self.folder, self._moment(rng))
                self.tally.kills += ended.killed
                self.tally.late += not ended.killed
                if not ended.killed and ended.status != 0:
                    self._fail(f"status {ended.status}: {self._said()}")
                self._judge(before)
                if self._share_left() == 0.0:
                    break
            self._finish()
        except Exception as error:
            self._fail(f"{type(error).__name__}: {error}")
        return self.tally

    def _arguments(self) -> tuple[str, ...]:
        """`--resume` where there is something new to go on with."""
        output = next(iter(self.command.outputs))
        now, path = self._stats()[output], self.folder / output
        resumes = self.command.resumable and now != self.fresh[output] and path.exists()
        return (*self.command.arguments, "--resume" if resumes else "--overwrite")

    def _moment(self, rng: np.random.Generator) -> Moment:
        ended, share = self.reference.ended, self._share_left()
        if rng.random() < _AT_EVENTS:
            event = int(rng.integers(1, max(2, share * ended.events)))
            return Moment(float(rng.exponential(_DELAY)) * float(rng.integers(2)), event)
        return Moment(float(rng.uniform(0.0, max(0.3, share) * ended.seconds)))

    def _share_left(self) -> float:
        """How much of the work is left to do: 1, or what `--resume` has still to do."""
        if "--resume" not in self._arguments():
            return 1.0
        content = numbers(self.folder / next(iter(self.command.outputs)))
        done = sum(key.endswith("/coefficients") for key in content)
        return 1.0 - done / N_MOTIONS

    def _judge(self, before: dict[str, object]) -> None:
        """Every file is as it was, or new and whole; what else is there is recognisable."""
        now, states = self._stats(), []
        for name, read in self.command.outputs.items():
            if now[name] == before[name]:
                states.append("absent" if now[name] is None else "old")
                continue
            if now[name] is None:
                self._fail(f"{name} is gone")
                continue
            try:
                self._compare(name, read(self.folder / name))
                states.append("new")
            except Exception as error:
                self._fail(f"{name} is broken: {type(error).__name__}: {error}")
        state = states[0] if len(set(states)) == 1 else "mixed"
        self.tally.states[state] = self.tally.states.get(state, 0) + 1
        others = [each.name for each in self.folder.iterdir() if each.name not in now]
        self.tally.writing += any(name.endswith(".part") for name in others)
        for name in others:
            if not _LEFT.fullmatch(name):
                self._fail(f"{name} was left")

    def _compare(self, name: str, content: Content) -> None:
        expected = self.reference.contents[name]
        if self.command.resumable:  # the first motions of all
            content = {key: bits for key, bits in content.items() if key.startswith("motions/")}
            expected = {key: expected[key] for key in content}
        assert content == expected, "other content than an undisturbed run's"

    def _finish(self) -> None:
        """Run to the end: the same content as if nothing had been killed, and nothing left over."""
        left = sum(each.name.endswith(".part") for each in self.folder.iterdir())
        arguments = self._arguments()
        ended = run(self.start, arguments, self.folder)
        if ended.status != 0:
            self._fail(f"{arguments[-1]} failed: {self._said()}")
            return
        for name, read in self.command.outputs.items():
            if read(self.folder / name) != self.reference.contents[name]:
                self._fail(f"{name}: other content after {arguments[-1]} than undisturbed")
        over = [each.name for each in self.folder.iterdir() if each.name.startswith(".")]
        if over:
            self._fail(f"left after the last run: {', '.join(over)}")
        self.tally.swept += left
        self.tally.finished += 1

    def _stats(self) -> dict[str, object]:
        """What tells a file from another with the same name."""
        found: dict[str, object] = {}
        for name in self.command.outputs:
            path = self.folder / name
            if path.exists():
                stat = path.stat()
                found[name] = (stat.st_ino, stat.st_mtime_ns, stat.st_size)
            else:
                found[name] = None
        return found

    def _fail(self, why: str) -> None:
        self.tally.broken.append(f"{self.command.name} ({self.folder.name}): {why}")

    def _said(self) -> str:
        return (self.folder.parent / "said.txt").read_text()[-400:]
