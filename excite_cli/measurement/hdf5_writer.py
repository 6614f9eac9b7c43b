"""Data sets as HDF5 in the layout that the reader takes: `/runs/<name>/{t, q, tau[, dq]}`."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from excite_cli.atomic import write_atomically
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.measurement.hdf5_file import new_hdf5


def write_dataset(path: Path, dataset: Dataset, attributes: Mapping[str, Any]) -> None:
    """Write `dataset` whole or not at all; `attributes` (numbers, texts, lists) go to the root.

    Units are s, rad, rad/s and N·m at the joint: read again with `measurement: {torque: link}`.

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
        if array is not None:
            group[name] = array
    for name, array in run.extra.items():
        if name not in arrays:
            group[name.replace("/", "_")] = np.asarray(array)
