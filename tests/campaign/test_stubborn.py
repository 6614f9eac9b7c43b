"""Programs that do not want to end, stopped in every way: nothing of them runs on."""

import signal
from pathlib import Path

import pytest

from tests.campaign.campaign_process import PATIENCE, program, said, start, until
from tests.campaign.stubborn_programs import KINDS, alive, command_of, noted

LONG = 600.0  # s: with this grace, nothing but a second signal ends them in time
pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc"),
]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("signals", "limit", "grace", "status"),
    [
        ((), 2.0, 0.3, 1),
        ((signal.SIGINT,), LONG, 0.3, 130),
        ((signal.SIGTERM,), LONG, 0.3, 143),
        ((signal.SIGHUP,), LONG, 0.3, 129),
        ((signal.SIGQUIT,), LONG, 0.3, -signal.SIGQUIT),
        ((signal.SIGINT, signal.SIGINT), LONG, LONG, 130),
        ((signal.SIGINT, signal.SIGTERM), LONG, LONG, 130),
        ((signal.SIGTERM, signal.SIGHUP), LONG, LONG, 143),
    ],
    ids=["limit", "INT", "TERM", "HUP", "QUIT", "INT-INT", "INT-TERM", "TERM-HUP"],
)
def test_nothing_of_a_stubborn_program_runs_on(
    kind: str,
    signals: tuple[signal.Signals, ...],
    limit: float,
    grace: float,
    status: int,
    tmp_path: Path,
) -> None:
    campaign = start(command_of(kind, tmp_path), tmp_path, limit, grace)

    def started() -> bool:
        return len(noted(tmp_path)) == KINDS[kind][0] or (
            not signals and campaign.poll() is not None
        )

    until(started, "the program has started")
    for number in signals:
        campaign.send_signal(number)
        until(lambda: "is asked to stop the robot" in said(tmp_path), "the first signal is heard")
    assert campaign.wait(PATIENCE) == status
    assert alive(tmp_path) == []
    assert ("still running after 2 s" in said(tmp_path)) == (not signals)


def test_what_a_failed_program_leaves_is_ended_at_once(tmp_path: Path) -> None:
    body = """
child = os.fork()
if child == 0:
    time.sleep(600)
print(child, flush=True)
sys.exit(3)
"""
    campaign = start(program(tmp_path, body), tmp_path, grace=LONG)
    assert campaign.wait(PATIENCE) == 1
    assert "exit status 3" in said(tmp_path)
    child = int(said(tmp_path, "m.txt"))
    assert not Path(f"/proc/{child}").exists()


def test_what_a_good_program_leaves_is_waited_for_and_then_ended(tmp_path: Path) -> None:
    """The first child ends by itself in time, the second one does not."""
    body = """
open(sys.argv[2], "w").write("whole")
for seconds in (0.2, 600):
    if os.fork() == 0:
        os.setsid()
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        time.sleep(seconds)
        os._exit(0)
"""
    campaign = start(program(tmp_path, body), tmp_path, grace=1.5)
    assert campaign.wait(PATIENCE) == 0
    words = said(tmp_path)
    assert words.count("process ") >= 2
    assert "the program has ended, and left running: process " in words
    ended = next(line for line in words.splitlines() if "excite has ended: " in line)
    assert ended.count("process ") == 1
    pid = int(ended.split("process ")[1].split()[0])
    assert not Path(f"/proc/{pid}").exists()
    assert (tmp_path / "log of m.csv").read_text() == "whole"


def test_a_program_that_is_stopped_hears_that_it_is_to_end(tmp_path: Path) -> None:
    """SIGSTOP, as a debugger leaves it: it could not stop the robot."""
    body = """
def stop(*_):
    print("stopped the robot", flush=True)
    sys.exit(5)
signal.signal(signal.SIGTERM, stop)
print("here", flush=True)
os.kill(os.getpid(), signal.SIGSTOP)
time.sleep(600)
"""
    campaign = start(program(tmp_path, body), tmp_path, grace=LONG)
    until(lambda: "here" in said(tmp_path, "m.txt"), "the program has started")
    campaign.send_signal(signal.SIGTERM)
    assert campaign.wait(PATIENCE) == 143
    assert "stopped the robot" in said(tmp_path, "m.txt")
