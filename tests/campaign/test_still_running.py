"""What cannot be ended is said first, and nothing else is played before it is gone."""

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Thread

import pytest

from excite_cli.campaign import measure_command, supervised
from excite_cli.campaign.measure import NotMeasuredError, StillRunningError
from excite_cli.campaign.measure_command import MeasureCommand
from excite_cli.campaign.process_table import running
from excite_cli.campaign.same_motion import is_measured
from excite_cli.campaign.supervised import left_in
from excite_cli.campaign.supervisor import ProgramExit
from tests.campaign.campaign_process import program, said, take_in, until

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")
# A supervisor with something changed, given the path of imports.
_SERVE = """
import signal, sys
sys.path[:] = sys.argv[1:]
from excite_cli.campaign import process_table, supervisor
send = process_table.send_to_all
{}
supervisor.serve()
"""
# SIGKILL does nothing, as with a process that waits for hardware.
WITHOUT_FORCE = """
process_table.send_to_all = (
    lambda *given: None if given[2] == signal.SIGKILL else send(*given)
)
"""
# As where there is no /proc, and no process can adopt another's children.
WITHOUT_PROC = "supervisor.adopt_orphans = lambda: False"
DEAF = """
for each in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
    signal.signal(each, signal.SIG_IGN)
print(os.getpid(), flush=True)
time.sleep(600)
"""


@pytest.mark.long
def test_a_process_that_no_signal_ends_is_said_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = [sys.executable, "-P", "-c", _SERVE.format(WITHOUT_FORCE), *sys.path]
    monkeypatch.setattr(supervised, "command", lambda module: words)
    take, line = take_in(tmp_path), program(tmp_path, DEAF)
    measure = MeasureCommand.of(line, limit=3.0, grace=0.2)
    with pytest.raises(StillRunningError) as error:
        measure.take(take)
    pid = int(said(tmp_path, "m.txt"))
    try:
        assert str(error.value).startswith(f"still running: process {pid} (")
        assert "of the measuring program. The robot may move: stop it by hand" in str(error.value)
        # Its supervisor keeps the lock: the next one is not played beside it.
        with pytest.raises(StillRunningError, match=rf"process {pid} \("):
            MeasureCommand.of(line, limit=0.3).take(take)
    finally:
        os.kill(pid, signal.SIGKILL)
    until(lambda: not left_in(tmp_path) and pid not in running(), "the supervisor has ended, too")


@pytest.mark.long
def test_without_proc_the_group_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    words = [sys.executable, "-P", "-c", _SERVE.format(WITHOUT_PROC), *sys.path]
    monkeypatch.setattr(supervised, "command", lambda module: words)
    line = program(tmp_path, "if os.fork():\n    time.sleep(600)\n" + DEAF)
    with pytest.raises(NotMeasuredError, match="still running after 3 s"):
        MeasureCommand.of(line, limit=3.0, grace=0.2).take(take_in(tmp_path))
    assert int(said(tmp_path, "m.txt")) not in running()


@contextmanager
def interrupts() -> Iterator[None]:
    """SIGINT as Python has it, however the tests were started."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)


def test_what_still_runs_is_said_before_an_interruption(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """That comes once the program has ended."""
    ends = iter([ProgramExit(None, "asked", alive="process 4711 (python)"), ProgramExit(1)])

    def interrupted(*given: object) -> ProgramExit:
        os.kill(os.getpid(), signal.SIGINT)
        return next(ends)

    monkeypatch.setattr(measure_command, "followed", interrupted)
    measure, take = MeasureCommand.of("x {motion} {data}"), take_in(tmp_path)
    with interrupts():
        with pytest.raises(StillRunningError, match=r"^still running: process 4711 \(python\), "):
            measure.take(take)
        with pytest.raises(KeyboardInterrupt):
            measure.take(take)


def test_a_program_is_run_from_any_thread(tmp_path: Path) -> None:
    """Only the main thread hears signals; the others need not hold them."""
    take = take_in(tmp_path)
    line = program(tmp_path, "open(sys.argv[2], 'w').write('whole')")
    thread = Thread(target=MeasureCommand.of(line).take, args=(take,))
    thread.start()
    thread.join()
    assert is_measured(take.data)


def test_what_goes_wrong_in_the_campaign_ends_the_program(tmp_path: Path) -> None:
    """A full disk under what it says, for one."""
    body = """
if os.fork() == 0:
    os.setsid()
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    time.sleep(600)
open(sys.argv[2], "w").write("whole")
"""

    def fail(note: object) -> None:
        raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match="No space left"):
        MeasureCommand.of(program(tmp_path, body), tell=fail, grace=0.3).take(take_in(tmp_path))
    assert left_in(tmp_path) == []


def test_a_terminal_that_has_closed_leaves_the_program_its_time(tmp_path: Path) -> None:
    """A terminal that closes: SIGHUP comes, and nothing can be printed any more."""
    body = """
def stop(*_):
    time.sleep(0.5)
    print("stopped the robot", flush=True)
    sys.exit(5)
signal.signal(signal.SIGTERM, stop)
print("here", flush=True)
time.sleep(600)
"""

    def fail(note: object) -> None:
        raise OSError(5, "Input/output error")

    def close() -> None:
        until(lambda: "here" in said(tmp_path, "m.txt"), "the program has started")
        os.kill(os.getpid(), signal.SIGINT)

    measure, terminal = MeasureCommand.of(program(tmp_path, body), tell=fail), Thread(target=close)
    with interrupts():
        terminal.start()
        with pytest.raises(KeyboardInterrupt):
            measure.take(take_in(tmp_path))
    terminal.join()
    assert "stopped the robot" in said(tmp_path, "m.txt")
