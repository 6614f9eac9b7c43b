"""Stored models against new data: `excite score`."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from excite_cli.api.arguments import checked, refuse_twice
from excite_cli.api.loading import Case, dataset_of, load_data, tell_findings
from excite_cli.api.model import Model, load_model
from excite_cli.api.outputs import held
from excite_cli.api.played_runs import SimulatedModel, drift_of, simulated_model
from excite_cli.checks.all_checks import look
from excite_cli.errors import ExciteError, FileError
from excite_cli.identification.split import split, whole
from excite_cli.identification.stored_model import StoredModel
from excite_cli.identification.torque_trace import torque_units
from excite_cli.measurement.arrange import OtherJointsError
from excite_cli.measurement.dataset import Dataset, Finding, Run
from excite_cli.scoring.records import HorizonDrift, Score, ScoredRun
from excite_cli.scoring.score import Scorer, Shift, shift_of, together, with_shift
from excite_cli.scoring.thresholds import Residual, Thresholds, thresholds_of
from excite_cli.shown.note import Level, Note, Tell, log_note, unheard
from excite_cli.store.score_file import write_score, write_thresholds
from excite_cli.summary.score import score_answer as score_answer
from excite_cli.summary.score import thresholds_parts as thresholds_parts
from excite_cli.workers.base import Here, News, Workers
from excite_cli.workers.base import Tell as WorkersTell


@checked()
def score(
    model: Model | str | Path,
    data: Dataset | str | Path | Sequence[str | Path],
    *,
    held_out: bool = False,
    output: str | Path | None = None,
    overwrite: bool = False,
    workers: Workers | None = None,
    progress: Callable[[str, int], None] = unheard,
    tell: Tell = log_note,
) -> Score:
    """Torque predicted by a stored model beside measured torque, nothing fitted: `excite score`.

    `data` are measured data or their files, which are read one after the other; `held_out`: of the
    data that the model was made of, only the part that was held out then. Written to `output`
    (HDF5) if that is given. `workers` (`open_workers`) share the files; of many, one that cannot be
    read is told and left out.

    Returns
    -------
    Score
        `runs` with their errors by joint, the `ratio` of each to what the model's own residual
        allows, and where it is beyond that (`alarm`) the likely `reasons`; `error` over all runs
        beside `made`, that on held-out data when the model was made.

    Raises
    ------
    FileError, ConfigError, RobotError
        See `Model.load` and `load_data`; no run is long enough; `output` exists.
    """
    given = model if isinstance(model, Model) else load_model(model)
    stored = given.made
    paths = [] if isinstance(data, Dataset) else _paths(data)
    refuse_twice(paths)
    case = Case(stored.spec, stored.folder, stored.robot)
    at_hand = dataset_of(case, data, unheard) if isinstance(data, Dataset) else None
    simulated = _simulated(stored)
    with held({"output": output}, overwrite, (stored.path, *paths)):

        def scored(worse: Shift | None, files: Sequence[Path]) -> list[_Scored | Exception]:
            if at_hand is not None:
                return [_scored(given, at_hand, "", held_out, True, worse, simulated)]
            shared = (str(stored.path), held_out, len(paths) == 1, worse, simulated)

            def watch(news: News) -> None:
                progress(f"{news.done} of {news.total} files", news.done)

            place = workers or Here()
            return place.map(score_file, shared, [*map(str, files)], watch, keep_failures=True)

        tell(Note(Level.STEP, "playing the model on the data"))
        runs, findings = _gathered(scored(None, paths), [*map(str, paths)], tell)
        if not runs:
            raise FileError("no run is long enough to be scored: record longer ones.")
        shift = shift_of(runs, stored.robot.joint_names)
        if shift is not None:
            later = {runs[k].file for k in shift.runs}
            again = [
                run
                for each in scored(shift, [path for path in paths if str(path) in later])
                if not isinstance(each, Exception)
                for run in each[0]
            ]
            runs, noticed = with_shift(runs, shift, again)
            tell_findings(noticed, tell)
            findings += noticed
        found = Score(
            str(stored.path),
            stored.what,
            stored.robot.joint_names,
            torque_units(stored.robot),
            tuple(runs),
            together(runs, stored.robot.joint_names),
            stored.error,
            stored.held_out_run,
            stored.noise or {},
            tuple(findings),
            simulated if isinstance(simulated, str) else "",
        )
        found = replace(found, findings=(*found.findings, *_noticed(found, given, held_out)))
        for finding in found.findings[len(findings) :]:
            tell(Note(Level.WARNING, finding.text))
        if output is not None:
            write_score(Path(output), found)
        return found


_Scored = tuple[list[ScoredRun], list[Finding]]
_Simulated = SimulatedModel | str  # or why there is none


def _simulated(stored: StoredModel) -> _Simulated:
    if stored.robot.base_joints:
        return "contacts hold its base, and these are not simulated."
    try:
        return simulated_model(stored)
    except ExciteError as error:
        return str(error)


def score_file(
    shared: tuple[str, bool, bool, Shift | None, _Simulated], path: str, tell: WorkersTell
) -> _Scored:
    """Scores of the runs of one file, for workers.

    `shared`: the model's file, held out, only one, what was seen of its runs before, and the model
    for a simulator.
    """
    model, held_out, single, worse, simulated = shared
    given = _known_model(model, Path(model).stat().st_mtime_ns)
    case = Case(given.made.spec, given.made.folder, given.made.robot)
    try:
        data = load_data(case, path, unheard)
    except OtherJointsError as error:
        raise FileError(
            f"{error} If these names are right, the data are of another robot than "
            f"{given.made.robot.name}, which {model} is of: score them with a model of that one."
        ) from error
    return _scored(given, data, path, held_out, single, worse, simulated)


@lru_cache(maxsize=1)
def _known_model(path: str, stamp: int) -> Model:
    """Read once by each worker."""
    return load_model(path)


def _scored(
    model: Model,
    data: Dataset,
    path: str,
    held_out: bool,
    single: bool,
    worse: Shift | None,
    simulated: _Simulated,
) -> _Scored:
    stored = model.made
    scorer, runs, findings = Scorer(stored), [], list(data.findings)
    own = recordings_of(data, stored.held_out_run if held_out else None, model)
    for name, parts in own.items():
        label = name if single else f"{Path(path).stem}: {name}"
        try:
            run = scorer.of(parts, path or ", ".join(data.sources), label, worse)
            drift = () if isinstance(simulated, str) else _drift(model, simulated, scorer, parts)
            runs.append(replace(run, drift=drift))
            if runs[-1].alarm:  # before what may have changed in the robot: is it set up as then?
                wrong = look(stored.robot, parts, scorer.prepared(parts), stored.spec)
                told = [replace(each.finding, severity="warning", run=label) for each in wrong
                        if each.status != "ok"]  # fmt: skip
                findings += told
        except FileError as short:
            findings.append(Finding("not scored", "warning", str(short), name))
    return runs, findings


def _drift(
    model: Model, simulated: SimulatedModel, scorer: Scorer, parts: Sequence[Run]
) -> tuple[HorizonDrift, ...]:
    """Of the parts of a recording that are long enough for the filters."""
    pairs = []
    for run in parts:
        with suppress(FileError):
            pairs += [(run, each) for each in scorer.prepared([run])]
    return drift_of(model, simulated, pairs)


def _gathered(
    done: Sequence[_Scored | Exception], paths: Sequence[str], tell: Tell
) -> tuple[list[ScoredRun], list[Finding]]:
    """Runs and findings of all files; those that cannot be read are findings if others can."""
    runs: list[ScoredRun] = []
    findings: list[Finding] = []
    failures = [each for each in done if isinstance(each, Exception)]
    if failures and len(failures) == len(done):
        raise failures[0]
    for path, each in zip(paths or [""], done, strict=True):
        if isinstance(each, ExciteError):
            findings.append(Finding("not read", "warning", f"left out: {each}", path))
        elif isinstance(each, Exception):
            raise each
        else:
            runs += each[0]
            findings += each[1]
    tell_findings(findings, tell)
    return runs, findings


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
            dataset = dataset_of(case, each, tell)
            for parts in recordings_of(dataset, None, given).values():
                runs += scorer.residuals(parts)
        found = thresholds_of(stored.robot.joint_names, runs, false_alarms, time_constant)
        if output is not None:
            write_thresholds(Path(output), found)
        return found


def _paths(data: str | Path | Sequence[str | Path]) -> list[Path]:
    return [Path(each) for each in ([data] if isinstance(data, str | Path) else data)]


def recordings_of(dataset: Dataset, held_out: str | None, model: Model) -> dict[str, list[Run]]:
    """Parts of every recording by its name; of the `held_out` part alone if it is named."""
    runs = whole(dataset)
    if held_out is not None:
        spec = model.made.spec
        named = held_out if held_out in dataset.names else None
        if named is None and len(dataset.recordings) > 1:
            raise FileError(
                f"--held-out: these data have no run '{held_out}', on which {model.made.path} was "
                "judged. Give the data that it was made of, or leave --held-out out."
            )
        parts = split(dataset, named, spec.diagnosis.block, spec.identification.needed_runs)
        runs = list(parts.held_out)
    found: dict[str, list[Run]] = {}
    for run in runs:
        found.setdefault(run.name, []).append(run)
    return found


def _noticed(found: Score, model: Model, held_out: bool) -> list[Finding]:
    if found.made is None:
        text = (
            f"{found.model} does not state how large its own errors were: no run can be judged by "
            "it. Give a fit, a diagnosis, or a config that `excite diagnose --apply` wrote."
        )
        return [Finding("no_allowance", "warning", text)]
    changing = [effect.title for effect in model.effects if effect.of_campaign]
    if changing and not held_out:
        text = (
            f"{changing[0]}: other recordings have no place on the clock of the campaign that the "
            "model was made of; the first of each file is taken for its beginning"
        )
        return [Finding("other_campaign", "warning", text)]
    return []
