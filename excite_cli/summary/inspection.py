"""What was seen of log and model before any physics, check by check."""

from collections.abc import Mapping
from typing import Any, Protocol

from excite_cli.checks.look import written
from excite_cli.checks.result import Result
from excite_cli.shown.answer import Answer
from excite_cli.shown.command import Command, as_word
from excite_cli.shown.table import Part, Table


class Inspected(Protocol):
    """An inspection."""

    @property
    def results(self) -> tuple[Result, ...]:
        """Of every check."""

    @property
    def settings(self) -> Mapping[str, Any]:
        """What would change in the config."""

    @property
    def good(self) -> bool:
        """Whether nothing is wrong for certain."""


def inspection_answer(
    found: Inspected, config: str = "", data: tuple[str, ...] = (), applied: str | None = None
) -> Answer:
    """What `excite inspect` answers; status 1 with a fault."""
    return Answer((*_parts(found, config, data, applied),), _data(found, applied), found.good)


def inspection_parts(found: Inspected) -> list[Part]:
    """The headline, the rows, and the evidence of what is not fine."""
    return _parts(found, "", (), None)


def _parts(found: Inspected, config: str, data: tuple[str, ...], applied: str | None) -> list[Part]:
    faults, doubts = (
        [each for each in found.results if each.status == status] for status in ("fault", "doubt")
    )
    parts: list[Part] = [headline(found)]
    rows = tuple(
        (each.name, each.status, ", ".join(each.joints), written(each.settings))
        for each in found.results
    )
    bold = tuple(k for k, each in enumerate(found.results) if each.status != "ok")
    columns = ("check", "status", "joints", "settled by")
    words = ("joints", "settled by")
    parts.append(Table("Before any physics", columns, rows, columns, words, bold))
    parts += [f"{each.status}: {_where(each)}{each.evidence}." for each in (*faults, *doubts)]
    noted = [each for each in found.results if each.status == "ok" and each.evidence]
    parts += [f"{each.evidence}." for each in noted]
    files = tuple(map(as_word, data))
    if applied is not None:
        what = (
            f"with {written(found.settings)}" if found.settings else "in which nothing is changed"
        )
        parts.append(f"Written: {applied}, {what}.")
        parts.append(Command(("excite", "diagnose", as_word(applied), *files)))
    elif found.settings and config:
        parts.append(
            Command(("excite", "inspect", as_word(config), *files, "--apply", "corrected.yaml"))
        )
    elif files and found.good:
        parts.append(Command(("excite", "diagnose", as_word(config), *files)))
    return parts


def _where(result: Result) -> str:
    return f"{result.runs}: " if result.runs else ""


def headline(found: Inspected) -> str:
    """One sentence."""
    faults, doubts = (
        sum(each.status == status for each in found.results) for status in ("fault", "doubt")
    )
    count = len(found.results)
    if faults:
        more = f", {doubts} to be looked at" if doubts else ""
        return f"{faults} of {count} checks found a fault{more}: correct it before any fit."
    if doubts:
        return f"Nothing is wrong for certain; {doubts} of {count} checks have a doubt."
    return f"Nothing is wrong: {count} checks."


def _data(found: Inspected, applied: str | None) -> dict[str, Any]:
    """The answer for `--json`."""
    return {
        "good": found.good,
        "checks": [
            {
                "name": each.name,
                "status": each.status,
                "joints": list(each.joints),
                "runs": each.runs,
                "evidence": each.evidence,
                "key": written(each.settings),
                "settings": dict(each.settings),
            }
            for each in found.results
        ],
        "settings": dict(found.settings),
        "output": applied,
    }
