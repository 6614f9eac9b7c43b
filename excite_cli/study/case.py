"""One case of a study: what it is, doing it, and what is kept of it."""

import hashlib
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from excite_cli.config.load_spec import load_spec, spec_as_yaml
from excite_cli.config.spec import Spec
from excite_cli.errors import FileError, RobotError
from excite_cli.workers.base import Tell

# What a case asks for, as one digest: the settings, and the contents of the files they name.

_MISSING = "missing"


def contents_of(path: Path) -> str:
    """SHA-256 of a file, or of the names and contents of all files of a folder."""
    if not path.exists():
        return _MISSING
    if path.is_file():
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    inside = sorted(each for each in path.rglob("*") if each.is_file())
    parts = [f"{each.relative_to(path)} {contents_of(each)}" for each in inside]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def request_of(
    config: Path,
    overrides: Sequence[str],
    log: Path | None,
    diagnosed: bool,
    contents: Callable[[Path], str] = contents_of,
) -> str:
    """Digest of the resolved config, its folder, the URDF, the fit of `uncertainty`, and the log.

    Files are taken by their contents: those of a worker may be copies. A missing one is for the
    case itself to tell.

    Raises
    ------
    ConfigError
        The config is missing or says what is not allowed.
    """
    spec, folder = load_spec(config, list(overrides)), config.absolute().parent
    asked = [spec_as_yaml(spec), str(folder), _robot(spec, folder)]
    if spec.uncertainty is not None and spec.uncertainty.fit is not None:
        asked.append(contents(folder / spec.uncertainty.fit))
    if log is not None:
        asked += [str(log), contents(log), str(diagnosed)]
    return hashlib.sha256("\n".join(asked).encode()).hexdigest()


def _robot(spec: Spec, folder: Path) -> str:
    from excite_cli.robot.description import load_description

    try:
        return load_description(
            spec.robot.urdf, spec.robot.package_dirs, folder, spec.robot.xacro_args
        ).sha256
    except RobotError:
        return _MISSING


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


# Does a case: makes its files in a folder, tells how far it is, gives the key figures.
Work = Callable[[StudyTask, StudyCase, Path, Tell], Figures]


def overrides_of(task: StudyTask, case: StudyCase) -> list[str]:
    """Those of the study, then the varied values."""
    return [*task.overrides, *(f"{key}={value}" for key, value in case.values.items())]


def do_with(task: StudyTask, case: StudyCase, tell: Tell, work: Work) -> DoneCase:
    """Let `work` do the case in a folder of its own, and take what it made.

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
        figures = work(task, case, Path(folder), tell)
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


def as_data(value: Any) -> Any:
    """Numbers of NumPy as those of Python, for JSON."""
    return value.item() if hasattr(value, "item") else value
