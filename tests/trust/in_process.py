"""The program in this process: its exit status, and what it printed."""

import contextlib
import io
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from excite_cli.cli.app import main


@dataclass(frozen=True)
class Ended:
    """How a command ended."""

    status: int
    out: str
    err: str


def excite(*arguments: str | Path) -> Ended:
    """Run the program; a bug of it would be status 70."""
    out, err = io.StringIO(), io.StringIO()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["excite", *map(str, arguments)])
        with (
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(err),
            pytest.raises(SystemExit) as ended,
        ):
            main()
    status = ended.value.code
    return Ended(status if isinstance(status, int) else 0, out.getvalue(), err.getvalue())


def refused(*arguments: str | Path) -> str:
    """The sentence with which the program refuses."""
    ended = excite(*arguments)
    assert ended.status == 2, (ended, arguments)
    assert "Traceback" not in ended.err
    before, mark, told = ended.err.rpartition("error: ")
    assert mark, ended.err
    assert not before or before.endswith("\n"), ended.err
    return told
