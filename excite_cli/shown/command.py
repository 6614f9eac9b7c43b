"""A command line that is suggested, as it can be pasted into a shell."""

import shlex
from dataclasses import dataclass


@dataclass(frozen=True)
class Command:
    """The words of a command, names of files as they are; `line` has them quoted for a shell."""

    words: tuple[str, ...]

    @property
    def line(self) -> str:
        """`excite optimize 'my arm.yaml'`."""
        return shlex.join(self.words)


def as_word(name: object) -> str:
    """The name of a file as a word of a command: one that begins with a minus is no option."""
    text = str(name)
    return f"./{text}" if text.startswith("-") else text
