"""Files that people carry: a motion is laid out, a log of it that is whole is taken."""

import os
import shutil
import sys
import time
from dataclasses import replace
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

from excite_cli.campaign import inbox
from excite_cli.campaign.inbox import Inbox, is_being_written
from excite_cli.campaign.measure import Take
from excite_cli.claim import claim, leave
from excite_cli.errors import FileError
from tests.campaign.campaign_process import until

STILL = inbox._STILL  # s


class Clock:
    """The clock of the campaign that waits: it goes on when the test says so, and never alone."""

    def __init__(self) -> None:
        self._now, self._looks = 0.0, 0

    def monotonic(self) -> float:
        return self._now

    def sleep(self, seconds: float) -> None:
        """Between two looks of the campaign."""
        self._looks += 1
        time.sleep(0.002)

    def __getattr__(self, name: str) -> Any:
        return getattr(time, name)

    def forward(self, seconds: float) -> None:
        """So much later; the campaign has looked before and after that."""
        for step in (seconds, 0.0):
            looks = self._looks
            until(lambda looks=looks: self._looks > looks + 1, "the campaign looks")
            self._now += step

    def tick(self) -> None:
        self._now += STILL


class Desk:
    """A campaign that waits for one log, in a thread of its own, and the person who brings it."""

    def __init__(self, folder: Path) -> None:
        self.box, self.said, self.clock = folder / "inbox", [], Clock()
        self.motion, self.log = self.box / "m.csv", self.box / "m_log.csv"
        source = folder / "motion.csv"
        source.write_text("t\n0\n")
        self.take = Take("m", source, folder / "log.csv", 12.0, folder / "x.txt")
        self._waiting: Thread | None = None

    def wait(self) -> None:
        measure = Inbox(self.box, self.said.append)
        # Daemon: a test that fails leaves it waiting.
        self._waiting = Thread(target=measure.take, args=(self.take,), daemon=True)
        self._waiting.start()
        until(lambda: self.said, "the motion is laid out")

    def taken(self) -> str:
        """What was taken."""
        waiting = self._waiting
        assert waiting is not None
        until(lambda: self.clock.tick() or not waiting.is_alive(), "a log is taken")
        return self.take.data.read_text()

    def says(self, *words: str) -> str:
        """What it says of a file that it does not take."""
        until(lambda: self.clock.tick() or len(self.said) > 1, f"it says {words}")
        assert all(word in self.said[-1] for word in words), self.said[-1]
        return self.said[-1]


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Desk:
    desk = Desk(tmp_path)
    monkeypatch.setattr(inbox, "time", desk.clock)
    return desk


def put(path: Path, text: str, age: float = 0.0) -> None:
    """A file whose date is `age` seconds ago."""
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)
    then = time.time() - age
    os.utime(path, (then, then))


def test_a_log_is_taken_once_it_grows_no_more(desk: Desk) -> None:
    """As long as somebody has it open for writing it is not whole, however long nothing comes."""
    desk.wait()
    for part in range(3):
        with desk.log.open("a") as file:
            file.write(f"part {part}, ")
            if part == 2:
                file.flush()
                desk.clock.forward(5 * STILL)
                file.write("and its end")
        desk.clock.forward(STILL / 2)
    assert desk.taken() == "part 0, part 1, part 2, and its end"
    assert desk.motion.read_text() == "t\n0\n"
    assert desk.said == [f"play {desk.motion} (12 s) and put its log there as m_log.csv"]
    assert not desk.log.exists()  # the next one is another take
    assert (desk.box / "m_log.read.csv").exists()


def test_a_log_that_is_not_whole_is_waited_for(desk: Desk) -> None:
    """A copy from another machine pauses: nothing says that it is still being written."""
    whole = lambda log, since: "" if "end" in log.read_text() else f"{log.name} is not whole."  # noqa: E731
    desk.take = replace(desk.take, refused=whole)
    desk.wait()
    put(desk.log, "first half, ")
    words = desk.says("m_log.csv is not taken: log.csv is not whole.", "looked at again once it")
    assert ".ok" not in words
    assert not desk.take.data.exists()
    assert desk.log.exists()
    put(desk.log, "first half, second half, end")
    assert desk.taken() == "first half, second half, end"
    assert len(desk.said) == 2


def test_a_log_that_is_older_than_its_motion_is_not_taken(desk: Desk) -> None:
    """Last month's log lies there, under the same name."""
    put(desk.log, "last month's", age=30 * 86400.0)
    desk.wait()
    words = desk.says("m_log.csv is of ", "its motion was laid out at", "touch ", "m_log.csv.ok")
    assert time.strftime("%Y-%m", time.localtime(time.time() - 30 * 86400.0)) in words
    assert desk.log.read_text() == "last month's"
    put(desk.log, "today's")
    assert desk.taken() == "today's"


def test_a_person_can_say_that_a_clock_was_wrong(desk: Desk) -> None:
    desk.wait()
    put(desk.log, "today's", age=86400.0)  # as the robot's clock has it
    put(desk.box / "m_log.csv.ok", "", age=86400.0)  # of yesterday, too: it is about another log
    desk.says("m_log.csv is of ")
    (desk.box / "m_log.csv.ok").touch()
    assert desk.taken() == "today's"
    assert {each.name for each in desk.box.iterdir()} == {"m.csv", "m_log.read.csv"}


def test_stamps_that_are_older_than_the_motion_are_said_with_what_to_do(desk: Desk) -> None:
    asked: list[float | None] = []

    def refused(log: Path, since: float | None) -> str:
        asked.append(since)
        return "" if since is None else "its time stamps end 86400 s before the motion was there."

    desk.take = replace(desk.take, refused=refused)
    desk.wait()
    put(desk.log, "of the robot's clock")
    desk.says("its time stamps end 86400 s before", "touch ", "m_log.csv.ok")
    assert asked[0] == pytest.approx(desk.motion.stat().st_mtime)
    (desk.box / "m_log.csv.ok").touch()
    assert desk.taken() == "of the robot's clock"


def test_a_log_that_cannot_be_read_is_waited_for(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of another user, say; that it may be read later changes neither its size nor its date."""
    desk.wait()
    allowed, opened = False, Path.open

    def guarded(path: Path, *given: Any, **more: Any) -> Any:
        if path == desk.log and not allowed:
            raise PermissionError(13, "Permission denied")
        return opened(path, *given, **more)

    monkeypatch.setattr(Path, "open", guarded)
    desk.log.touch(0o600)
    os.truncate(desk.log, 10)
    desk.says("m_log.csv cannot be read: no permission", "looked at again once it changes")
    allowed = True
    desk.log.chmod(0o644)
    assert desk.taken() == "\0" * 10


def test_nothing_that_was_read_is_replaced(desk: Desk) -> None:
    before = ("m_log.read.csv", "m_log.read_2.csv")
    desk.box.mkdir()
    for name in before:
        (desk.box / name).write_text(f"this is {name}")
    desk.wait()
    put(desk.log, "another take")
    assert desk.taken() == "another take"
    assert [(desk.box / name).read_text() for name in before] == [f"this is {n}" for n in before]
    assert (desk.box / "m_log.read_3.csv").read_text() == "another take"


def interrupted(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    """The campaign lays its motion out and is interrupted."""

    def stop(seconds: float) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(desk.clock, "sleep", stop)
        with pytest.raises(KeyboardInterrupt):
            Inbox(desk.box, lambda text: None).take(desk.take)


def test_a_log_that_came_while_the_campaign_was_off_is_taken(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is resumed an hour later, by the date of what it lays out."""
    interrupted(desk, monkeypatch)
    shutil.move(desk.motion, desk.box / "on its way to the robot")
    put(desk.log, "recorded meanwhile")
    copy, hour = inbox._copy, time.time() + 3600.0

    def later(source: Path, target: Path) -> None:
        copy(source, target)
        os.utime(target, (hour, hour))

    monkeypatch.setattr(inbox, "_copy", later)
    desk.wait()
    assert desk.taken() == "recorded meanwhile"


def test_a_log_of_what_was_laid_out_before_another_motion_is_old(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same name, another motion: what was recorded before is not of it."""
    interrupted(desk, monkeypatch)
    put(desk.log, "of the first motion", age=1.0)
    desk.take.motion.write_text("t\n1\n")
    desk.wait()
    desk.says("m_log.csv is of ")


def test_two_campaigns_do_not_wait_for_the_same_name(desk: Desk) -> None:
    desk.box.mkdir()
    claim(desk.motion)
    try:
        code = os.fork()
        if code == 0:  # another process: what is claimed here is claimed for it
            try:
                Inbox(desk.box, desk.said.append).take(desk.take)
            except FileError as error:
                os._exit(7 if "is being written by another run" in str(error) else 8)
            os._exit(9)
        assert os.waitstatus_to_exitcode(os.waitpid(code, 0)[1]) == 7
    finally:
        leave(desk.motion)


@pytest.mark.skipif(sys.platform != "linux", reason="leases are of Linux")
def test_a_file_is_being_written_as_long_as_it_is_open_for_that(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    with path.open("w"):
        assert is_being_written(path)
    assert not is_being_written(path)
    with path.open("r"):
        assert not is_being_written(path)
    with path.open("a") as file:  # our own look at it was no obstacle
        assert is_being_written(path)
        file.write("x")
    assert path.read_text() == "x"


def test_where_nothing_can_be_said_it_is_not(tmp_path: Path) -> None:
    assert not is_being_written(tmp_path / "none")
    assert not is_being_written(tmp_path)
