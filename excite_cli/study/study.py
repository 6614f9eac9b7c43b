"""A parameter study: whole cases spread over workers, each kept as soon as it is done."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from excite_cli.claim import claim
from excite_cli.errors import ExciteError, FileError, refusal
from excite_cli.study.case import DoneCase, StudyCase, StudyTask
from excite_cli.study.records import (
    TABLE,
    CaseRecord,
    files_of,
    keep_case,
    kept_case,
    write_table,
)
from excite_cli.workers.base import Here, News, Tell, Workers

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
    task: StudyTask,
    cases: Sequence[StudyCase],
    folder: Path,
    do_case: Callable[[StudyTask, StudyCase, Tell], DoneCase],
    workers: Workers | None = None,
    resume: bool = False,
    report: Callable[[StudyNews], None] = lambda news: None,
    overwrite: bool = False,
) -> list[CaseRecord]:
    """Do all cases, in `folder` a record and the files of each; a failure is a record too.

    `do_case` does one; workers import it by its name.

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
    place.map(do_case, task, [cases[index] for index in left], watch, keep_failures=True)
    found = [records[index] for index in range(len(cases))]
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
