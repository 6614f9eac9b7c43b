"""The parameters of the declared model from measured data: `excite identify`."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from excite_cli.api.arguments import checked
from excite_cli.api.drive_law import with_drive_law
from excite_cli.api.loading import (
    Case,
    dataset_of,
    inputs_of,
    measured_case,
    robot_base,
    sources_of,
    tell_findings,
)
from excite_cli.api.model_exports import write_exported, write_models
from excite_cli.api.outputs import held
from excite_cli.checks.all_checks import check_dataset
from excite_cli.config.load_spec import spec_as_yaml
from excite_cli.excitation.problem import Problem
from excite_cli.export.drive import drive_of
from excite_cli.export.payload_formats import flange_of, payload_text
from excite_cli.given_files import refuse_inputs_as_outputs
from excite_cli.identification.carried_load import LoadIdentification
from excite_cli.identification.carried_load import identify_load as load_on
from excite_cli.identification.identify import Identification
from excite_cli.identification.identify import identify as identify_dataset
from excite_cli.identification.stored_model import StoredFit
from excite_cli.measurement.dataset import Dataset
from excite_cli.shown.note import Level, Note, Tell, log_note, unheard
from excite_cli.store.fit_file import read_fit, write_fit
from excite_cli.summary.identification import identification_answer as identification_answer
from excite_cli.summary.identification import load_answer as load_answer
from excite_cli.workers.base import Workers
from excite_cli.workers.context import at_hand


@checked()
def identify(
    problem: Problem | Case,
    data: Dataset | str | Path | Sequence[str | Path],
    held_out: str | None = None,
    *,
    output: str | Path | None = None,
    urdf: str | Path | None = None,
    mjcf: str | Path | None = None,
    parameters: str | Path | None = None,
    overwrite: bool = False,
    workers: Workers | None = None,
    progress: Callable[[str, int], None] = unheard,
    tell: Tell = log_note,
) -> Identification:
    """The parameters of the declared model: `excite identify`.

    `data` are measured data or their files. The fit is written to `output` (HDF5), the model to
    `urdf`, `mjcf` and `parameters` (YAML), where these are given. `workers` (`open_workers`) share
    the runs; every number is the same without.

    Returns
    -------
    Identification
        `fit` has `names`, `values` and `std` (P,), base parameters first, then those of effects;
        `error` is that on the run `held_out` (default: the last), which no fit saw.

    Raises
    ------
    ConfigError, FileError
        Config and data do not fit; a run is too short; order or signs of torques cannot be right;
        a file exists already.
    """
    problem = measured_case(problem)
    models = {"urdf": urdf, "mjcf": mjcf, "parameters": parameters}
    inputs = inputs_of(problem, *sources_of(data))
    with held({"output": output, **models}, overwrite, inputs), at_hand(workers):
        dataset = dataset_of(problem, data, tell)
        problem, dataset = with_drive_law(problem, dataset, held_out, tell)
        suspicious = check_dataset(problem.robot, dataset, problem.spec, held_out)
        dataset = replace(dataset, findings=(*dataset.findings, *suspicious))
        tell_findings(suspicious, tell)
        found = identify_dataset(
            problem.robot,
            robot_base(problem),
            dataset,
            problem.spec,
            held_out,
            lambda text: progress(text, 0),
        )
        found = replace(found, spec=problem.spec)
        for reason in found.processing.reasons:
            tell(Note(Level.DETAIL, reason))
        tell_findings(found.findings[len(dataset.findings) :], tell)
        if output is not None:
            save_fit(output, problem, found, dataset.sources)
        drive = drive_of(problem.spec, problem.robot.joint_names) if mjcf is not None else None
        write_models(problem.robot, found.fit, models, tell, drive)
        return found


@checked()
def identify_load(
    problem: Problem | Case,
    data: Dataset | str | Path | Sequence[str | Path],
    fit: StoredFit | str | Path,
    link: str | None = None,
    *,
    ur: str | Path | None = None,
    franka: str | Path | None = None,
    overwrite: bool = False,
    tell: Tell = log_note,
) -> LoadIdentification:
    """What the robot carries, on top of a fit without it: `excite identify --only payload`.

    `fit` is the fit of the robot alone (`read_fit`), or its file; `link` carries the load, by
    default the last one. For the robot's controller it is written to `ur` (URScript) or `franka`
    (endeffector-config.json); then the default is the tool flange.

    Returns
    -------
    LoadIdentification
        `parameters` has mass, centre (in the link's frame) and inertia about it, with one standard
        deviation that holds the fit's; `values` (10,) and `covariance` (10, 10).

    Raises
    ------
    ConfigError, FileError
        The link is unknown or must be named; the fit belongs to another robot; a run is too short;
        a file exists already; no payload was found that a controller could be told.
    """
    problem = measured_case(problem)
    files = {kind: path for kind, path in (("ur", ur), ("franka", franka)) if path is not None}
    of_fit = [] if isinstance(fit, StoredFit) else [fit]
    with held(files, overwrite, inputs_of(problem, *sources_of(data), *of_fit)):
        for kind in files:
            link = link or flange_of(problem.robot, kind)
        problem, dataset = with_drive_law(problem, dataset_of(problem, data, tell), None, tell)
        # Signs and order of columns are not judged: beside the URDF, a load looks like others.
        stored = fit if isinstance(fit, StoredFit) else read_fit(Path(fit))
        found = load_on(problem.robot, robot_base(problem), dataset, problem.spec, stored, link)
        tell_findings(found.findings[len(dataset.findings) :], tell)
        texts = {Path(path): payload_text(found, kind) for kind, path in files.items()}
        for path, text in texts.items():
            write_exported(text, path, tell)
        return found


@checked()
def save_fit(
    path: str | Path,
    problem: Problem | Case,
    found: Identification,
    sources: Sequence[str] = (),
) -> None:
    """Write a fit file, for `read_fit`, `excite export` and `uncertainty.fit`.

    `sources` name the files that the data came from.

    Raises
    ------
    FileError
        It cannot be written.
    """
    refuse_inputs_as_outputs({"path": Path(path)}, inputs_of(problem, *sources))
    config, folder = spec_as_yaml(found.spec or problem.spec), str(problem.folder)
    write_fit(Path(path), found, config, folder, problem.robot.fingerprint(), tuple(sources))
