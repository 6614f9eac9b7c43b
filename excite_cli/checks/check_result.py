"""What a check says: a row of `excite inspect`, a finding of every other command."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from excite_cli.measurement.dataset import Finding

Status = Literal["ok", "doubt", "fault"]
_NAMED = 4  # of what a sentence lists
_SEVERITY: dict[Status, Literal["note", "warning", "error"]] = {
    "ok": "note", "doubt": "warning", "fault": "error",
}  # fmt: skip


@dataclass(frozen=True)
class CheckResult:
    """Of the check `name`: its `status`, in which `joints` and `runs`, `evidence` in numbers.

    `settings`: what to write in the config, by the path of the key. `kind` is that of the finding.
    `is_open`: until it is settled no effect is confirmed.
    """

    name: str
    kind: str
    status: Status = "ok"
    evidence: str = ""
    joints: tuple[str, ...] = ()
    runs: str = ""
    settings: Mapping[str, Any] = field(default_factory=dict)
    is_open: bool = False

    @property
    def finding(self) -> Finding:
        """For those who list what was noticed."""
        severity = _SEVERITY[self.status]
        return Finding(self.kind, severity, self.evidence, self.runs, self.joints)


def few(words: Sequence[str], separator: str = ", ") -> str:
    """The first of many words, and how many more there are."""
    more = f"{separator}and {len(words) - _NAMED} more" if len(words) > _NAMED else ""
    return separator.join(words[:_NAMED]) + more
