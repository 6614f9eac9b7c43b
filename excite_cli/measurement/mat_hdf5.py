"""MATLAB's `.mat` of version 7.3, which is HDF5: arrays transposed, texts as UTF-16, cells as
references. It is not trusted, as no HDF5 file is (`foreign_hdf5`).
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from excite_cli.measurement.dataset import Array
from excite_cli.measurement.foreign_hdf5 import kept_inside, member, opened
from excite_cli.measurement.hdf5_attributes import attribute
from excite_cli.measurement.memory_limit import limited_memory
from excite_cli.measurement.reader import check_unpacked, check_values

_MOST_NAMES, _MOST_LETTERS = 1000, 100_000  # texts of a cell; letters of each


def mat_hdf5(path: Path) -> tuple[dict[str, Array], list[str]]:
    """Variables of numbers, as MATLAB shows them (rows, columns), and texts of `joint_names`.

    Those in a struct are called `log.q`, as in MATLAB.
    """
    with opened(path, "MATLAB file of version 7.3") as file:
        datasets = dict(_numbers(path, file))
        count = sum(dataset.size for dataset in datasets.values())
        check_values(path, count)
        check_unpacked(path, 8 * count)
        with limited_memory(path, 8 * count):
            held = {name: np.asarray(dataset[()]).T for name, dataset in datasets.items()}
            return held, _names(path, file)


def _numbers(path: Path, group: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name in group:
        if name.startswith("#"):  # where MATLAB keeps what cells refer to
            continue
        item = member(path, group, name)
        if isinstance(item, h5py.Group) and not prefix:
            yield from _numbers(path, item, f"{name}.")
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
