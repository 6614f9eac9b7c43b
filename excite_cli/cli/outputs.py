"""Where a command writes: refused before the work begins, not after it."""

from collections.abc import Mapping
from pathlib import Path

from excite_cli.errors import FileError


def check_outputs(outputs: Mapping[str, Path | None], overwrite: bool) -> None:
    """See that every output (by the name of its option) can be written, and none twice.

    Raises
    ------
    FileError
        An output is a folder, or exists and may not be replaced; or two have the same name.
    """
    given = {option: path for option, path in outputs.items() if path is not None}
    for path in given.values():
        if path.is_dir():
            raise FileError(f"{path} is a folder. Give a file name.")
        if path.exists() and not overwrite:
            raise FileError(
                f"{path} exists already. Give another name, or replace it with --overwrite."
            )
    taken: dict[Path, str] = {}
    for option, path in given.items():
        other = taken.setdefault(path.resolve(), option)
        if other != option:
            raise FileError(f"--{other} and --{option} both name {path}. Give two names.")
