"""The folder of a study: a JSON record per case, the files it made, and a table of all.

A record is written last, so where there is one the case is complete.
"""

import csv
import io
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from excite_cli.atomic import write_atomically
from excite_cli.errors import FileError
from excite_cli.study.case import SUFFIXES, DoneCase, StudyCase, as_data

TABLE = "study.csv"
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
        There is one of another config, robot or log.
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
            f"--resume: {path} was made with another config, robot or log. Give another folder "
            "with -o, or delete it."
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
    def write(temporary: Path) -> None:
        temporary.write_bytes(content)

    write_atomically(path, write)
