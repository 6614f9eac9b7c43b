"""The table of a study, and its answer for `--json`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from excite_cli.shown.answer import Answer, Table
from excite_cli.study.records import TABLE, CaseRecord, row_of

# Shares that are reported in per cent; and columns that are words.
_SHARES = ("identified_error", "before", "after")
_WORDS = ("case", "log", "status", "proved", "held_out_run", "effects", "absorbed", "unexplained")
# Told by the name of the case already, or too much for a row.
_LEFT_OUT = ("log", "held_out_run", "absorbed", "proved")


def study_table(records: Sequence[CaseRecord]) -> Table:
    """A row per case: figures, or the message of what it failed with."""
    rows = [_shown(record) for record in records]
    names = list(dict.fromkeys(name for row in rows for name in row))
    names.sort(key=lambda name: name == "error")  # the last column
    words = [name for name in names if name in ("case", "effects", "error")]
    return Table(
        "Cases",
        tuple(name.replace("_", " ") for name in names),
        tuple(tuple(row.get(name, "") for name in names) for row in rows),
        left=tuple(n.replace("_", " ") for n in names if n in _WORDS and n not in words),
        words=tuple(words),
    )


def study_answer(records: Sequence[CaseRecord], folder: Path) -> Answer:
    """What `excite study` answers."""
    failed = sum(record.failed for record in records)
    words = f"{len(records)} cases" + (f", {failed} failed" if failed else "")
    data = {
        "cases": [
            {
                "name": record.name,
                "values": record.values,
                "log": record.log,
                "failed": record.failed,
                "error": record.message or None,
                "seconds": record.seconds,
                **record.figures,
                "files": [str(folder / name) for name in record.files],
            }
            for record in records
        ],
        "failed": failed,
        "table": str(folder / TABLE),
        "output": str(folder),
    }
    parts = (study_table(records), f"{words}; {folder / TABLE}")
    return Answer(parts, data, good=not failed)


def _shown(record: CaseRecord) -> dict[str, str]:
    row = {key: value for key, value in row_of(record).items() if key not in _LEFT_OUT}
    row = {key: value for key, value in row.items() if key not in record.values}
    if not record.failed:
        del row["error"]
    return {key: _words(key, value) for key, value in row.items()}


def _words(key: str, value: Any) -> str:
    if isinstance(value, float):
        if key in _SHARES:
            return f"{100 * value:.2f}%"
        return f"{value:.1f}" if key == "seconds" else f"{value:.4g}"
    return str(value)
