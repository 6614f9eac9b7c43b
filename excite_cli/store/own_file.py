"""Opening HDF5 files that this program wrote: one message for each way in which they may be bad."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

import h5py
from pydantic import ValidationError

from excite_cli import __version__
from excite_cli.errors import ExciteError, FileError
from excite_cli.given_files import require_stored
from excite_cli.measurement.foreign_hdf5 import attribute, require_plain
from excite_cli.measurement.memory_limit import limited_memory

# Versions of the program and of the libraries that decide its numbers.

_LIBRARIES = ("pin", "coal", "numpy", "scipy", "h5py", "clarabel", "mujoco", "example-robot-data")


def versions() -> dict[str, str]:
    """Installed version of each library, `missing` where there is none."""
    found = {"excite-cli": __version__}
    for name in _LIBRARIES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "missing"
    return found


PROGRAM = "excite"
_MOTIONS = "motions"  # the content of files that have no marker of their own
_LONGEST = 500  # characters of a library's message
_MOST_OBJECTS = 200_000
_ALWAYS, _PACKED = 2**27, 200  # bytes that any file may unpack to; times its size


@dataclass(frozen=True)
class OwnFile:
    """A kind of file: what it is, who writes it, its newest schema, the attribute that marks it.

    `oldest`: the first schema that can still be read.
    """

    what: str
    written_by: str
    schema: int
    marker: tuple[str, str] | None = None
    oldest: int = 1


def is_marked(path: Path, own: OwnFile) -> bool:
    """Whether `path` is an HDF5 file with the marker of its kind."""
    if own.marker is None or not (path.is_file() and h5py.is_hdf5(path)):
        return False
    name, value = own.marker
    try:
        with limited_memory(path), h5py.File(path, "r") as file:
            return str(attribute(file, name, "")) == value
    except Exception:  # damaged, in whatever way: whoever reads it says so
        return False


def is_own(path: Path) -> bool:
    """Whether `path` is an HDF5 file."""
    return path.is_file() and bool(h5py.is_hdf5(path))


@contextmanager
def opened(path: Path, own: OwnFile) -> Iterator[Any]:
    """The open file, checked to be of this kind; whatever goes wrong while it is read is reported.

    Raises
    ------
    FileError
        The file is missing, unreadable, not of this kind, damaged, or of a newer schema.
    """
    require_stored(path)
    if not path.is_file():
        raise FileError(f"There is no file {path}.")
    try:
        with limited_memory(path), h5py.File(path, "r") as file:
            require_plain(file)
            _check(file.attrs, path, own)
            _check_contents(file, path)
            yield file
    except OSError as error:
        raise FileError(f"{path} is not a readable HDF5 file ({error}).") from error
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise FileError(f"{path} is damaged: {where or 'a record'}: {first['msg']}.") from error
    except ExciteError as error:
        if str(path) in str(error):
            raise
        raise FileError(f"{path}: {error}") from error
    # Damaged bytes lead HDF5 and JSON to whatever error; all of it means the same.
    except Exception as error:
        reason = str(error)[:_LONGEST]
        raise FileError(
            f"{path} is damaged or not {own.what} of this program: {reason}. {own.written_by}"
        ) from error


def _check_contents(file: Any, path: Path) -> None:
    """See that the file holds only data of its own, of a size that fits it, before any is read."""
    todo, count, total = [file], 0, 0
    seen = set()
    while todo:
        group = todo.pop()
        for name in group:
            count += 1
            if count > _MOST_OBJECTS:
                raise ValueError(f"it has more than {_MOST_OBJECTS:,} parts")
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                raise ValueError(f"'{name}' is a link; only data in the file itself is read")
            member = group[name]
            require_plain(member)
            if isinstance(member, h5py.Dataset):
                if member.is_virtual or member.external:
                    raise ValueError(f"'{name}' keeps its data in other files")
                total += member.nbytes
            elif isinstance(member, h5py.Group):
                place = h5py.h5o.get_info(member.id).addr
                if place in seen:
                    raise ValueError(f"'{name}' leads round in a circle")
                seen.add(place)
                todo.append(member)
    if total > _ALWAYS and total > _PACKED * path.stat().st_size:
        raise ValueError(f"it claims to hold {total / 2**20:,.0f} MiB, more than it can")


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
    content = str(attributes.get("content", _MOTIONS))
    if own.marker is None and content != _MOTIONS:
        raise FileError(f"{path} holds a {content}, not motions. {own.written_by}")
    if int(attributes["schema"]) < own.oldest:
        raise FileError(
            f"{path} was written by an earlier version (schema {int(attributes['schema'])}; this "
            f"one reads {own.oldest} to {own.schema}). Make it anew. {own.written_by}"
        )
    if int(attributes["schema"]) > own.schema:
        raise FileError(
            f"{path} has schema {int(attributes['schema'])}; this version reads up to "
            f"{own.schema}. Update the program."
        )
