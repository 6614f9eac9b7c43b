"""Viscous and Coulomb friction of every joint as data sheets give it: a table."""

from collections.abc import Sequence
from math import nan

from excite_cli.diagnosis.answer_words import FRICTION
from excite_cli.diagnosis.records import Diagnosis, EffectRecord, FrictionLine, NamedEffect
from excite_cli.identification.fit_words import with_deviation
from excite_cli.shown.table import Table


def friction_rows(found: Diagnosis) -> tuple[list[NamedEffect], set[tuple[str, str]]]:
    """Friction of several kinds on one joint as one effect; and kind and joint of what it is of.

    Terms of one curve are nearly collinear: what each is alone, nobody needs to know.
    """
    rows, own = [], set()
    for line in found.friction_lines:
        if line.verdict is not None:
            record = EffectRecord(FRICTION, (line.joint,), {}, ())
            sizes = {"Coulomb": line.coulomb, "viscous": line.viscous}
            rows.append(
                NamedEffect(
                    record,
                    sizes,
                    nan,
                    nan,
                    nan,
                    verdict=line.verdict,
                    removes=line.removes,
                    parts=line.parts,
                )
            )
            own |= {(kind, line.joint) for kind in line.kinds}
    return rows, own


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
        "Equivalent Coulomb and viscous friction of each joint (straight line, ± std)",
        ("joint", "viscous", "unit", "Coulomb", "unit"),
        rows,
        left=("joint", "unit"),
    )
