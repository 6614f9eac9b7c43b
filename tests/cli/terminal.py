"""The installed program on a terminal of its own, some columns wide."""

import contextlib
import fcntl
import os
import pty
import re
import struct
import subprocess
import termios
from pathlib import Path

_ESCAPES = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")


def seen_on_a_terminal(
    words: list[str], columns: int, folder: Path, variables: dict[str, str], typed: str = ""
) -> tuple[int, str]:
    """The exit status, and all that was printed, replaced lines included, but what steers."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 40, columns, 0, 0))
    kept = {name: value for name, value in variables.items() if name != "COLUMNS"}
    process = subprocess.Popen(
        words,
        cwd=folder,
        env={**kept, "TERM": "xterm"},
        stdin=theirs if typed else subprocess.DEVNULL,
        stdout=theirs,
        stderr=theirs,
    )
    os.close(theirs)
    os.write(ours, typed.encode())
    text = b""
    with contextlib.suppress(OSError):  # the other side is closed
        while read := os.read(ours, 65536):
            text += read
    os.close(ours)
    status = process.wait(60)
    # Where a line begins anew, the terminal's cursor moves; all of them are kept here.
    moved = re.sub(r"\x1b\[[0-9]*[AGK]", "\n", text.decode(errors="replace"))
    lines = re.split(r"[\r\n]+", _ESCAPES.sub("", moved))
    return status, "\n".join(line for line in lines if line.strip())
