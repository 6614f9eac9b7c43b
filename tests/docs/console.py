"""The console blocks of a page of documentation, and what the page says about running them.

A page may hold HTML comments, which readers do not see:

    <!-- needs: arm.yaml measured.csv configs/ -->   files and folders that are there at the start
    <!-- first: excite optimize … -->                a command that is run before all others
    <!-- status: 1 -->                               exit status of the next command
    <!-- not run: why -->                            the next block is left out
"""

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

# Words that begin a line which a test cannot or need not run.
SET_UP = {
    "git", "make", "pip", "pipx", "uv", "python", "python3", "cd", ".", "source", "apt-get", "sudo",
    "ros2", "code", "xacro", "export", "open", "xdg-open", "docker",
}  # fmt: skip

_FENCE = re.compile(r"^\s*(`{3,})(\w*)")
_COMMENT = re.compile(r"^\s*<!--\s*(needs|first|status|not run):\s*(.*?)\s*-->\s*$")


@dataclass(frozen=True)
class Command:
    """One line as it is typed, the exit status it must end with, and where it stands."""

    line: str
    status: int
    number: int


@dataclass(frozen=True)
class Page:
    """What a page needs and runs, in order."""

    path: Path
    needs: tuple[str, ...]
    commands: tuple[Command, ...]


def read_page(path: Path) -> Page:
    """Read a Markdown file.

    Commands are lines that begin with `$ ` in any block, and every line of a block marked `sh`.
    """
    needs: list[str] = []
    commands: list[Command] = []
    status, skipped = 0, False
    fence, language, pending = "", "", ""
    lines = path.read_text(encoding="utf-8").splitlines()
    for number, line in enumerate(lines, start=1):
        if match := _FENCE.match(line):
            if not fence:
                fence, language = match.group(1), match.group(2)
            elif match.group(1) == fence:
                fence, skipped, pending = "", False, ""
            continue
        if not fence:
            if match := _COMMENT.match(line):
                kind, words = match.groups()
                needs += words.split() if kind == "needs" else []
                commands += [Command(words, 0, number)] if kind == "first" else []
                status = int(words) if kind == "status" else status
                skipped = skipped or kind == "not run"
            continue
        text = pending + line.strip()
        typed = bool(pending) or text.startswith("$ ") or language == "sh"
        if skipped or not typed or not text or text.startswith("#"):
            continue
        if text.endswith("\\"):
            pending = text[:-1]
            continue
        pending = ""
        text = text.removeprefix("$ ").strip()
        if _first_word(text) not in SET_UP:
            commands.append(Command(text, status, number))
            status = 0
    return Page(path, tuple(needs), tuple(commands))


def _first_word(text: str) -> str:
    return text.split(maxsplit=1)[0]


def words_of(line: str) -> list[str]:
    """The words of a command, comments left out."""
    return shlex.split(line, comments=True)
