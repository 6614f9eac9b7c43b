"""What those who wait see: a word after two seconds, then one every ten, and never a stale one."""

import re
import sys
import time

import pytest

from excite_cli.api.showing import Answer, Level, Note
from excite_cli.cli import waiting
from excite_cli.cli.console import Terminal
from tests.cli.program import SMOKE, Program, environment
from tests.cli.terminal import seen_on_a_terminal


@pytest.fixture
def hasty(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lines after 0.06 s, then every 0.3 s."""
    for name, value in {"_FIRST": 0.06, "_AGAIN": 0.3, "_LOOK": 0.01}.items():
        monkeypatch.setattr(waiting, name, value)


def lines(capsys: pytest.CaptureFixture[str]) -> list[str]:
    return re.sub(r"\b\d+ s so far", "T", capsys.readouterr().err).splitlines()


@pytest.mark.usefixtures("hasty")
def test_a_log_has_a_word_soon_then_now_and_then(capsys: pytest.CaptureFixture[str]) -> None:
    terminal = Terminal()
    with terminal.waiting("diagnose"):
        time.sleep(0.15)
        assert lines(capsys) == ["diagnose: preparing; T"]
        terminal.tell(Note(Level.STEP, "reading and checking the data"))
        time.sleep(0.3)
        assert lines(capsys) == ["diagnose: reading and checking the data; T"]
        terminal.say("a message")
        time.sleep(0.15)
        assert lines(capsys) == ["a message"]  # nothing more is needed soon
        terminal.show(Answer(("the answer",), {}))
        time.sleep(0.4)
        assert lines(capsys) == []  # nor after the answer


@pytest.mark.usefixtures("hasty")
@pytest.mark.parametrize("silent", [Terminal(quiet=True), Terminal(progress=False)])
def test_nothing_where_nothing_is_wanted(
    silent: Terminal, capsys: pytest.CaptureFixture[str]
) -> None:
    with silent.waiting("diagnose"), silent.live("drawing", 3) as line:
        line("frame 1/3", 1)
        time.sleep(0.2)
    assert capsys.readouterr().err == ""


def told(made: waiting.InLog) -> str:
    return re.sub(r"\b\d+ s so far", "T", made.words(time.monotonic() + 10.0))


def test_how_long_it_will_take() -> None:
    made = waiting.InLog(str)
    with made.step("view", None):
        with made.step("drawing", None) as line:
            line("frame 21/60", 20, 60)
            assert told(made) == "drawing: frame 21/60; T, 20 s more at most"
            made.begin("", "round 2, planning")
            assert told(made) == "round 2, planning: preparing; T"
        assert told(made) == "view: finishing; T"
    with made.step("diagnose", 10) as line:
        made.begin("reading", "")
        line("pass 5", 5)
        assert told(made) == "diagnose: pass 5; T, 10 s more at most"


@pytest.mark.long
def test_a_terminal_shows_what_is_done(excite: Program) -> None:
    words = [sys.executable, "-m", "excite_cli", "simulate", str(SMOKE), "none.h5", "-o", "d.h5"]
    status, seen = seen_on_a_terminal(words, 80, excite.folder, environment(excite.cache))
    assert status == 2
    assert "simulate" in seen.split("error")[0]
