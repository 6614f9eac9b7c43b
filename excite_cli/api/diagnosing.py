"""What the declared model lacks: `excite diagnose`."""

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
from excite_cli.api.outputs import held
from excite_cli.atomic import write_text_atomically
from excite_cli.config.load_spec import spec_as_yaml
from excite_cli.diagnosis.diagnose import diagnose as diagnose_dataset
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.diagnosis.words import no_gain_in_words
from excite_cli.errors import ConfigError
from excite_cli.excitation.problem import Problem
from excite_cli.export.parameters import found_config
from excite_cli.given_files import refuse_inputs_as_outputs
from excite_cli.measurement.dataset import Dataset
from excite_cli.shown.note import Level, Note, Tell, log_note, never, unheard
from excite_cli.store.diagnosis_file import write_diagnosis
from excite_cli.store.own_file import versions
from excite_cli.summary.diagnosis import diagnosis_answer as diagnosis_answer
from excite_cli.workers.base import Workers
from excite_cli.workers.context import at_hand

_HAVE_IT = (
    "The effects found do not lower the error on held-out data. To have it in a config all the "
    "same: --apply-unconfirmed (in Python apply_unconfirmed=True of diagnose, unconfirmed=True of "
    "save_config)."
)


@checked()
def diagnose(
    problem: Problem | Case,
    data: Dataset | str | Path | Sequence[str | Path],
    held_out: str | None = None,
    *,
    output: str | Path | None = None,
    apply: str | Path | None = None,
    apply_unconfirmed: bool = False,
    overwrite: bool = False,
    command: str = "",
    workers: Workers | None = None,
    progress: Callable[[str, int], None] = unheard,
    tell: Tell = log_note,
    ended: Callable[[], bool] = never,
) -> Diagnosis:
    """What the declared model lacks: `excite diagnose`.

    `data` are measured data or their files. Written to `output` (HDF5) if that is given, and the
    config with what was found to `apply` (YAML); where the error on held-out data did not fall
    (`good` is false), that is written with `apply_unconfirmed` only, and where the textbook's model
    is better (`worse_than_textbook`), that one is. `command`: the line that a report shows as what
    made it. `workers` (`open_workers`) share the runs; every
    number is the same without. `ended` is asked between the steps of the search: once it is true,
    or after `diagnosis.max_seconds`, the answer so far is it.

    Returns
    -------
    Diagnosis
        `effects` (kind, joints, parameters with standard deviations, p-value, aliases), `absorbed`,
        `unexplained`, and the errors `before` and `after` on the run `held_out` (default: the
        last), which nothing else saw; `verdict` and `removes` say what every effect is worth there.

    Raises
    ------
    ConfigError, FileError
        Config and data do not fit; order or signs of torques cannot be right; data too short, or
        held-out ones a copy of others; a file exists already.
    """
    if apply_unconfirmed and apply is None:
        raise ConfigError("--apply-unconfirmed says nothing without --apply NEW.yaml.")
    problem = measured_case(problem)
    inputs = inputs_of(problem, *sources_of(data))
    with held({"output": output, "apply": apply}, overwrite, inputs), at_hand(workers):
        dataset = dataset_of(problem, data, tell)
        problem, dataset = with_drive_law(problem, dataset, held_out, tell)
        found = diagnose_dataset(
            problem.robot, robot_base(problem), dataset, problem.spec, held_out, progress, ended
        )
        made = {"command": command} if command else {}
        found = replace(
            found,
            processing=found.processing | made,
            config=spec_as_yaml(problem.spec),
            config_folder=str(problem.folder),
            versions=versions(),
        )
        tell_findings(found.findings[len(dataset.findings) :], tell)
        if output is not None:
            write_diagnosis(Path(output), found)
        if apply is not None and (found.good or apply_unconfirmed):
            save_config(apply, problem, found, unconfirmed=True)
        elif apply is not None and found.worse_than_textbook:
            path = Path(apply)
            text = found_config(problem.spec, problem.folder, found, path, textbook=True)
            write_text_atomically(path, text)
            tell(Note(Level.WARNING, f"{apply} has the textbook's effects. {_HAVE_IT}"))
        elif apply is not None:
            tell(Note(Level.WARNING, f"{apply} is not written. {_HAVE_IT}"))
        return found


@checked()
def save_config(
    path: str | Path,
    problem: Problem | Case,
    found: Diagnosis,
    *,
    unconfirmed: bool = False,
) -> None:
    """Write the config with the effects that a diagnosis found: `excite diagnose --apply`.

    Raises
    ------
    ConfigError
        The error on held-out data did not fall, and it is not asked for what is `unconfirmed`.
    FileError
        It cannot be written.
    """
    if not (found.good or unconfirmed):
        raise ConfigError(f"{path} is not written. {no_gain_in_words(found)} {_HAVE_IT}")
    refuse_inputs_as_outputs({"path": Path(path)}, inputs_of(problem))
    text = found_config(problem.spec, problem.folder, found, Path(path))
    write_text_atomically(Path(path), text)
