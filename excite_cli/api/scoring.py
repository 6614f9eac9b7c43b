"""Stored models against new data: `excite score`."""

import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from excite_cli.api.arguments import checked
from excite_cli.api.loading import Case, load_data
from excite_cli.api.model import Model, load_model
from excite_cli.api.outputs import held
from excite_cli.api.paths import refuse_twice
from excite_cli.atomic import write_text_atomically
from excite_cli.errors import FileError
from excite_cli.identification.split import split, whole
from excite_cli.identification.torque_trace import torque_units
from excite_cli.measurement.dataset import Dataset, Finding, Run
from excite_cli.scoring.records import Score, ScoredRun
from excite_cli.scoring.score import Scorer, together
from excite_cli.scoring.thresholds import Residual, Thresholds, thresholds_of
from excite_cli.shown.note import Level, Note, Tell, log_note
from excite_cli.store.score_file import write_score
from excite_cli.summary.score import score_answer as score_answer


@checked()
def score(
    model: Model | str | Path,
    data: Dataset | str | Path | Sequence[str | Path],
    *,
    sealed: bool = False,
    output: str | Path | None = None,
    overwrite: bool = False,
    progress: Callable[[str, int], None] = lambda text, done: None,
    tell: Tell = log_note,
) -> Score:
    """Torque predicted by a stored model beside measured torque, nothing fitted: `excite score`.

    `data` are measured data or their files, which are read one after the other; `sealed`: of the
    data that the model was made of, only the part that was sealed then. Written to `output` (HDF5)
    if that is given.

    Returns
    -------
    Score
        `runs` with their errors by joint, the `ratio` of each to what the model's own residual
        allows, and where it is beyond that (`alarm`) the likely `reasons`; `error` over all runs
        beside `made`, that on sealed data when the model was made.

    Raises
    ------
    FileError, ConfigError, RobotError
        See `Model.load` and `load_data`; no run is long enough; `output` exists.
    """
    given = model if isinstance(model, Model) else load_model(model)
    stored = given.made
    scorer, case = Scorer(stored), Case(stored.spec, stored.folder, stored.robot)
    paths = [] if isinstance(data, Dataset) else _paths(data)
    refuse_twice(paths)
    with held({"output": output}, overwrite, (stored.path, *paths)):
        runs: list[ScoredRun] = []
        findings: list[Finding] = []
        sets: Sequence[Dataset | Path] = [data] if isinstance(data, Dataset) else paths
        for k, each in enumerate(sets):
            progress(f"file {k + 1} of {len(sets)}", k)
            dataset = each if isinstance(each, Dataset) else load_data(case, each, tell)
            findings += dataset.findings
            own = recordings_of(dataset, stored.sealed_run if sealed else None, given)
            source = str(each) if isinstance(each, Path) else ", ".join(dataset.sources)
            for name, parts in own.items():
                label = name if len(sets) == 1 else f"{Path(source).stem}: {name}"
                try:
                    runs.append(scorer.of(parts, source, label))
                except FileError as short:
                    tell(Note(Level.WARNING, str(short), name))
        if not runs:
            raise FileError("no run is long enough to be scored: record longer ones.")
        found = Score(
            str(stored.path),
            stored.what,
            stored.robot.joint_names,
            torque_units(stored.robot),
            tuple(runs),
            together(runs, stored.robot.joint_names),
            stored.error,
            stored.sealed_run,
            stored.noise or {},
            tuple(findings),
        )
        found = replace(found, findings=(*found.findings, *_noticed(found)))
        for finding in found.findings[len(findings) :]:
            tell(Note(Level.WARNING, finding.text))
        if output is not None:
            write_score(Path(output), found)
        return found


@checked()
def thresholds(
    model: Model | str | Path,
    data: Dataset | str | Path | Sequence[str | Path],
    *,
    false_alarms: float = 1.0,
    time_constant: float = 0.02,
    output: str | Path | None = None,
    overwrite: bool = False,
    tell: Tell = log_note,
) -> Thresholds:
    """Thresholds of a collision detector from sound runs: `excite score --thresholds`.

    They are made for so many `false_alarms` an hour on all joints together, and for a residual
    behind a low pass of `time_constant` [s]. Written to `output` (JSON) if that is given.

    Raises
    ------
    ConfigError, FileError, RobotError
        See `score`; there is less than half a minute of data.
    """
    given = model if isinstance(model, Model) else load_model(model)
    stored = given.made
    scorer, case = Scorer(stored), Case(stored.spec, stored.folder, stored.robot)
    paths = [] if isinstance(data, Dataset) else _paths(data)
    with held({"thresholds": output}, overwrite, (stored.path, *paths)):
        runs: list[Residual] = []
        for each in [data] if isinstance(data, Dataset) else paths:
            dataset = each if isinstance(each, Dataset) else load_data(case, each, tell)
            for parts in recordings_of(dataset, None, given).values():
                runs += scorer.residuals(parts)
        found = thresholds_of(stored.robot.joint_names, runs, false_alarms, time_constant)
        if output is not None:
            write_text_atomically(Path(output), json.dumps(found.as_data(), indent=1) + "\n")
        return found


def _paths(data: str | Path | Sequence[str | Path]) -> list[Path]:
    return [Path(each) for each in ([data] if isinstance(data, str | Path) else data)]


def recordings_of(dataset: Dataset, sealed: str | None, model: Model) -> dict[str, list[Run]]:
    """Parts of every recording by its name; of the `sealed` part alone if it is named."""
    runs = whole(dataset)
    if sealed is not None:
        spec = model.made.spec
        named = sealed if sealed in dataset.names else None
        parts = split(dataset, named, spec.diagnosis.block, spec.identification.needed_runs)
        runs = list(parts.sealed)
    found: dict[str, list[Run]] = {}
    for run in runs:
        found.setdefault(run.name, []).append(run)
    return found


def _noticed(found: Score) -> list[Finding]:
    if found.made is None:
        text = (
            f"{found.model} does not tell how large its own errors were: no run can be out of what "
            "it allows. Give a fit, a diagnosis, or a config that `excite diagnose --apply` wrote."
        )
        return [Finding("no_allowance", "warning", text)]
    return []
