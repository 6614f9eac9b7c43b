"""Looking at log and model before any physics: `excite inspect`."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from excite_cli.api.arguments import checked, page_path
from excite_cli.api.drive_law import with_drive_law
from excite_cli.api.loading import (
    Case,
    as_recorded,
    completed,
    inputs_of,
    load_data,
    measured_case,
)
from excite_cli.api.outputs import held
from excite_cli.atomic import write_text_atomically
from excite_cli.checks.all_checks import (
    look,
    row_names,
    rows_in_order,
    rows_of_description,
    rows_of_files,
)
from excite_cli.checks.check_result import CheckResult
from excite_cli.checks.sentences import BELONG, written
from excite_cli.checks.trust import but_trusted, check_names
from excite_cli.config.commented_yaml import amended, changed_values, with_values
from excite_cli.config.constraints_spec import ConstraintsSpec
from excite_cli.config.load_spec import load_spec, spec_of
from excite_cli.config.plain_yaml import yaml_text
from excite_cli.config.trajectory_spec import TaskSpec
from excite_cli.diagnosis.measured_prior import measured_stack
from excite_cli.diagnosis.power import EffectPower, sizes_shown
from excite_cli.effects.base import Effect
from excite_cli.errors import ConfigError, ExciteError
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.identification.prepare import prepare_all
from excite_cli.identification.processing import choose_processing
from excite_cli.measurement.dataset import Dataset, joined, merged
from excite_cli.report.page import render
from excite_cli.robot.model import build_robot
from excite_cli.shown.note import Level, Note, Tell, log_note
from excite_cli.summary.log_inspection import LogInspection as LogInspection
from excite_cli.summary.log_inspection import inspection_answer as inspection_answer
from excite_cli.summary.log_inspection import inspection_page
from excite_cli.summary.weakest import noise_in_words

_ROUNDS = 4  # of looking, each with what the one before would set


@checked()
def inspect(
    problem: Problem | Case,
    data: Dataset | str | Path | Sequence[str | Path] = (),
    *,
    apply: str | Path | None = None,
    output: str | Path | None = None,
    power: bool = False,
    overwrite: bool = False,
    tell: Tell = log_note,
) -> LogInspection:
    """Mistakes of set-up in log and model: `excite inspect`.

    `data` are files, or arrays (`Dataset.from_arrays`); without them the description alone is
    judged. What would settle what is seen in the files is
    tried, and the data are looked at once more with it, before the dynamics are. With `apply` the
    config that says so is written, its comments kept; where nothing is to be changed, as it is.
    `output`: a page (HTML) of all checks; `power`: also the sizes of effects that a diagnosis of
    the data would name.

    Returns
    -------
    LogInspection
        `results`, each with `status` ok, doubt or fault, `joints`, `evidence` and `settings`.

    Raises
    ------
    ConfigError, FileError
        Data cannot be read at all, or were converted before; `output` is no name of a page; a
        file exists already.
    """
    problem = measured_case(problem)
    case = Case(problem.spec, problem.folder, problem.robot, problem.file)
    files = [data] if isinstance(data, str | Path) else data
    if isinstance(data, Dataset) and not data.as_given:
        raise ConfigError(
            "inspect: data were converted already. Give the files, or the arrays as recorded: "
            "Dataset.from_arrays."
        )
    page = None if output is None else page_path(output)
    with held({"apply": apply, "output": page}, overwrite, inputs_of(problem, files)):
        check_names(case.spec, row_names())
        found = but_trusted(rows_of_description(case.robot, case.spec), case.spec)
        settings: dict[str, Any] = {}
        before, more = settings, settings
        runs: tuple[str, ...] = ()
        for turn in range(_ROUNDS if files else 0):
            seen = set(map(_key, found))
            try:
                tell(Note(Level.STEP, "reading and checking the data"))
                recorded = as_recorded(case, files)
                told, is_all = _looked(case, recorded, settings, tell)
            except ExciteError as error:  # of data as they are; or with what was tried
                if not turn:
                    raise
                found.append(_in_vain(more, error))
                settings = before
                break
            runs = recorded.recordings
            new = [each for each in told if _key(each) not in seen]
            found += new
            before, more = settings, {}
            for each in new:
                more = joined(more, each.settings)
            settings = joined(settings, more)
            if is_all or not more:  # what the dynamics say was tried by them
                break
            case = _changed(case, more)
        inspection = LogInspection(rows_in_order(found, bool(files), case.spec), settings, runs)
        if power:
            by_law = with_drive_law(case, load_data(case, files, tell), None, tell)
            shown = power_of_data(case, by_law[1])
            inspection = replace(inspection, power=shown, noise=noise_in_words(case.spec))
        if apply is not None:
            _write(Path(apply), problem, settings)
        if page is not None:
            title = f"Set-up of {case.robot.name}"
            write_text_atomically(page, render(inspection_page(inspection, title)))
        return inspection


def power_of_data(case: Case, data: Dataset) -> tuple[EffectPower, ...]:
    """Sizes of effects that a diagnosis of `data` would name with 95 %; the last run is held out.

    Raises
    ------
    FileError
        A run is too short, or nothing in the data can be used.
    """
    problem, kept = bare_problem(case), data.runs[: max(1, len(data.runs) - 1)]
    assert problem.prediction is not None
    stack, _ = measured_stack(problem, replace(data, runs=kept))
    return sizes_shown(problem.prediction, stack, case.spec.diagnosis.significance)


def bare_problem(case: Case, possible: Sequence[Effect] | None = None) -> Problem:
    """What is unknown of a robot, for motions that are there: no constraint asks for more.

    `possible`: effects that it may have, in place of the usual ones.
    """
    spec = case.spec
    criterion = spec.criterion.model_copy(update={"kind": "predicted_torque"})
    bare = ConstraintsSpec(joint_limits=spec.constraints.joint_limits)  # no motion is sought
    update = {"criterion": criterion, "constraints": bare, "task": TaskSpec()}
    return build_problem(spec.model_copy(update=update), case.folder, possible=possible)


def _in_vain(settings: Mapping[str, Any], error: ExciteError) -> CheckResult:
    """That the data cannot be used with what would settle what is seen in the files."""
    text = f"with {written(settings)} the data cannot be used: {error}".removesuffix(".")
    return CheckResult(BELONG, "in_vain", "fault", text)


def _key(result: CheckResult) -> tuple[str, tuple[str, ...], str]:
    return result.name, result.joints, result.status


def _looked(
    case: Case, recorded: Dataset, settled: Mapping[str, Any], tell: Tell
) -> tuple[list[CheckResult], bool]:
    """What is seen in files; and, where they may be used, what the dynamics say of them, and true.

    Of a unit or a clock that is not `settled` yet they would say what is wrong.
    """
    told = [e for e in recorded.findings if e.severity != "note" or e.kind == "wrapped"]
    found = rows_of_files(merged(told), case.spec)
    if any(each.status == "fault" or {*each.settings} - {*settled} for each in found):
        return found, False
    settled_case, data = with_drive_law(case, completed(case, recorded), None, tell)
    spec = settled_case.spec
    processing = choose_processing(data.runs, spec.measurement.filter, spec.diagnosis.moving_speed)
    prepared = prepare_all(data.runs, processing)
    tell(Note(Level.STEP, "fitting the textbook's model, set up as it is and otherwise"))
    return [*found, *look(case.robot, data.runs, prepared, spec)], True


def _changed(case: Case, settings: Mapping[str, Any]) -> Case:
    """The same robot and data, set up otherwise."""
    tree = with_values(case.spec.model_dump(mode="json", exclude_unset=True), settings)
    spec = spec_of(tree)
    if spec.robot == case.spec.robot:
        return replace(case, spec=spec)
    return Case(spec, case.folder, build_robot(spec.robot, case.folder), case.file)


def _paths_from(folder: Path, problem: Problem | Case) -> dict[str, Any]:
    """The robot's relative paths as seen from another folder."""
    spec = problem.spec.robot
    if folder == problem.folder.resolve():
        return {}
    found: dict[str, Any] = {}
    if ":" not in spec.urdf and not Path(spec.urdf).is_absolute():
        found["robot.urdf"] = os.path.relpath(problem.folder / spec.urdf, folder)
    if spec.package_dirs:
        own = [os.path.relpath(problem.folder / each, folder) for each in spec.package_dirs]
        found["robot.package_dirs"] = own
    return found


def _write(path: Path, problem: Problem | Case, settings: Mapping[str, Any]) -> None:
    """The config that says what was found."""
    settings = {**settings, **_paths_from(path.resolve().parent, problem)}
    tree = problem.spec.model_dump(mode="json", exclude_unset=True)
    text = yaml_text(with_values(tree, settings))
    if problem.file is not None:  # values of --set are not in the file
        old = load_spec(problem.file).model_dump(mode="json", exclude_unset=True)
        more = {**changed_values(old, tree), **settings}
        text = amended(problem.file.read_text(encoding="utf-8"), more)
    write_text_atomically(path, text)
