"""Arguments of the library's functions, seen to before any work begins.

At the command line every argument is a text. A script may give None, a number or another record in
its place, and is told so in one sentence instead of by an error from deep inside.
"""

import errno
import inspect
import os
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import cache, wraps
from numbers import Integral, Real
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, ParamSpec, TypeVar, Union, get_args, get_origin, get_type_hints

from excite_cli.errors import REFUSALS, ConfigError, FileError
from excite_cli.measurement.dataset import Dataset

P = ParamSpec("P")
R = TypeVar("R")

_NAME, _PATH = 255, 4095  # bytes that file systems allow
_WORDS = {NoneType: "None", str: "text", int: "a whole number", float: "a number"}
_SHOWN = 60  # characters of what was given


def checked(*besides: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Refuse arguments that are not what the function's annotations say.

    The function raises `ConfigError` for what is of another type, and `FileError` for what no file
    can be called. Of those `besides` it finds out itself what they are.
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        signature = inspect.signature(function)
        hints = cache(lambda: get_type_hints(function))

        @wraps(function)
        def guarded(*args: P.args, **kwargs: P.kwargs) -> R:
            for name, value in signature.bind(*args, **kwargs).arguments.items():
                if name not in besides:
                    _require(value, hints()[name], function.__name__, name)
                elif isinstance(value, str | Path):
                    _require_name(str(value))
            return function(*args, **kwargs)

        return guarded

    return decorate


def _require(value: object, hint: Any, function: str, name: str) -> None:
    choices = _choices(hint)
    if not any(_fits(value, choice) for choice in choices):
        given = repr(value)
        given = given if len(given) <= _SHOWN else f"{given[:_SHOWN]}…"
        raise ConfigError(
            f"{function}: {name} is {given} ({type(value).__name__}). Give {_listed(choices)}."
        )
    if Path in choices and isinstance(value, str | Path):
        _require_name(str(value))
    elif isinstance(value, Sequence) and not isinstance(value, str):
        for choice in choices:
            if get_origin(choice) is Sequence:
                for each in value:
                    _require(each, get_args(choice)[0], function, f"one of {name}")


def _choices(hint: Any) -> tuple[Any, ...]:
    return get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)


def _fits(value: object, hint: Any) -> bool:
    kind = get_origin(hint) or hint
    if kind is Sequence:
        return isinstance(value, Collection) and not isinstance(value, str | bytes | Mapping)
    if kind is int:
        return isinstance(value, Integral) and not isinstance(value, bool)
    if kind is float:
        return isinstance(value, Real) and not isinstance(value, bool)
    return not isinstance(kind, type) or kind is object or isinstance(value, kind)


def _in_words(hint: Any) -> str:
    if get_origin(hint) is Sequence:
        return f"a list ({_listed(_choices(get_args(hint)[0]))})"
    if get_origin(hint) is Mapping:
        return "a dict"
    return _WORDS.get(hint, getattr(hint, "__name__", str(hint)))


def _listed(choices: tuple[Any, ...]) -> str:
    *words, last = dict.fromkeys(map(_in_words, choices))
    return f"{', '.join(words)} or {last}" if words else last


def _require_name(path: str) -> None:
    """Raise FileError for what no system call takes."""
    try:
        name = os.fsencode(path)
    except UnicodeEncodeError as error:
        raise FileError(f"{path[:_SHOWN]!r} is the name of no file: {error.reason}.") from error
    if b"\0" in name:
        raise FileError(f"{path[:_SHOWN]!r} is the name of no file: it holds a zero character.")
    if len(name) > _PATH or max(map(len, name.split(b"/"))) > _NAME:
        raise FileError(f"{path}: {REFUSALS[errno.ENAMETOOLONG]}")


# Paths that are given, seen to before any work begins.


def existing(path: str | Path) -> Path:
    """The path of a file or folder that is there.

    Raises
    ------
    FileError
        It is not.
    """
    if not Path(path).exists():
        raise FileError(f"There is no file {path}.")
    return Path(path)


def page_path(path: str | Path, hint: str = "") -> Path:
    """The path of a page that may be written.

    Raises
    ------
    FileError
        Its name is not that of a page.
    """
    if Path(path).suffix.lower() not in (".html", ".htm") and not Path(path).is_dir():
        raise FileError(f"-o {path}: a report is a page, NAME.html.{hint}")
    return Path(path)


def paths_in(*given: object) -> list[Path]:
    """Those of `given` that are files, also in lists, and the files that data were read from."""
    listed = [x for each in given for x in (each if isinstance(each, list | tuple) else [each])]
    read = [x for each in listed for x in (each.sources if isinstance(each, Dataset) else [each])]
    return [Path(each) for each in read if isinstance(each, str | Path)]


def refuse_twice(paths: Iterable[Path]) -> None:
    """See that no file is given twice, whatever it is called.

    Raises
    ------
    FileError
        One is.
    """
    seen: set[Path] = set()
    for path in paths:
        if path.resolve() in seen:
            raise FileError(f"{path} is given twice.")
        seen.add(path.resolve())
