"""Outcomes of planted effects: a row per kind, a mark per case at its joint, in its colour."""

from excite_cli.report.outcome_chart import outcome_chart
from excite_cli.study.selftest import Outcome, Selftest, SelftestCase

JOINTS = ("shoulder", "elbow", "wrist")


def case(kind: str, joint: str, outcome: Outcome, size: float = 1.0) -> SelftestCase:
    return SelftestCase(f"{kind}@{joint}={size:g}", kind, (joint,), size, outcome=outcome)


CASES = (
    case("torque_gain", "elbow", Outcome.FOUND),
    case("torque_gain", "elbow", Outcome.NOT_FOUND, 2.0),
    case("torque_gain", "wrist", Outcome.WRONG),
    case("armature", "shoulder", Outcome.CONFOUNDED),
)


def test_marks_are_at_the_joints_in_the_colours_of_outcomes() -> None:
    chart = outcome_chart(Selftest("arm", JOINTS, CASES, 4))
    assert [(row.name, row.note) for row in chart.rows] == [
        ("armature", "0/1"),
        ("torque gain", "1/3"),
    ]
    marks = [(mark.x, mark.word, mark.colour) for mark in chart.rows[1].marks]
    assert marks == [
        (1.9, "found", "green"),
        (2.1, "not found", "muted"),
        (3.0, "wrong", "vermilion"),
    ]
    assert chart.alternative.endswith("armature 0 of 1; torque gain 1 of 3.")
    assert chart.caption == "1 shoulder, 2 elbow, 3 wrist"
    assert chart.svg.count("<circle") == 3 + 3, "and as many in the legend"
