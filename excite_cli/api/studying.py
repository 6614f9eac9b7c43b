"""The same work for many settings and many logs: `excite study`."""

from collections.abc import Callable, Sequence
from pathlib import Path

from excite_cli.api.arguments import checked
from excite_cli.api.diagnosing import diagnose
from excite_cli.api.identifying import identify, save_fit
from excite_cli.api.loading import load_case, load_data, load_problem
from excite_cli.api.planning import plan
from excite_cli.config.load_spec import files_of_config, load_spec
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.errors import ConfigError
from excite_cli.excitation.progress import Progress, figure_in_words
from excite_cli.given_files import refuse_inputs_as_outputs
from excite_cli.shown.note import unheard
from excite_cli.study.case import (
    DoneCase,
    Figures,
    StudyCase,
    StudyTask,
    do_with,
    overrides_of,
)
from excite_cli.study.plan import parse_vary, planned_cases
from excite_cli.study.records import TABLE, CaseRecord, files_of
from excite_cli.study.records import StudyNews as StudyNews
from excite_cli.study.records import run_study as run_cases
from excite_cli.summary.study import study_answer as study_answer
from excite_cli.workers.base import Tell, Workers


@checked()
def run_study(
    config: str | Path,
    logs: Sequence[str | Path] = (),
    vary: Sequence[str] = (),
    *,
    output: str | Path | None = None,
    overrides: Sequence[str] = (),
    diagnosed: bool = True,
    resume: bool = False,
    overwrite: bool = False,
    progress: Callable[[StudyNews], None] = unheard,
    workers: Workers | None = None,
) -> list[CaseRecord]:
    """Optimise, or identify and diagnose logs, for every combination of settings.

    `vary` are `key.path=V1,V2,…`. Without `logs` the config is optimised for every combination;
    with them every log is identified, and `diagnosed`. The folder `output` (see `study_folder`)
    gets the files of every case, its key figures as JSON, and the table study.csv. A case that
    fails is a record with its message. With `resume` cases that are there are not done again.

    Raises
    ------
    ConfigError
        Nothing is varied, a key or a value is wrong; both `resume` and `overwrite` are given.
    FileError
        A log is missing; the folder has files of a study already, or cannot be written to.
    """
    if resume and overwrite:
        raise ConfigError("--resume goes on with the folder, --overwrite replaces it: give one.")
    task = StudyTask(Path(config).resolve(), tuple(overrides), diagnosed)
    cases = planned_cases(task, [Path(log) for log in logs], [parse_vary(text) for text in vary])
    folder = study_folder(config, output)
    _refuse_inputs(task, cases, folder)
    return run_cases(task, cases, folder, do_case, workers, resume, progress, overwrite)


def _refuse_inputs(task: StudyTask, cases: Sequence[StudyCase], folder: Path) -> None:
    """No file of the study may be the config, a log, or what the config names."""
    settings = [f"{key}={value}" for key, value in cases[0].values.items()]
    spec = load_spec(task.config, [*task.overrides, *settings])
    own = files_of_config(spec, task.config.parent, task.config)
    logs = {case.log for case in cases if case.log is not None}
    written = (folder / TABLE, *(path for case in cases for path in files_of(folder, case)))
    present = {f"{path.name}:": path for path in written if path.exists()}
    refuse_inputs_as_outputs(present, (*own, *sorted(logs)))


def study_folder(config: str | Path, output: str | Path | None) -> Path:
    """`output`, or <config name>_study here."""
    return Path(f"{Path(config).stem}_study") if output is None else Path(output)


def do_case(task: StudyTask, case: StudyCase, tell: Tell) -> DoneCase:
    """One case, on whatever worker: optimise it, or identify and diagnose its log."""
    return do_with(task, case, tell, _optimised if case.log is None else _traced)


def _optimised(task: StudyTask, case: StudyCase, folder: Path, tell: Tell) -> Figures:
    problem = load_problem(task.config, overrides_of(task, case), unheard)

    def progress(index: int, state: Progress) -> None:
        tell(f"motion {index}, {figure_in_words(state.figure)}")

    result = plan(problem, output=folder / "motions.h5", progress=progress, tell=unheard)
    last = result.motions[-1]
    proved = all(all(motion.certified.values()) for motion in result.motions)
    return {
        "motions": len(result.motions),
        "condition_number": last.stacked_condition_number,
        "status": ", ".join(dict.fromkeys(motion.status for motion in result.motions)),
        "proved": "yes" if proved and last.certified else "no",
        "iterations": sum(motion.iterations for motion in result.motions),
    }


def _traced(task: StudyTask, case: StudyCase, folder: Path, tell: Tell) -> Figures:
    assert case.log is not None
    model = load_case(task.config, overrides_of(task, case))
    data = load_data(model, case.log, unheard)
    fit = identify(model, data)
    save_fit(folder / "fit.h5", model, fit)
    figures: dict[str, float | int | str | None] = {
        "held_out_run": fit.held_out_run,
        "parameters": len(fit.fit.names),
        "identified_error": fit.error.mean_relative_moving,
    }
    if task.diagnosed:
        found = diagnose(
            model,
            data,
            output=folder / "diagnosis.h5",
            progress=lambda text, done: tell(text),
        )
        figures |= _diagnosed(found)
    return figures


def _diagnosed(found: Diagnosis) -> Figures:
    return {
        "before": found.before.mean_relative_moving,
        "after": found.after.mean_relative_moving,
        "effects": _listed([(e.effect.kind, e.effect.joints) for e in found.named]),
        "absorbed": _listed([(e.kind, e.joints) for e in found.absorbed]),
        "unexplained": ", ".join(found.joints_with_residual),
    }


def _listed(effects: list[tuple[str, tuple[str, ...]]]) -> str:
    return "; ".join(f"{kind} on {', '.join(joints)}" for kind, joints in effects)
