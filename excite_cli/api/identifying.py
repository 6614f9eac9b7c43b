"""The parameters of the declared model from measured data: `excite identify`."""

from pathlib import Path

from excite_cli.api.loading import Case
from excite_cli.config.load import spec_as_yaml
from excite_cli.diagnosis.plausibility import check_dataset
from excite_cli.excitation.problem import Problem
from excite_cli.identification.identify import Identification
from excite_cli.identification.identify import identify as identify_dataset
from excite_cli.measurement.dataset import Dataset
from excite_cli.store.fit_file import write_fit


def identify(problem: Problem | Case, data: Dataset, sealed: str | None = None) -> Identification:
    """The parameters of the declared model: `excite identify`.

    `fit` of what is returned has `names`, `values` and `std` (P,), base parameters first, then
    those of effects; `error` is that on the run `sealed` (default: the last), which no fit saw.

    Raises
    ------
    ConfigError, FileError
        Config and data do not fit; a run is too short; order or signs of torques cannot be right.
    """
    check_dataset(problem.robot, data, problem.spec)
    return identify_dataset(problem.robot, problem.base, data, problem.spec, sealed)


def save_fit(path: str | Path, problem: Problem | Case, found: Identification) -> None:
    """Write a fit file, for `read_fit`, `excite export` and `uncertainty.fit`.

    Raises
    ------
    FileError
        It cannot be written.
    """
    config, folder = spec_as_yaml(problem.spec), str(problem.folder)
    write_fit(Path(path), found, config, folder, problem.robot.fingerprint())
