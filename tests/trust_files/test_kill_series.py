"""The judge of killed commands sees what a writer does that is not whole, and nothing else."""

import fcntl
import os
import termios
import time
from array import array
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

from benchmarks.trust.kill_commands import Command
from benchmarks.trust.killing import Series, Start, Tally, undisturbed
from excite_cli.atomic import write_atomically

Killed = Callable[[Callable[[], None]], Tally]
WHOLE = "x" * 4096
PART = 64


def read(path: Path) -> str:
    text = path.read_text()
    assert len(text) == len(WHOLE), "cut off"
    return text


COMMAND = Command("writer", (), {"out.txt": read})


def slowly(path: Path) -> None:
    with path.open("w") as file:
        for first in range(0, len(WHOLE), PART):
            file.write(WHOLE[first : first + PART])
            file.flush()
            wait_for_the_killer()


def wait_for_the_killer() -> None:
    """Until it has read all events, so that a busy machine does not let a writer run past it."""
    folder = Path("/proc/self/fd")
    for link in folder.iterdir():
        if link.is_symlink() and os.readlink(link) == "anon_inode:inotify":
            unread = array("i", [1])
            while unread[0]:
                time.sleep(0.0002)
                fcntl.ioctl(int(link.name), termios.FIONREAD, unread)


def forking(write: Callable[[], None]) -> Start:
    """A program that does `write` in its folder."""

    def start(arguments: Sequence[str], folder: Path, environment: Mapping[str, str]) -> int:
        (folder.parent / "said.txt").write_text("")
        process = os.fork()
        if process:
            return process
        try:
            os.setsid()
            os.chdir(folder)
            write()
            os._exit(0)
        finally:
            os._exit(1)

    return start


@pytest.fixture(params=[True, False], ids=["over-old", "new"])
def killed(request: pytest.FixtureRequest, tmp_path: Path) -> Killed:
    """Kills it twenty times, over an old file or without one."""

    def series(write: Callable[[], None]) -> Tally:
        start = forking(write)
        reference = undisturbed(start, COMMAND, tmp_path / "reference")
        old = reference.folder if request.param else None
        played = Series(start, COMMAND, reference, tmp_path / "series", old)
        return played.play(20, np.random.default_rng(1))

    return series


def test_a_file_written_in_place_is_found_broken(killed: Killed) -> None:
    tally = killed(lambda: slowly(Path("out.txt")))
    assert any("out.txt is broken" in why for why in tally.broken)


def test_a_file_put_in_place_whole_is_not(killed: Killed) -> None:
    tally = killed(lambda: write_atomically(Path("out.txt"), slowly))
    assert tally.broken == []
    assert tally.kills >= 10
    assert tally.writing >= 1
    assert tally.finished == 1


def test_what_nobody_would_know_is_told(killed: Killed) -> None:
    def write() -> None:
        slowly(Path("out.tmp"))
        os.replace("out.tmp", "out.txt")

    assert any("out.tmp was left" in why for why in killed(write).broken)
