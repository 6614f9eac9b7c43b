"""A campaign's process that runs one program and hears signals as the command line does."""

import os
import subprocess
import sys
import textwrap
import time
from collections.abc import Callable
from pathlib import Path

from excite_cli.campaign.measure import Take

PATIENCE = 60.0  # s, for a busy machine
_SCRIPT = """
import resource, signal, sys
from pathlib import Path
from excite_cli.campaign.measure_command import MeasureCommand
from excite_cli.campaign.measure import NotMeasuredError
from excite_cli.cli.stopping import heed_signals, stopped
from tests.campaign.campaign_process import take_in

def say(note):
    print(note.sentence, file=sys.stderr, flush=True)

line, limit, grace, folder = sys.argv[1:]
# Whatever runs the tests may have let them be ignored (nohup, a shell's background).
signal.signal(signal.SIGINT, signal.default_int_handler)
for each in (signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
    signal.signal(each, signal.SIG_DFL)
resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
heed_signals()
try:
    command = MeasureCommand.of(line, limit=float(limit), tell=say, grace=float(grace))
    command.take(take_in(Path(folder)))
except NotMeasuredError as error:
    print(error, file=sys.stderr)
    sys.exit(error.exit_status)
except KeyboardInterrupt:
    sys.exit(stopped([])[0])
"""


def take_in(folder: Path) -> Take:
    motion = folder / "m 1.csv"
    motion.write_text("t\n0\n")
    return Take("m", motion, folder / "log of m.csv", 1.0, folder / "m.txt")


def program(folder: Path, body: str) -> str:
    """The line for a program of that body; its `sys.argv[1:]` are motion, log and name."""
    head = "import sys, time, os, signal, subprocess\n"
    (folder / "play.py").write_text(head + textwrap.dedent(body))
    return f"'{sys.executable}' '{folder / 'play.py'}' {{motion}} {{data}} {{name}}"


def start(
    line: str, folder: Path, limit: float = 600.0, grace: float = 10.0
) -> subprocess.Popen[bytes]:
    """What it says goes to said.txt."""
    with (folder / "said.txt").open("wb") as said:
        return subprocess.Popen(
            [sys.executable, "-c", _SCRIPT, line, str(limit), str(grace), str(folder)],
            stderr=said,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        )


def begun(line: str, folder: Path, **given: float) -> tuple[subprocess.Popen[bytes], int]:
    """The same, and the id that its program says first."""
    campaign = start(line, folder, **given)
    until(lambda: "\n" in said(folder, "m.txt"), "the program has started")
    return campaign, int(said(folder, "m.txt"))


def said(folder: Path, by: str = "said.txt") -> str:
    """What the campaign has said so far, or its program (m.txt)."""
    path = folder / by
    return path.read_text() if path.exists() else ""


def until(done: Callable[[], object], what: str) -> None:
    """Wait for it, however busy the machine is."""
    end = time.monotonic() + PATIENCE
    while not done():
        assert time.monotonic() < end, f"not within {PATIENCE:.0f} s: {what}"
        time.sleep(0.02)
