"""One case of a study: what it is, doing it, and what is kept of it."""

import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from excite_cli.api.diagnosing import diagnose
from excite_cli.api.identifying import identify, save_fit
from excite_cli.api.loading import load_case, load_data, load_problem
from excite_cli.api.planning import plan
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.errors import FileError
from excite_cli.excitation.motion import Progress
from excite_cli.excitation.result import Result
from excite_cli.study.request import request_of
from excite_cli.workers.base import Tell

# The files that a case may make are named after it, with these suffixes.
SUFFIXES = ("motions.h5", "fit.h5", "diagnosis.h5")
# Key figures of a case: a number or a few words each.
Figures = Mapping[str, float | int | str | None]


@dataclass(frozen=True)
class StudyTask:
    """What all cases share: the config, its overrides, and whether logs are diagnosed too."""

    config: Path
    overrides: tuple[str, ...]
    diagnosed: bool = True


@dataclass(frozen=True)
class StudyCase:
    """One combination of varied values, for a log or, without one, to be optimised.

    `request` is a digest of all that is asked: a stored case with the same one need not be done
    again.
    """

    name: str
    values: dict[str, str]
    log: Path | None
    request: str


@dataclass(frozen=True)
class DoneCase:
    """Key figures, the contents of the files by their suffix, and the time it took [s].

    Contents travel instead of names: a worker may run on a machine with another disk.
    """

    figures: Figures
    files: dict[str, bytes]
    seconds: float


def overrides_of(task: StudyTask, case: StudyCase) -> list[str]:
    """Those of the study, then the varied values."""
    return [*task.overrides, *(f"{key}={value}" for key, value in case.values.items())]


def do_case(task: StudyTask, case: StudyCase, tell: Tell) -> DoneCase:
    """Optimise the case, or identify and diagnose its log.

    Raises
    ------
    FileError
        A file that the case is made of is no longer what it was when the study was planned.
    ExciteError
        What the command for it would end with.
    """
    began = time.perf_counter()
    _check_unchanged(task, case)
    with tempfile.TemporaryDirectory() as folder:
        if case.log is None:
            figures = _optimised(task, case, Path(folder), tell)
        else:
            figures = _traced(task, case, case.log, Path(folder), tell)
        files = {path.name: path.read_bytes() for path in sorted(Path(folder).iterdir())}
    _check_unchanged(task, case)
    return DoneCase(figures, files, time.perf_counter() - began)


def _check_unchanged(task: StudyTask, case: StudyCase) -> None:
    """The files are read again, perhaps hours after the study was planned."""
    found = request_of(task.config, overrides_of(task, case), case.log, task.diagnosed)
    if found != case.request:
        log = " or the log" if case.log is not None else ""
        raise FileError(
            f"{task.config}, a file that it names{log} was changed while the study ran, or is "
            "another one on the machine of this worker. Begin another study."
        )


def _optimised(task: StudyTask, case: StudyCase, folder: Path, tell: Tell) -> Figures:
    problem = load_problem(task.config, overrides_of(task, case))

    def progress(index: int, state: Progress) -> None:
        tell(f"motion {index}, {state.figure}")

    result: Result = plan(problem, output=folder / "motions.h5", progress=progress)
    last = result.motions[-1]
    proved = all(all(motion.certified.values()) for motion in result.motions)
    return {
        "motions": len(result.motions),
        "condition_number": last.stacked_condition_number,
        "status": ", ".join(dict.fromkeys(motion.status for motion in result.motions)),
        "proved": "yes" if proved and last.certified else "no",
        "iterations": sum(motion.iterations for motion in result.motions),
    }


def _traced(task: StudyTask, case: StudyCase, log: Path, folder: Path, tell: Tell) -> Figures:
    model = load_case(task.config, overrides_of(task, case))
    data = load_data(model, log)
    fit = identify(model, data)
    save_fit(folder / "fit.h5", model, fit)
    figures: dict[str, float | int | str | None] = {
        "sealed_run": fit.sealed_run,
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
        "unexplained": ", ".join(each.joint for each in found.unexplained),
    }


def _listed(effects: list[tuple[str, tuple[str, ...]]]) -> str:
    return "; ".join(f"{kind} on {', '.join(joints)}" for kind, joints in effects)


def as_data(value: Any) -> Any:
    """Numbers of NumPy as those of Python, for JSON."""
    return value.item() if hasattr(value, "item") else value
