"""MATLAB's `.mat`: variables t, q, tau[, dq], each (T, n) or (n, T), or fields of a struct."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from excite_cli.errors import FileError
from excite_cli.measurement.arrange import listed
from excite_cli.measurement.dataset import Array
from excite_cli.measurement.mat_hdf5 import mat_hdf5
from excite_cli.measurement.memory_limit import limited_memory
from excite_cli.measurement.reader import (
    CHANNELS,
    RawRun,
    Reader,
    ReadOptions,
    check_size,
    check_values,
    times_from_rate,
)


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
        found = {name: held[called] for name in CHANNELS if (called := wanted.called(name)) in held}
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
