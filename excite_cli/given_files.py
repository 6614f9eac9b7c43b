"""Files that are given: read only if they can be, and never replaced by what is made of them."""

import os
import stat
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path

from excite_cli.errors import FileError

_KINDS = {
    stat.S_ISFIFO: "a named pipe",
    stat.S_ISSOCK: "a socket",
    stat.S_ISCHR: "a device",
    stat.S_ISBLK: "a device",
}


def require_stored(path: Path) -> None:
    """See that `path` is a file, or a folder of files: who reads a pipe may wait forever.

    Raises
    ------
    FileError
        It is, or holds, a named pipe, a socket or a device; or there is nothing.
    """
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError) as error:
        raise FileError(f"There is no file {path}.") from error
    what = next((words for is_kind, words in _KINDS.items() if is_kind(mode)), None)
    if what is not None:
        raise FileError(
            f"{path} is {what}, not a regular file. Store what it delivers, and give that file."
        )
    if stat.S_ISDIR(mode):
        with suppress(PermissionError):
            for inside in path.iterdir():
                if inside.exists() and not (inside.is_file() or inside.is_dir()):
                    require_stored(inside)


def refuse_inputs_as_outputs(
    outputs: Mapping[str, Path | None], inputs: Iterable[str | Path]
) -> None:
    """See that no output (by its name in the message) is, holds or lies in one of the inputs.

    Files are compared as such, so that links and other spellings make no difference. An input that
    is a folder (a bag) holds all that is in it.

    Raises
    ------
    FileError
        One is: it is never replaced, whatever else was requested.
    """
    given = [Path(each) for each in inputs]
    for name, output in outputs.items():
        for path in given:
            if output is not None and _replaces(output, path):
                raise FileError(
                    f"{name} {output} would replace {path}, which is read here. Results never "
                    "replace what they are made from: give another name."
                )


def _replaces(output: Path, given: Path) -> bool:
    """Whether writing `output` changes what is read as `given`."""
    with suppress(OSError, ValueError, RuntimeError):
        if not output.exists() or not given.exists():
            return os.path.realpath(output) == os.path.realpath(given)
        if output.samefile(given):
            return True
        target, source = output.resolve(), given.resolve()
        if given.is_dir() and source in target.parents:
            return True
        return output.is_dir() and target in source.parents
    return False
