"""SIGTERM once, SIGKILL after the grace or at the second request, and how long that is tried."""

import signal

import pytest

from excite_cli.campaign import processes
from excite_cli.campaign.processes import Escalation, Process

INSIDE, OUTSIDE = Process(11, 10, "play", start=1), Process(12, 12, "daemon", start=1)


class Bench:
    """A clock, processes that run, and the signals that were sent."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now, self.running = 0.0, [INSIDE, OUTSIDE]
        self.sent: list[tuple[int, tuple[int, ...]]] = []
        monkeypatch.setattr(processes.time, "monotonic", lambda: self.now)
        monkeypatch.setattr(processes, "send_to_all", self._note)
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


def test_nothing_happens_before_a_request(bench: Bench) -> None:
    assert bench.at(100.0) == []


def test_sigterm_once_then_sigkill_after_the_grace_whatever_happens(bench: Bench) -> None:
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
