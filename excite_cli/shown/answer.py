"""The answer of a command: for people and for scripts."""

from dataclasses import dataclass, field
from typing import Any

from excite_cli.shown.table import Part


@dataclass(frozen=True)
class Answer:
    """`parts`: tables, sentences and commands in reading order; `data`: the same for `--json`.

    `good` is false where the work was done and its answer is bad (exit status 1).
    """

    parts: tuple[Part, ...]
    data: dict[str, Any] = field(default_factory=dict)
    good: bool = True
