"""Numbers in tables; what is not known is "-"."""

from collections.abc import Iterable, Mapping
from math import isnan
from typing import Any

from excite_cli.fields import data_of
from excite_cli.measurement.dataset import Finding


def findings_data(findings: Iterable[Finding]) -> list[dict[str, Any]]:
    """What was noticed about data, for `--json`."""
    return [data_of(each, "kind", "severity", "run", "text") for each in findings]


# The files that a command has written, told at the end of its answer.


def files_in_words(files: Mapping[str, str]) -> list[str]:
    """One line for all `files`, by what they hold; none if nothing was written."""
    listed = ", ".join(f"{path} ({kind})" for kind, path in files.items())
    return [f"Written: {listed}."] if files else []


def percent(share: float) -> str:
    """12.34%."""
    return "-" if isnan(share) else f"{share:.2%}"


def points(share: float) -> str:
    """12.34 pp."""
    return "-" if isnan(share) else f"{100 * share:.2f} pp"


def figure(value: float) -> str:
    """Four digits."""
    return "-" if isnan(value) else f"{value:.4g}"
