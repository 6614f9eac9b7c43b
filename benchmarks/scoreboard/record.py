"""What a run of the score board found, kept as JSON so that a later run may do a part of it."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from benchmarks.scoreboard.contestants import Result
from benchmarks.scoreboard.judge import Verdict
from excite_cli.atomic import write_text_atomically


@dataclass(frozen=True)
class Entry:
    """All results on one log, the `date` of each tool's by its name."""

    name: str
    words: str
    real: bool
    results: tuple[Result, ...]
    dates: Mapping[str, str]

    def of(self, tool: str) -> Result | None:
        """The result of a tool, None where it never ran."""
        return next((each for each in self.results if each.tool == tool), None)


def merged(old: Entry | None, new: Entry) -> Entry:
    """The new results, and those of the old ones whose tool did not run now."""
    if old is None:
        return new
    now = {each.tool for each in new.results}
    kept = tuple(each for each in old.results if each.tool not in now)
    return Entry(new.name, new.words, new.real, (*new.results, *kept), {**old.dates, **new.dates})


def write_entries(path: Path, entries: Sequence[Entry]) -> None:
    """All of them; NaN, of joints that do not move, is null."""
    text = json.dumps([asdict(each) for each in entries], indent=1, ensure_ascii=False)
    write_text_atomically(path, text.replace("NaN", "null") + "\n")


def read_entries(path: Path) -> list[Entry]:
    """What `write_entries` wrote; none if there is no file."""
    if not path.is_file():
        return []
    return [_entry(each) for each in json.loads(path.read_text(encoding="utf-8"))]


def _entry(told: dict[str, Any]) -> Entry:
    results = []
    for each in told["results"]:
        verdict = each["verdict"]
        if verdict is not None:
            known = {j: float("nan") if x is None else x for j, x in verdict["by_joint"].items()}
            verdict = Verdict(**{**verdict, "by_joint": known})
        results.append(Result(**{**each, "verdict": verdict}))
    return Entry(**{**told, "results": tuple(results)})
