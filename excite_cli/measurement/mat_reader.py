"""MATLAB's `.mat`: variables t, q, tau[, dq], each (T, n) or (n, T), or fields of a struct."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from excite_cli.errors import FileError
from excite_cli.measurement.arrange import listed
from excite_cli.measurement.dataset import Array
from excite_cli.measurement.foreign_hdf5 import attribute, kept_inside, member, opened
from excite_cli.measurement.memory_limit import limited_memory
from excite_cli.measurement.reader import (
    CHANNELS,
    SENT,
    RawRun,
    Reader,
    ReadOptions,
    check_size,
    check_unpacked,
    check_values,
    times_from_rate,
)

# MATLAB's `.mat` of version 7.3, which is HDF5: arrays transposed, texts as UTF-16, cells as
# references. It is not trusted, as no HDF5 file is (`foreign_hdf5`).

_MOST_NAMES, _MOST_LETTERS = 1000, 100_000  # texts of a cell; letters of each


def mat_hdf5(path: Path) -> tuple[dict[str, Array], list[str]]:
    """Variables of numbers, as MATLAB shows them (rows, columns), and texts of `joint_names`.

    Those in a struct are called `log.q`, as in MATLAB.
    """
    with opened(path, "MATLAB file of version 7.3") as file:
        datasets = dict(_mat_hdf5_numbers(path, file))
        count = sum(dataset.size for dataset in datasets.values())
        check_values(path, count)
        check_unpacked(path, 8 * count)
        with limited_memory(path, 8 * count):
            held = {name: np.asarray(dataset[()]).T for name, dataset in datasets.items()}
            return held, _names(path, file)


def _mat_hdf5_numbers(path: Path, group: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name in group:
        if name.startswith("#"):  # where MATLAB keeps what cells refer to
            continue
        item = member(path, group, name)
        if isinstance(item, h5py.Group) and not prefix:
            yield from _mat_hdf5_numbers(path, item, f"{name}.")
        elif _is_matrix(item):
            yield prefix + name, item


def _is_matrix(item: Any) -> bool:
    """Whether it holds rows and columns of numbers; objects hold MATLAB's own."""
    numbers = isinstance(item, h5py.Dataset) and item.ndim == 2 and item.dtype.kind in "fiu"
    return numbers and not _is_text(item) and "MATLAB_object_decode" not in item.attrs


def _is_text(item: Any) -> bool:
    short = isinstance(item, h5py.Dataset) and item.size <= _MOST_LETTERS
    return short and attribute(item, "MATLAB_class") == b"char"


def _names(path: Path, file: Any) -> list[str]:
    """What a variable joint_names holds: a cell of texts, or rows of characters."""
    held: Any = member(path, file, "joint_names") if "joint_names" in file else None
    if _is_text(held):
        return [_text(row) for row in np.atleast_2d(held[()].T)]
    cell = isinstance(held, h5py.Dataset) and h5py.check_ref_dtype(held.dtype) is h5py.Reference
    if not cell or held.size > _MOST_NAMES:
        return []
    texts = [kept_inside(path, file[reference]) for reference in held[()].ravel()]
    return [_text(text[()]) if _is_text(text) else "" for text in texts]


def _text(letters: Array) -> str:
    return letters.astype("<u2").tobytes().decode("utf-16-le", "replace").strip()


class MatReader(Reader):
    """MATLAB's files of variables."""

    title = "MATLAB"
    suffixes = (".mat",)

    def read(self, path: Path, wanted: ReadOptions) -> list[RawRun]:
        """The file's only run; columns carry numbers unless a variable joint_names names them."""
        held, named = mat_hdf5(path) if h5py.is_hdf5(path) else _before_7_3(path)
        words = listed([*held])
        time = wanted.called("t")
        stamped = time is not None and time in held
        found = {
            name: held[called]
            for name in (*CHANNELS, *SENT)
            if (called := wanted.called(name)) in held
        }
        missing = [name for name in wanted.needed if name not in found]
        if missing:
            raise FileError(
                f"{path} has no variable '{wanted.called(missing[0])}'; its variables: {words}. "
                f"Another name: measurement.channels: {{{missing[0]}: …}}. Of a timeseries save "
                "Time and Data as arrays."
            )
        samples = held[str(time)].size if stamped else max(found["q"].shape)
        t = held[str(time)].ravel() if stamped else times_from_rate(path, samples, wanted, words)
        columns = {}
        for channel, values in found.items():
            rows = values if len(values) == samples else values.T
            if len(rows) != samples:
                raise FileError(
                    f"{path}: '{channel}' is {' x '.join(map(str, values.shape))}; {samples} "
                    "instants are expected, as rows or as columns."
                )
            width = rows.shape[1]
            names = named if len(named) == width else [str(k + 1) for k in range(width)]
            columns[channel] = dict(zip(names, np.ascontiguousarray(rows.T, float), strict=True))
        numbered = all(name.isdigit() for name in columns["q"])
        return [RawRun("", np.asarray(t, float), columns, {}, numbered, not stamped)]


def _before_7_3(path: Path) -> tuple[dict[str, Array], list[str]]:
    """Variables of numbers, and texts of `joint_names`: a cell, or rows of characters."""
    loaded = _loaded(path)
    held = dict(_numbers(loaded))
    check_values(path, sum(values.size for values in held.values()))
    given = loaded.get("joint_names")
    names = given.ravel() if isinstance(given, np.ndarray) else ()
    return held, [str(np.ravel(each)[0] if np.size(each) else "").strip() for each in names]


def _loaded(path: Path) -> dict[str, Any]:
    from scipy.io import loadmat  # takes a moment to import

    check_size(path)
    try:
        with limited_memory(path):
            return dict(loadmat(path, squeeze_me=False, chars_as_strings=True))
    except NotImplementedError as error:
        raise FileError(
            f"{path} says that it is of MATLAB's version 7.3, and is damaged or cut off. Save it "
            "again."
        ) from error
    # Damaged bytes lead the library to whatever error, also of indices, sizes and memory.
    except Exception as error:
        raise FileError(f"{path} is no readable MATLAB file: {error}.") from error


def _numbers(held: dict[str, Any]) -> Iterator[tuple[str, Array]]:
    """Matrices of numbers, those in a struct as `log.q`."""
    for name, values in held.items():
        if not isinstance(values, np.ndarray) or values.ndim != 2:
            continue
        if values.dtype.kind in "fiu":
            yield name, values
        elif values.dtype.names and values.size == 1 and "." not in name:
            fields = {f"{name}.{field}": values[field].item() for field in values.dtype.names}
            yield from _numbers(fields)
