"""Attributes that hold neither numbers nor texts are not read: damaged ones end the process."""

from pathlib import Path

import h5py
import numpy as np
import pytest

from excite_cli.errors import FileError
from excite_cli.measurement.foreign_hdf5 import attribute
from excite_cli.measurement.hdf5_reader import Hdf5Reader
from excite_cli.measurement.reader import ReadOptions
from excite_cli.store.fit_file import is_fit, read_fit

_LISTS = h5py.vlen_dtype(np.dtype("i4"))


def _lists() -> np.ndarray:
    found = np.empty(2, dtype=object)
    found[:] = [np.arange(3), np.arange(2)]
    return found


def test_numbers_and_texts(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.attrs["names"] = ["a", "b"]
        file.attrs["fixed"] = np.array([b"a", b"b"])
        file.attrs["count"] = 3
        file.attrs["good"] = True
        file.attrs.create("lists", _lists(), dtype=_LISTS)
        assert list(attribute(file, "names")) == ["a", "b"]
        assert attribute(file, "count") == 3
        assert attribute(file, "good")
        assert list(attribute(file, "fixed")) == [b"a", b"b"]
        assert attribute(file, "none", "here") == "here"
        with pytest.raises(ValueError, match="'lists' holds neither numbers nor texts"):
            attribute(file, "lists")


def test_names_of_measured_columns(tmp_path: Path) -> None:
    path = tmp_path / "data.h5"
    with h5py.File(path, "w") as file:
        file["t"], file["q"], file["tau"] = np.arange(9.0), np.zeros((9, 2)), np.zeros((9, 2))
        file.attrs.create("joint_names", _lists(), dtype=_LISTS)
    with pytest.raises(FileError, match="neither numbers nor texts") as caught:
        Hdf5Reader().read(path, ReadOptions(("a", "b")))
    assert str(path) in str(caught.value)


def test_own_files(tmp_path: Path) -> None:
    path = tmp_path / "fit.h5"
    with h5py.File(path, "w") as file:
        file.attrs.create("content", _lists(), dtype=_LISTS)
    assert not is_fit(path)
    with pytest.raises(FileError, match="neither numbers nor texts"):
        read_fit(path)
