"""The folder of a study: a JSON record per case, the files it made, and a table of all.

A record is written last, so where there is one the case is complete.
"""

import csv
import io
import itertools
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TypeVar

from excite_cli.atomic import write_atomically
from excite_cli.claim import claim
from excite_cli.errors import ExciteError, FileError, refusal
from excite_cli.shown.note import never
from excite_cli.study.case import SUFFIXES, DoneCase, StudyCase, as_data
from excite_cli.workers.base import Here, News, Tell, Workers

TABLE = "study.csv"
T = TypeVar("T")  # what all cases share
_SCHEMA = 1


@dataclass(frozen=True)
class CaseRecord:
    """What came of a case: key figures, or the `message` of what it failed with."""

    name: str
    values: dict[str, str]
    log: str | None
    request: str
    figures: dict[str, Any]
    message: str
    files: tuple[str, ...]
    seconds: float

    @property
    def failed(self) -> bool:
        """Whether it ended with an error."""
        return bool(self.message)


def keep_case(folder: Path, case: StudyCase, outcome: DoneCase | Exception) -> CaseRecord:
    """Write the files of a case, then its record.

    Raises
    ------
    FileError
        The folder cannot be written to.
    """
    files: list[str] = []
    figures: dict[str, Any] = {}
    message, seconds = "", 0.0
    if isinstance(outcome, DoneCase):
        for suffix, content in outcome.files.items():
            files.append(f"{case.name}.{suffix}")
            _write(folder / files[-1], content)
        figures = {key: as_data(value) for key, value in outcome.figures.items()}
        seconds = outcome.seconds
    else:
        message = str(outcome) or type(outcome).__name__
    record = CaseRecord(
        name=case.name,
        values=case.values,
        log=str(case.log) if case.log is not None else None,
        request=case.request,
        figures=figures,
        message=message,
        files=tuple(files),
        seconds=seconds,
    )
    text = json.dumps({"schema": _SCHEMA, **asdict(record)}, ensure_ascii=False, indent=1)
    _write(folder / f"{case.name}.json", text.encode())
    return record


def files_of(folder: Path, case: StudyCase) -> list[Path]:
    """The record of a case and all files that it may make."""
    return [folder / f"{case.name}.{suffix}" for suffix in ("json", *SUFFIXES)]


def kept_case(folder: Path, case: StudyCase) -> CaseRecord | None:
    """The stored record of a case that went well; None where it is still to be done.

    A damaged one, as a disk may leave it, is as good as none.

    Raises
    ------
    FileError
        There is one of another config, robot, log or settings.
    """
    path = folder / f"{case.name}.json"
    if not path.is_file():
        return None
    try:
        record = _record(json.loads(path.read_text(encoding="utf-8")))
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return None
    if record.request != case.request:
        raise FileError(
            f"--resume: {path} was made with another config, robot, log or settings. Give another "
            "folder with -o, or delete it."
        )
    whole = all((folder / name).is_file() for name in record.files)
    return record if whole and not record.failed else None


def _record(stored: dict[str, Any]) -> CaseRecord:
    """The record of what was read; one of many errors where it is none."""
    if stored.pop("schema") != _SCHEMA:
        raise ValueError("schema")
    record = CaseRecord(**{**stored, "files": tuple(stored["files"])})
    words = (record.name, record.request, record.message, *record.files, *record.values.values())
    figures = (record.seconds, *record.figures.values())
    if not all(isinstance(each, str) for each in words):
        raise TypeError("words")
    if not all(each is None or isinstance(each, str | int | float) for each in figures):
        raise TypeError("figures")
    return record


def write_table(folder: Path, records: Sequence[CaseRecord]) -> Path:
    """All cases with their key figures, one row each, as CSV; its path."""
    rows = [row_of(record) for record in records]
    names = list(dict.fromkeys(name for row in rows for name in row))
    text = io.StringIO()
    writer = csv.DictWriter(text, names, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    _write(folder / TABLE, text.getvalue().encode())
    return folder / TABLE


def row_of(record: CaseRecord) -> dict[str, Any]:
    """The values and figures of a case by column."""
    log = {"log": record.log} if record.log is not None else {}
    return {
        "case": record.name,
        **log,
        **record.values,
        **record.figures,
        "seconds": round(record.seconds, 3),
        "error": record.message,
    }


def _write(path: Path, content: bytes) -> None:
    write_atomically(path, lambda temporary: temporary.write_bytes(content))


# A parameter study: whole cases spread over workers, each kept as soon as it is done.

# Figures of which the lowest is the best, the first that a case has.
BEST = ("condition_number", "after", "identified_error")


@dataclass(frozen=True)
class StudyNews:
    """How far a study is: cases done (those kept from before too), running, all; the best figure.

    `told`: what a running case said last, or how one ended.
    """

    done: int
    running: int
    total: int
    best: float
    told: str


def run_study(
    task: T,
    cases: Sequence[StudyCase],
    folder: Path,
    do_case: Callable[[T, StudyCase, Tell], DoneCase],
    workers: Workers | None = None,
    resume: bool = False,
    report: Callable[[StudyNews], None] = lambda news: None,
    overwrite: bool = False,
    ended: Callable[[], bool] = never,
) -> list[CaseRecord]:
    """Do all cases, in `folder` a record and the files of each; a failure is a record too.

    `do_case` does one; workers import it by its name. Once `ended` says so, no other is begun.

    With `resume` cases that are there already are not done again, failed ones are; with `overwrite`
    all are. The table of all is written at the end; the folder is claimed by its name. Results do
    not depend on `workers`, but seconds do.

    Raises
    ------
    FileError
        Files of a study are in the folder, and neither `resume` nor `overwrite` is requested; or,
        with `resume`, of other cases. Another run is writing it, or it cannot be written to.
    """
    claim(folder / TABLE)
    if overwrite:
        _forget(cases, folder)
    elif not resume:
        _check_free(cases, folder)
    records: dict[int, CaseRecord] = {}
    for index, case in enumerate(cases if resume and not overwrite else ()):
        kept = kept_case(folder, case)
        if kept is not None:
            records[index] = kept
    before = len(records)
    left = [index for index in range(len(cases)) if index not in records]

    def watch(news: News) -> None:
        told = str(news.word or "")
        if news.result is not None:
            index = left[news.index]
            records[index] = keep_case(folder, cases[index], _expected(news.result))
            told = records[index].message or "done"
        best = min((figure_of(record) for record in records.values()), default=float("inf"))
        told = f"{cases[left[news.index]].name}: {told}"
        report(StudyNews(before + news.done, news.running, len(cases), best, told))

    place = workers or Here()
    begun = (cases[index] for index in itertools.takewhile(lambda index: not ended(), left))
    place.map(do_case, task, begun, watch, keep_failures=True)
    found = [records[index] for index in sorted(records)]
    write_table(folder, found)
    return found


def _check_free(cases: Sequence[StudyCase], folder: Path) -> None:
    there = [folder / TABLE, *(path for case in cases for path in files_of(folder, case))]
    found = next((path for path in there if path.exists()), None)
    if found is not None:
        raise FileError(
            f"{found} exists already. Go on with --resume, give another folder with -o, or replace "
            "it with --overwrite."
        )


def _forget(cases: Sequence[StudyCase], folder: Path) -> None:
    """Remove table and records: what is interrupted from now on is not taken for complete."""
    try:
        for path in (folder / TABLE, *(files_of(folder, case)[0] for case in cases)):
            path.unlink(missing_ok=True)
    except OSError as error:
        raise FileError(f"{path} cannot be replaced: {refusal(error)}") from error


def figure_of(record: CaseRecord) -> float:
    """The figure that a study is about, infinite where a case has none."""
    return next(
        (float(record.figures[name]) for name in BEST if record.figures.get(name) is not None),
        float("inf"),
    )


def _expected(outcome: DoneCase | Exception) -> DoneCase | Exception:
    """The outcome; a bug of ours says that it is one."""
    if isinstance(outcome, Exception) and not isinstance(outcome, ExciteError | MemoryError):
        kind = type(outcome).__name__
        return RuntimeError(f"a bug of excite, not of your input ({kind}: {outcome})")
    return outcome
