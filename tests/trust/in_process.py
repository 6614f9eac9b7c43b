"""The program called in this process, in the folder and environment of the test."""

import os
from pathlib import Path
from subprocess import CompletedProcess

from tests.cli.this_process import call

_PATIENCE = 300.0  # s


def excite(*arguments: str | Path) -> CompletedProcess[str]:
    """Run the program; a bug of it would be status 70."""
    return call([*map(str, arguments)], Path.cwd(), dict(os.environ), _PATIENCE)


def done(*arguments: str | Path) -> CompletedProcess[str]:
    """The same of what must end well."""
    ended = excite(*arguments)
    assert ended.returncode == 0, (ended.stderr, arguments)
    return ended


def refused(*arguments: str | Path) -> str:
    """The sentence with which the program refuses."""
    ended = excite(*arguments)
    assert ended.returncode == 2, (ended, arguments)
    assert "Traceback" not in ended.stderr
    before, mark, told = ended.stderr.rpartition("error: ")
    assert mark, ended.stderr
    assert not before or before.endswith("\n"), ended.stderr
    return told
