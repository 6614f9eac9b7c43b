"""Opening HDF5 files that this program wrote: one message for each way in which they may be bad."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
from pydantic import ValidationError

from excite_cli.errors import FileError

PROGRAM = "excite"


@dataclass(frozen=True)
class OwnFile:
    """A kind of file: what it is, who writes it, its newest schema, the attribute that marks it."""

    what: str
    written_by: str
    schema: int
    marker: tuple[str, str] | None = None


@contextmanager
def opened(path: Path, own: OwnFile) -> Iterator[Any]:
    """The open file, checked to be of this kind; whatever goes wrong while it is read is told.

    Raises
    ------
    FileError
        The file is missing, unreadable, not of this kind, damaged, or of a newer schema.
    """
    if not path.is_file():
        raise FileError(f"There is no file {path}.")
    try:
        with h5py.File(path, "r") as file:
            _check(file.attrs, path, own)
            yield file
    except OSError as error:
        raise FileError(f"{path} is not a readable HDF5 file ({error}).") from error
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise FileError(f"{path} is damaged: {where or 'a record'}: {first['msg']}.") from error
    except (KeyError, ValueError, TypeError, AttributeError, IndexError, RuntimeError) as error:
        raise FileError(
            f"{path} is damaged or not {own.what} of this program: {error}. {own.written_by}"
        ) from error


def _check(attributes: Any, path: Path, own: OwnFile) -> None:
    ours = attributes.get("program") == PROGRAM
    if own.marker is not None:
        ours = ours and attributes.get(own.marker[0]) == own.marker[1]
    else:
        ours = ours and "kind" not in attributes
    if not ours and attributes.get("program") == PROGRAM and "kind" in attributes:
        raise FileError(f"{path} holds a {attributes['kind']}, not {own.what}. {own.written_by}")
    if not ours and "simulated" in attributes:
        raise FileError(f"{path} holds measured data, not {own.what}. {own.written_by}")
    if not ours:
        raise FileError(f"{path} is HDF5, but not {own.what} of this program. {own.written_by}")
    if int(attributes["schema"]) > own.schema:
        raise FileError(
            f"{path} has schema {int(attributes['schema'])}; this version reads up to "
            f"{own.schema}. Update the program."
        )
