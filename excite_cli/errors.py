"""Errors the program raises on purpose, each with the exit status it leads to.

Every message says what is wrong, where, what would have been allowed and what to do. Anything
that is not an `ExciteError` is a bug of this program (exit status 70).
"""

import difflib
import errno
import re
from collections.abc import Iterable, Sequence
from importlib import import_module
from typing import Any

_ENOUGH_TO_GUESS = 3  # letters


# A word that foreign files may have in a message, and what stays of a longer one, in characters.
_LONGEST_WORD, _BEGINNING = 1000, 200


class ExciteError(Exception):
    """Base of all errors raised on purpose; `exit_status` is what the command line returns."""

    exit_status = 2

    def __init__(self, message: str = "") -> None:
        long = rf"(\S{{{_BEGINNING}}})\S{{{_LONGEST_WORD - _BEGINNING},}}"
        super().__init__(re.sub(long, r"\1…", str(message)))


class ConfigError(ExciteError):
    """The YAML problem, an override or an option is wrong."""


class RobotError(ExciteError):
    """The URDF, one of its meshes, or what was asked of the robot is wrong."""


class FileError(ExciteError):
    """A file that was given cannot be read, is of another program, or must not be overwritten."""


class ContradictionError(FileError):
    """Data that cannot be of the robot as it is set up; `faults`: what is wrong on which joints."""

    def __init__(self, message: str, faults: Sequence[tuple[str, tuple[str, ...]]] = ()) -> None:
        super().__init__(message)
        self.faults = tuple(faults)


class MissingExtraError(ExciteError):
    """An optional library is needed for what was asked and is not installed."""


def optional_module(name: str, missing: str) -> Any:
    """The module `name` of a library that may not be installed.

    Raises
    ------
    MissingExtraError
        It is not; `missing` says what needs it, and how to install it.
    """
    try:
        return import_module(name)
    except ImportError as error:
        raise MissingExtraError(missing) from error


class NoAdmissibleMotionError(ExciteError):
    """The problem is well posed, but no motion within all its constraints was found."""

    exit_status = 1


class ExciteWarning(UserWarning):
    """Something outside the program is set aside, and the work goes on without it."""


def nearest(word: str, allowed: Iterable[str], cutoff: float = 0.6) -> str:
    """Return ` Did you mean 'x'?` for the allowed word nearest to `word`, or an empty string.

    A word that is the beginning of an allowed one is near, however much longer that is.
    """
    options = list(allowed)
    match = difflib.get_close_matches(word, options, n=1, cutoff=cutoff)
    if not match and len(word) >= _ENOUGH_TO_GUESS:
        match = [each for each in options if each.lower().startswith(word.lower())]
    return f" Did you mean '{match[0]}'?" if match else ""


# What a file system may refuse, and what helps.
REFUSALS = {
    errno.EACCES: "no permission. Change it with chmod, or give another place.",
    errno.EPERM: "no permission. Change it with chmod, or give another place.",
    errno.EROFS: "this file system is read-only. Give another place.",
    errno.ENOSPC: "no space is left on the disk. Free some, or give another place.",
    errno.EDQUOT: "the disk quota is used up. Free some space, or give another place.",
    errno.EFBIG: "it is larger than files may be here (ulimit -f). Give another place.",
    errno.ENOTDIR: "a part of this path is a file, not a folder. Give another place.",
    errno.EEXIST: "a part of this path is a file, not a folder. Give another place.",
    errno.ENOENT: "its folder is gone, or cannot be made. Give another place.",
    errno.ENAMETOOLONG: "this name is too long. Give a shorter one.",
    errno.ELOOP: "its symbolic links lead in a circle. Give another place.",
    errno.EIO: "the disk reports an error. Give another place.",
}


def refusal(error: OSError) -> str:
    """Why the file system refused, and what helps.

    Libraries that write files themselves hide the number of the error in the text.
    """
    number = error.errno
    hidden = re.search(r"errno = (\d+)", str(error))
    if number not in REFUSALS and hidden is not None:
        number = int(hidden[1])
    return REFUSALS.get(number or 0, f"{error.strerror or error}.")
