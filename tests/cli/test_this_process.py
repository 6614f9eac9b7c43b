"""A call of the program in this process is told from one of its own by nothing but the time."""

import ctypes
import logging
import os
import re
import signal
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import pytest

from excite_cli.cli import app
from tests.cli.program import SMOKE, Installed, Program
from tests.cli.this_process import TooLong, call

Printed = Callable[..., tuple[int, str, str]]


@pytest.fixture
def printed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Printed:
    """Exit status, output and error of a function in the place of the program's entry point."""

    def run(main: Callable[[], object], patience: float = 20.0) -> tuple[int, str, str]:
        monkeypatch.setattr(app, "main", main)
        done = call(["some", "words"], tmp_path, {"HERE": "yes"}, patience)
        return done.returncode, done.stdout, done.stderr

    return run


def in_time(printed: str) -> str:
    """Without what is said of a wait: how long one waits is the machine's."""
    return re.sub(r"^.*; [0-9]+ s so far.*\n", "", printed, flags=re.MULTILINE)


@pytest.mark.long
@pytest.mark.parametrize(
    "arguments", [("schema",), ("check", SMOKE, "none.h5"), ("optimise",), ("robots", "ur10"), ()]
)
def test_the_same_as_in_a_process_of_its_own(
    arguments: tuple[str, ...], tmp_path: Path, cache: Path
) -> None:
    here, apart = Program(tmp_path, cache)(*arguments), Installed(tmp_path, cache)(*arguments)
    assert (here.returncode, here.stdout, in_time(here.stderr)) == (
        apart.returncode,
        apart.stdout,
        in_time(apart.stderr),
    )
    assert here.stdout or here.stderr


def test_python_c_and_children_print_into_the_same_place(printed: Printed) -> None:
    def main() -> None:
        print("Python", flush=True)
        ctypes.CDLL(None).puts(b"C")
        os.system("echo child >&2; cat")
        warnings.warn("careful", UserWarning, stacklevel=1)
        logging.getLogger("some library").warning("logged")

    status, out, err = printed(main)
    assert status == 0
    assert sorted(out.split()) == ["C", "Python"]
    assert err.startswith("child\n")
    assert "UserWarning: careful" in err
    assert "logged" in err


def test_all_is_put_back(printed: Printed, tmp_path: Path) -> None:
    def state() -> list[object]:
        handlers = [signal.getsignal(each) for each in (signal.SIGTERM, signal.SIGALRM)]
        streams = [sys.stdin, sys.stdout, sys.stderr, list(sys.argv), list(sys.path)]
        return [os.getcwd(), dict(os.environ), *handlers, *streams, "excite_own" in sys.modules]

    (tmp_path / "excite_own.py").write_text("", encoding="utf-8")
    seen: list[object] = []

    def main() -> None:
        seen.extend([Path.cwd(), os.environ["HERE"], sys.argv, "PATH" in os.environ])
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        sys.path.insert(0, str(tmp_path))
        __import__("excite_own")
        os.environ["THERE"] = "too"
        os.chdir("/")

    before = state()
    printed(main)
    assert seen == [tmp_path, "yes", ["excite", "some", "words"], False]
    assert state() == before


def test_a_call_without_end_is_ended(printed: Printed) -> None:
    with pytest.raises(TooLong):
        printed(lambda: time.sleep(20), 0.2)
