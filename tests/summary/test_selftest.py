"""What a self-test says: a table as narrow as the others, and a page."""

from excite_cli.report.page import render
from excite_cli.shown.answer import Table
from excite_cli.study.selftest import Outcome, Selftest, SelftestCase
from excite_cli.summary.selftest import selftest_answer, selftest_page

JOINTS = ("shoulder_lift_joint",)
LONG = SelftestCase(
    "nonlinear_viscous_friction@shoulder_lift_joint=-12.34",
    "nonlinear_viscous_friction",
    JOINTS,
    -12.34,
    power=0.97,
    apart=0.1,
    rival="load_dependent_friction@shoulder_lift_joint",
    predicted="confounded",
    outcome=Outcome.CONFOUNDED,
    unit="N·m·(s/rad)^2",
    found=-11.11,
    std=0.01234,
    before=0.1,
    after=0.05,
    named="load_dependent_friction@shoulder_lift_joint",
)
FAILED = SelftestCase("armature@shoulder_lift_joint=1", "armature", JOINTS, 1.0, message="no way")
FOUND = Selftest("arm", JOINTS, (LONG, FAILED), 3)


def _width(table: Table) -> int:
    rows = [table.columns, *table.rows]
    return sum(max(len(row[k]) for row in rows) + 2 for k in range(len(table.columns))) - 2


def test_the_answer_fits_in_100_columns_and_says_what_was_predicted() -> None:
    brief, more = selftest_answer(FOUND), selftest_answer(FOUND, verbose=True)
    tables = [part for part in brief.parts if isinstance(part, Table)]
    assert all(_width(table) <= 100 for table in tables)
    assert tables[1].columns[-4:] == ("power", "predicted", "seen", "size")
    assert tables[1].rows[1][-4:] == ("97%", "confounded", "confounded", "90%")
    assert "Of 1 predictions 1 came true" in str(brief.parts[0])
    assert "armature@shoulder_lift_joint=1 failed: no way" in brief.parts
    told = [part for part in more.parts if isinstance(part, Table)][-1]
    assert told.rows[1][told.columns.index("like")] == LONG.rival
    assert len(tables) == 2
    assert not brief.good


def test_a_page_has_every_table() -> None:
    page = render(selftest_page(FOUND))
    for words in (
        "Self-test of arm",
        "Predicted and seen",
        "-11.11 ± 0.01234",
        LONG.rival,
        "no way",
        "Planted effects that are found: armature 0 of 1",
    ):
        assert words in page
