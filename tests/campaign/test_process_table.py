"""What runs of a program: found by parent, mark or session, and never taken for a later one.

It is ended by SIGTERM once, by SIGKILL after the grace or at the second request.
"""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from excite_cli.campaign import process_table
from excite_cli.campaign.process_table import (
    MARK,
    Escalation,
    Process,
    descendants,
    in_group,
    in_words,
    marked,
    of_session,
    running,
    send,
    start_of,
)
from tests.campaign.campaign_process import PATIENCE, until

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")
SLEEP = [sys.executable, "-c", "import time; time.sleep(600)"]


@pytest.fixture
def sleeper(tmp_path: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A process of its own session that bears the mark of `tmp_path`."""
    environment = {**os.environ, MARK: str(tmp_path / "log.csv")}
    process = subprocess.Popen(SLEEP, start_new_session=True, env=environment)
    yield process
    process.kill()
    process.wait()


def ids(found: list[Process]) -> list[int]:
    return [each.pid for each in found]


def test_descendants_are_found_whatever_their_session(sleeper: subprocess.Popen[bytes]) -> None:
    assert sleeper.pid in ids(descendants(os.getpid()))
    assert descendants(sleeper.pid) == []
    assert os.getpid() in ids(descendants(os.getppid()))


def test_what_has_ended_does_not_run(sleeper: subprocess.Popen[bytes]) -> None:
    sleeper.kill()
    # It was not waited for: it is still in /proc.
    until(lambda: sleeper.pid not in running(), "it is dead")
    assert Path(f"/proc/{sleeper.pid}/stat").exists()
    assert sleeper.pid not in ids(descendants(os.getpid()))


def test_a_process_whose_first_thread_has_ended_runs() -> None:
    script = """
import ctypes, threading, time
threading.Thread(target=time.sleep, args=(600,)).start()
print("here", flush=True)
ctypes.CDLL(None).pthread_exit(None)
"""
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE)
    try:
        assert process.stdout is not None
        process.stdout.readline()
        stat = Path(f"/proc/{process.pid}/stat")
        until(lambda: stat.read_text().rsplit(")", 1)[1].split()[0] == "Z", "its thread has ended")
        assert process.pid in running()
    finally:
        process.kill()
        process.wait()
        if process.stdout is not None:
            process.stdout.close()


def test_mark_and_session_are_told_from_others(
    sleeper: subprocess.Popen[bytes], tmp_path: Path
) -> None:
    until(lambda: ids(marked(tmp_path)) == [sleeper.pid], "it has begun")
    assert marked(tmp_path / "other") == []
    (longer := tmp_path.with_name(tmp_path.name[:-1])).mkdir(exist_ok=True)
    assert marked(longer) == []
    start = start_of(sleeper.pid)
    assert ids(of_session(sleeper.pid, start)) == [sleeper.pid]
    assert of_session(sleeper.pid, start - 1) == []  # the id was another process's then


@pytest.mark.parametrize("known", [True, False])
def test_a_signal_is_for_that_process_alone(
    known: bool, sleeper: subprocess.Popen[bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where pidfd is not known."""

    def unknown(pid: int) -> int:
        raise OSError(38, "Function not implemented")

    process = running()[sleeper.pid]
    if not known:
        monkeypatch.setattr(os, "pidfd_open", unknown)
    send(replace(process, start=process.start - 1), signal.SIGKILL)
    with pytest.raises(subprocess.TimeoutExpired):
        sleeper.wait(0.2)
    send(process, signal.SIGKILL)
    assert sleeper.wait(PATIENCE) == -signal.SIGKILL
    send(process, signal.SIGKILL)  # it is gone


def test_a_group_stands_for_its_processes(sleeper: subprocess.Popen[bytes]) -> None:
    """As where there is no /proc."""
    assert in_words(in_group(sleeper.pid)) == f"process group {sleeper.pid}"
    sleeper.kill()
    sleeper.wait()
    assert in_group(sleeper.pid) == []


def test_names_of_processes_may_hold_anything(tmp_path: Path) -> None:
    odd = tmp_path / "a) R 1 (b"
    odd.symlink_to("/bin/sleep")
    process = subprocess.Popen([odd, "600"])
    try:
        until(lambda: running()[process.pid].name == "a) R 1 (b", "it has begun")
        assert running()[process.pid].parent == os.getpid()
        assert in_words([running()[process.pid]]) == f"process {process.pid} (a) R 1 (b)"
    finally:
        process.kill()
        process.wait()


INSIDE, OUTSIDE = Process(11, 10, "play", start=1), Process(12, 12, "daemon", start=1)


class Bench:
    """A clock, processes that run, and the signals that were sent."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now, self.running = 0.0, [INSIDE, OUTSIDE]
        self.sent: list[tuple[int, tuple[int, ...]]] = []
        monkeypatch.setattr(process_table.time, "monotonic", lambda: self.now)
        monkeypatch.setattr(process_table, "send_to_all", self._note)
        self.ending = Escalation(lambda: self.running, 10, 5.0)

    def _note(self, processes: list[Process], group: int, number: int) -> None:
        assert group == 10
        self.sent.append((number, tuple(each.pid for each in processes)))

    def at(self, now: float) -> list[tuple[int, tuple[int, ...]]]:
        """What is sent in a step then."""
        self.now, self.sent = now, []
        self.ending.step()
        return self.sent


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Bench:
    return Bench(monkeypatch)


def test_sigterm_once_then_sigkill_after_the_grace_whatever_happens(bench: Bench) -> None:
    assert bench.at(-100.0) == []  # nothing happens before a request
    bench.now = 0.0
    bench.ending.request()
    assert bench.sent == [(signal.SIGTERM, (11, 12)), (signal.SIGCONT, (11, 12))]
    assert bench.at(4.9) == []  # a second SIGTERM would break off what the first one began
    assert bench.at(5.0) == [(signal.SIGKILL, (11, 12))]
    bench.running = [OUTSIDE, Process(13, 12, "child", start=2)]
    assert bench.at(5.1) == [(signal.SIGKILL, (12, 13))]  # also what was started since
    assert not bench.ending.in_vain
    bench.at(7.1)
    assert bench.ending.in_vain


def test_sigkill_at_once_when_asked_again(bench: Bench) -> None:
    bench.ending.request()
    bench.sent = []
    bench.ending.request()
    assert bench.sent == [(signal.SIGKILL, (11, 12))]
    bench.ending.request()  # a third time changes nothing
    assert bench.ending.stage == 2
