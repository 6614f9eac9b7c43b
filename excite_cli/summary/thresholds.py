"""Thresholds of a collision detector in words and as a table."""

from excite_cli.scoring.thresholds import Thresholds
from excite_cli.shown.record import show
from excite_cli.shown.table import Parts, Table


def thresholds_parts(found: Thresholds) -> Parts:
    """Level and coefficients of every joint."""
    figures = zip(found.joint_names, found.level, found.coefficients, strict=True)
    rows = tuple((name, *(f"{x:.4g}" for x in (level, *c))) for name, level, c in figures)
    columns = ("joint", "level", "c0", "c1", "c2", "c3")
    return [_in_words(found), Table("", columns, rows, left=("joint",))]


def _in_words(found: Thresholds) -> str:
    return (
        f"{len(found.joint_names)} joints, {found.false_alarms:.3g} false alarms an hour, "
        f"time constant {found.time_constant:.3g} s"
    )


show(Thresholds, _in_words, thresholds_parts)
