"""Worst margins for scripts."""

from typing import Any

from excite_cli.proof.worst_margin import Worst


def worst_data(worst: Worst) -> dict[str, Any]:
    """A worst margin for `--json`."""
    return {
        "margin": worst.margin,
        "share": worst.share,
        "unit": worst.unit,
        "where": worst.label,
        "time": worst.time,
        "violations": worst.violations,
    }
