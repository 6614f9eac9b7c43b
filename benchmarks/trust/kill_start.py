"""Starting `excite`, and killing it: at an instant, or at an event in the folder it writes to."""

import ctypes
import os
import select
import shutil
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

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


def installed(arguments: Sequence[str], folder: Path, environment: Mapping[str, str]) -> int:
    """The installed program in a session of its own; returns its process."""
    program = shutil.which("excite", path=f"{Path(sys.executable).parent}:{os.defpath}")
    assert program is not None, "excite is not installed"
    with (folder.parent / "said.txt").open("w") as said:
        return subprocess.Popen(
            [program, *arguments],
            cwd=folder,
            env={**os.environ, **environment},
            stdin=subprocess.DEVNULL,
            stdout=said,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        ).pid


def forked(
    arguments: Sequence[str],
    folder: Path,
    environment: Mapping[str, str],
    powerless: bool = False,
) -> int:
    """The same from a copy of this process, which has imported everything: seconds are saved.

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
