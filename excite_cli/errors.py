"""Errors the program raises on purpose, each with the exit status it leads to.

Every message says what is wrong, where, what would have been allowed and what to do. Anything
that is not an `ExciteError` is a bug of ours (exit status 70).
"""

import difflib
from collections.abc import Iterable

_ENOUGH_TO_GUESS = 3  # letters


class ExciteError(Exception):
    """Base of all errors raised on purpose; `exit_status` is what the command line returns."""

    exit_status = 2


class ConfigError(ExciteError):
    """The YAML problem, an override or an option is wrong."""


class RobotError(ExciteError):
    """The URDF, one of its meshes, or what was asked of the robot is wrong."""


class FileError(ExciteError):
    """A file that was given cannot be read, is not ours, or must not be overwritten."""


class MissingExtraError(ExciteError):
    """An optional library is needed for what was asked and is not installed."""


class NoAdmissibleMotionError(ExciteError):
    """The problem is well posed, but no motion within all its constraints was found."""

    exit_status = 1


def nearest(word: str, allowed: Iterable[str], cutoff: float = 0.6) -> str:
    """Return ` Did you mean 'x'?` for the allowed word nearest to `word`, or an empty string.

    A word that is the beginning of an allowed one is near, however much longer that is.
    """
    options = list(allowed)
    match = difflib.get_close_matches(word, options, n=1, cutoff=cutoff)
    if not match and len(word) >= _ENOUGH_TO_GUESS:
        match = [each for each in options if each.lower().startswith(word.lower())]
    return f" Did you mean '{match[0]}'?" if match else ""
