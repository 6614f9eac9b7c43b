"""Data sets as HDF5 in the layout that the reader takes: `/runs/<name>/{t, q[, tau][, dq]}`."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from excite_cli.atomic import write_atomically
from excite_cli.measurement.dataset import Dataset, Run

# New HDF5 files, made in memory and then written in one go.
#
# The HDF5 library does not survive a full disk: it fails once more when it closes the file, and
# again when the program ends. Bytes written by Python fail once, with the reason.


@contextmanager
def new_hdf5(path: Path) -> Iterator[Any]:
    """An open HDF5 file to be filled; at the end its bytes are written to `path`.

    Raises
    ------
    OSError
        They cannot be written.
    """
    content = BytesIO()
    with h5py.File(content, "w") as file:
        yield file
    with path.open("wb") as written:
        written.write(content.getbuffer())


def write_dataset(path: Path, dataset: Dataset, attributes: Mapping[str, Any]) -> None:
    """Write `dataset` whole or not at all; `attributes` (numbers, texts, lists) go to the root.

    Units are s, rad, rad/s and N·m at the joint: read again with `measurement: {torque: link}`. Of
    robots that measure no torque (all NaN) there is none.

    Raises
    ------
    FileError
        The folder cannot be written to.
    """
    write_atomically(path, lambda temporary: _write(temporary, dataset, attributes))


def _write(path: Path, dataset: Dataset, attributes: Mapping[str, Any]) -> None:
    with new_hdf5(path) as file:
        file.attrs.update(dict(attributes))
        file.attrs["joint_names"] = list(dataset.joint_names)
        file.attrs["units"] = "t: s, q: rad (m), dq: rad/s, tau: N·m at the joint"
        for run in dataset.runs:
            _write_run(file.create_group(f"runs/{run.id.key}", track_order=True), run)


def _write_run(group: Any, run: Run) -> None:
    if run.epoch is not None:
        group.attrs["epoch"] = run.epoch
    arrays = {"t": run.t, "q": run.q, "dq": run.dq, "tau": run.tau, "valid": run.valid}
    for name, array in arrays.items():
        if array is not None and not (name == "tau" and np.isnan(array).all()):
            group[name] = array
    for name, array in run.extra.items():
        if name not in arrays:
            group[name.replace("/", "_")] = np.asarray(array)
