"""What a campaign that was killed has left is noticed, also without its supervisor."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from excite_cli.campaign.measure import StillRunningError
from excite_cli.campaign.measure_command import MeasureCommand
from excite_cli.campaign.process_table import running
from excite_cli.campaign.same_motion import is_measured
from excite_cli.campaign.supervised import held_while_it_runs, left_in
from excite_cli.shown.note import Note
from tests.campaign.campaign_process import PATIENCE, begun, program, said, start, take_in, until

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")
# Notes who it is, and that it is there; `how` may leave behind all that it was started with.
BODY = """
if {leaves} and len(sys.argv) > 3:
    os.closerange(3, 256)
    os.execve(sys.executable, [sys.executable, __file__, *sys.argv[1:3]], {{}})
print(os.getpid(), flush=True)
time.sleep({seconds})
open(sys.argv[2], "w").write("whole")
"""


def killed(tmp_path: Path, seconds: float, leaves: bool, *also: str) -> int:
    """The program of a campaign that was killed; `also`: its `supervisor`."""
    line = program(tmp_path, BODY.format(seconds=seconds, leaves=leaves))
    campaign, pid = begun(line, tmp_path, grace=0.5)
    supervisor = running()[pid].parent
    campaign.kill()
    campaign.wait()
    if also:
        os.kill(supervisor, signal.SIGKILL)
        until(lambda: supervisor not in running(), "the supervisor is dead")
    return pid


def end(pid: int) -> None:
    if pid in running():
        os.kill(pid, signal.SIGKILL)


@pytest.mark.long
@pytest.mark.parametrize("leaves", [False, True], ids=["plain", "leaves its environment"])
def test_a_program_without_campaign_and_supervisor_is_named(leaves: bool, tmp_path: Path) -> None:
    """It bears a mark; where it has put that off, it is of a session that was noted."""
    pid = killed(tmp_path, 600.0, leaves, "supervisor")
    heard: list[Note] = []
    try:
        until(lambda: [each.pid for each in left_in(tmp_path)] == [pid], "it is found")
        with (
            pytest.raises(
                StillRunningError, match=rf"^still running: process {pid} \(.*The robot may move"
            ),
            held_while_it_runs(tmp_path, 1.2, heard.append),
        ):
            pytest.fail("it is still running")
        assert [f"process {pid} (" in note.text for note in heard] == [True]
    finally:
        end(pid)
    until(lambda: not left_in(tmp_path), "it is gone")
    with held_while_it_runs(tmp_path, PATIENCE, heard.append):
        pass


def test_a_later_process_of_the_same_id_is_not_taken_for_it(tmp_path: Path) -> None:
    pid = killed(tmp_path, 600.0, True, "supervisor")
    lock = tmp_path / ".moving.lock"
    noted = lock.read_text()
    end(pid)
    until(lambda: not left_in(tmp_path), "it is gone")
    # Another process, which leads a session of its own, and whose id was the program's before.
    other = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"],
                             start_new_session=True)  # fmt: skip
    try:
        until(lambda: running()[other.pid].session == other.pid, "it has begun")
        lock.write_text(noted.replace(str(pid), str(other.pid)))
        assert left_in(tmp_path) == []
    finally:
        other.kill()
        other.wait()


@pytest.mark.long
def test_the_program_of_a_killed_campaign_is_waited_for_and_its_end_recorded(
    tmp_path: Path,
) -> None:
    """The robot may still move: it is locked as long as the program runs, which runs only once."""
    killed(tmp_path, 3.0, False)
    take = take_in(tmp_path)
    with pytest.raises(StillRunningError, match="still running"):
        MeasureCommand.of("x {motion} {data}", limit=0.2).wait_for_earlier(take)
    assert not take.data.exists()
    MeasureCommand.of("x {motion} {data}", limit=PATIENCE).wait_for_earlier(take)
    assert take.data.read_text() == "whole"
    assert is_measured(take.data)


@pytest.mark.long
def test_the_limit_of_time_outlives_the_campaign(tmp_path: Path) -> None:
    line = program(tmp_path, BODY.format(seconds=600, leaves=False))
    campaign = start(line, tmp_path, limit=2.0, grace=0.5)
    until(lambda: (tmp_path / "m.txt").exists(), "the program is about to start")
    campaign.kill()
    campaign.wait()
    take = take_in(tmp_path)
    MeasureCommand.of(line, limit=PATIENCE).wait_for_earlier(take)
    assert not take.data.exists()


@pytest.mark.long
def test_a_program_is_ended_without_its_supervisor(tmp_path: Path) -> None:
    """Somebody has killed that; the campaign lives, and ends what it finds."""
    line = program(tmp_path, BODY.format(seconds=600, leaves=True))
    campaign, pid = begun(line, tmp_path, grace=0.5)
    os.kill(running()[pid].parent, signal.SIGKILL)
    assert campaign.wait(PATIENCE) == 1
    assert pid not in running()
    assert "its supervisor was killed" in said(tmp_path)


@pytest.mark.long
def test_a_supervisor_that_is_stopped_does_not_keep_a_program_alive(tmp_path: Path) -> None:
    line = program(tmp_path, BODY.format(seconds=600, leaves=False))
    campaign, pid = begun(line, tmp_path, grace=0.5)
    supervisor = running()[pid].parent
    os.kill(supervisor, signal.SIGSTOP)
    campaign.send_signal(signal.SIGINT)
    assert campaign.wait(PATIENCE) == 130
    assert {pid, supervisor} & running().keys() == set()


def test_a_lock_whose_holder_cannot_be_seen_is_told(tmp_path: Path) -> None:
    """As of another machine, through a network file system."""
    script = "import fcntl, sys, time; f = open(sys.argv[1], 'w'); fcntl.flock(f, fcntl.LOCK_EX)\n"
    script += "print(flush=True); time.sleep(600)"
    lock = tmp_path / ".moving.lock"
    holder = subprocess.Popen([sys.executable, "-c", script, lock], stdout=subprocess.PIPE)
    try:
        assert holder.stdout is not None
        holder.stdout.readline()
        with (
            pytest.raises(StillRunningError, match=r"cannot be seen from here, as .* is locked"),
            held_while_it_runs(tmp_path, 0.1, lambda note: None),
        ):
            pytest.fail("it is locked")
    finally:
        holder.kill()
        holder.communicate()
