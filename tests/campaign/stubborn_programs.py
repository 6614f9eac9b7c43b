"""Measuring programs that do not end when they are asked to, in three kinds.

Each notes every process of its own, as `pid start`, in a file beside itself; all would run for ten
minutes.
"""

import sys
from pathlib import Path

PIDS = "pids.txt"
_COMMON = f"""\
import os, signal, sys, time

def deaf(*numbers):
    for number in numbers:
        signal.signal(number, signal.SIG_IGN)

def note():
    start = open("/proc/self/stat").read().rsplit(")", 1)[1].split()[19]
    with open(os.path.join(os.path.dirname(__file__), {PIDS!r}), "a") as file:
        file.write(f"{{os.getpid()}} {{start}}\\n")

"""
# How many processes each has, and what it does.
KINDS: dict[str, tuple[int, str]] = {
    "the leader ignores SIGTERM": (
        1,
        "deaf(signal.SIGTERM, signal.SIGINT, signal.SIGHUP); note(); time.sleep(600)\n",
    ),
    "the leader ends, its child ignores SIGTERM": (
        2,
        """\
if os.fork() == 0:
    deaf(signal.SIGTERM)
note()
time.sleep(600)
""",
    ),
    # Without the environment, the open files and the session of the one that started it.
    "a daemon of its own session ignores SIGTERM and SIGINT": (
        2,
        """\
if sys.argv[-1] == "daemon":
    deaf(signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
    note()
    time.sleep(600)
if os.fork() == 0:
    os.setsid()
    if os.fork() == 0:
        os.closerange(3, 256)
        os.execve(sys.executable, [sys.executable, __file__, "daemon"], {})
    os._exit(0)
os.wait()
note()
time.sleep(600)
""",
    ),
}


def command_of(kind: str, folder: Path) -> str:
    """Write the program of that kind into `folder`; what --measure is given."""
    path = folder / "stubborn.py"
    path.write_text(_COMMON + KINDS[kind][1], encoding="utf-8")
    return f"'{sys.executable}' '{path}' {{motion}} {{data}}"


def noted(folder: Path) -> list[tuple[int, str]]:
    """Process ids that were noted, with what /proc calls their start."""
    path = folder / PIDS
    if not path.exists():
        return []
    lines = path.read_text(encoding="utf-8").splitlines()
    return [(int(pid), start) for pid, start in (line.split() for line in lines)]


def alive(folder: Path) -> list[int]:
    """Those of the noted processes that still run."""
    return [pid for pid, start in noted(folder) if _runs(pid, start)]


def _runs(pid: int, start: str) -> bool:
    """Whether that process, and no later one of its id, runs."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    except OSError:
        return False
    return fields[0] not in "ZX" and fields[19] == start
