"""Results, fits, diagnoses and recordings as files."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from excite_cli.api.arguments import checked
from excite_cli.api.loading import inputs_of
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.errors import FileError
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result, matches
from excite_cli.given_files import refuse_inputs_as_outputs
from excite_cli.identification.stored_model import StoredFit
from excite_cli.measurement import hdf5_writer
from excite_cli.measurement.dataset import Dataset
from excite_cli.store import diagnosis_file, fit_file, result_file

# How records that are read are shown.
from excite_cli.summary import diagnosis as diagnosis
from excite_cli.summary import identification as identification
from excite_cli.summary import motions as motions


@checked()
def read_result(path: str | Path) -> Result:
    """Read a result file, as `excite optimize` writes it.

    Raises
    ------
    FileError
        The file is missing, unreadable, not one of this program, damaged, or of a newer schema.
    """
    return result_file.read_result(Path(path))


@checked()
def write_result(path: str | Path, result: Result, problem: Problem) -> None:
    """Write `result`; trajectories are sampled on the constraint grid of `problem`.

    Raises
    ------
    FileError
        It cannot be written, is a file that `problem` was made from, or the result is of another
        robot.
    """
    reason = matches(problem, result)
    if reason:
        raise FileError(f"{path}: the result does not belong to the problem: {reason}.")
    refuse_inputs_as_outputs({"path": Path(path)}, inputs_of(problem))
    result_file.write_result(Path(path), result, problem)


@checked()
def read_fit(path: str | Path) -> StoredFit:
    """Read a fit file, as `excite identify` and `save_fit` write it.

    Raises
    ------
    FileError
        The file is missing, unreadable, not a fit of this program, damaged, or of a newer schema.
    ConfigError
        An effect of it is not in the catalogue.
    """
    return fit_file.read_fit(Path(path))


@checked()
def read_diagnosis(path: str | Path) -> Diagnosis:
    """Read a diagnosis, as `excite diagnose` writes it.

    Raises
    ------
    FileError
        The file is missing, unreadable, not a diagnosis, damaged, or of a newer schema.
    """
    return diagnosis_file.read_diagnosis(Path(path))


@checked()
def write_diagnosis(path: str | Path, found: Diagnosis) -> None:
    """Write a diagnosis, for `read_diagnosis`, `plan_after` and `excite report`.

    Raises
    ------
    FileError
        It cannot be written.
    """
    diagnosis_file.write_diagnosis(Path(path), found)


@checked()
def write_dataset(path: str | Path, dataset: Dataset, attributes: Mapping[str, Any] = {}) -> None:
    """Write measured data in the layout that `load_data` reads; `attributes` go to its root.

    Raises
    ------
    FileError
        It cannot be written, or is one of the files that the data were read from; no config has
        read the data yet.
    """
    if dataset.as_given:
        raise FileError("No config has read these data yet. Do so: load_data(problem, data).")
    refuse_inputs_as_outputs({"path": Path(path)}, dataset.sources)
    hdf5_writer.write_dataset(Path(path), dataset, attributes)
