"""Viscous and Coulomb friction of every joint as data sheets give it: a table."""

from collections.abc import Sequence

from excite_cli.diagnosis.records import FrictionLine
from excite_cli.identification.fit_words import with_deviation
from excite_cli.shown.table import Table


def friction_table(lines: Sequence[FrictionLine]) -> Table:
    """The straight line through all friction of each joint; not the model's own terms."""
    rows = tuple(
        (
            line.joint,
            with_deviation(line.viscous.value, line.viscous.std),
            line.viscous.unit,
            with_deviation(line.coulomb.value, line.coulomb.std),
            line.coulomb.unit,
        )
        for line in lines
    )
    return Table(
        "As on a data sheet: the straight line through all friction of a joint (± std)",
        ("joint", "viscous", "unit", "Coulomb", "unit"),
        rows,
        left=("joint", "unit"),
    )
