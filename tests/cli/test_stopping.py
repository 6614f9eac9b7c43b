"""Ctrl-C asks for the answer so far, and the second time it ends the command."""

import os
import signal
import threading

import pytest

from excite_cli.cli.stopping import answer_so_far


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
