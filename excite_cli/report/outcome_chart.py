"""What becomes of planted effects: a row per kind, joints from base to tip, outcomes in colour."""

from excite_cli.report.chart import Colour
from excite_cli.report.rows_chart import Axis, Form, Mark, Row, RowsChart, rows_chart
from excite_cli.study.selftest import Outcome, Selftest, SelftestCase

_FORMS: dict[Outcome, tuple[Colour, Form]] = {
    Outcome.FOUND: ("green", "dot"),
    Outcome.CONFOUNDED: ("purple", "ring"),
    Outcome.NOT_FOUND: ("muted", "ring"),
    Outcome.WRONG: ("vermilion", "cross"),
    Outcome.FAILED: ("ink", "cross"),
}
_BESIDE = 0.2  # of the distance of two joints: cases of one kind on one joint


def outcome_chart(found: Selftest) -> RowsChart:
    """Every case at its first joint, and how many of each kind are found."""
    kinds: dict[str, list[SelftestCase]] = {}
    for case in sorted(found.cases, key=lambda each: (each.kind, each.effect)):
        kinds.setdefault(case.kind, []).append(case)
    rows = [_row(kind, cases, found.joint_names) for kind, cases in kinds.items()]
    count = len(found.joint_names)
    axis = Axis("joint", 0.5, count + 0.5, ticks=tuple(map(float, range(1, count + 1))))
    shares = "; ".join(f"{row.name} {row.note.replace('/', ' of ')}" for row in rows)
    return rows_chart(
        "Outcome by kind and joint",
        f"Planted effects that are found: {shares}.",
        axis,
        rows,
        ", ".join(f"{k + 1} {name}" for k, name in enumerate(found.joint_names)),
        "found",
    )


def _row(kind: str, cases: list[SelftestCase], joints: tuple[str, ...]) -> Row:
    marks: list[Mark] = []
    for joint, name in enumerate(joints, 1):
        there = [Outcome(case.outcome) for case in cases if case.joints[0] == name]
        for k, outcome in enumerate(there):
            beside = _BESIDE * (k - 0.5 * (len(there) - 1))
            marks.append(Mark(joint + beside, str(outcome), *_FORMS[outcome]))
    right = sum(case.outcome == Outcome.FOUND for case in cases)
    return Row(kind.replace("_", " "), tuple(marks), note=f"{right}/{len(cases)}")
