"""Ctrl-C asks for the answer so far, the second time it ends the command; idle workers."""

import os
import signal
import threading

import pytest

from excite_cli.api.working import tell_idle, working
from excite_cli.cli.console import Terminal
from excite_cli.cli.stopping import answer_so_far, stopped


def interrupt() -> None:
    os.kill(os.getpid(), signal.SIGINT)


def test_the_first_time_it_is_asked_for_and_the_second_time_it_interrupts() -> None:
    told: list[str] = []
    before = signal.getsignal(signal.SIGINT)
    with answer_so_far(lambda: told.append("asked")) as ended:
        assert not ended()
        interrupt()
        assert ended()
        assert told == ["asked"]
        with pytest.raises(KeyboardInterrupt):
            interrupt()
    assert signal.getsignal(signal.SIGINT) == before


def test_no_other_thread_is_asked() -> None:
    said: list[bool] = []

    def run() -> None:
        with answer_so_far(lambda: None) as ended:
            said.append(ended())

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    assert said == [False]


def test_a_system_that_does_not_tell_its_affinity_has_all_processors(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    monkeypatch.setattr(os, "cpu_count", lambda: 3)
    working(4, None, 1, Terminal().tell).close()
    assert "4 workers share 3 processors" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("workers", "starts", "said"),
    [
        (2, 1, "hint: one start keeps one of 2 workers busy"),
        (4, 3, "hint: 3 starts keep 3 of 4 workers busy"),
        (2, 2, ""),
        (1, 1, ""),
    ],
)
def test_idle_workers_are_told(
    workers: int, starts: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    tell_idle(workers, starts, Terminal().tell)
    told = capsys.readouterr().err
    assert said in told
    assert bool(said) == bool(told)


def test_what_can_be_gone_on_with_is_told_how() -> None:
    assert stopped(["optimize", "a.yaml"])[1].endswith("so far is in the file: see --resume.")
    assert stopped(["study", "a.yaml"])[1].endswith("case is in the folder: see --resume.")
    assert stopped(["check", "a.h5"]) == (
        128 + signal.SIGINT,
        "interrupted; no file is half-written.",
    )
