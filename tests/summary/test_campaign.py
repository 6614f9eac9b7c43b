"""What a campaign answers."""

from dataclasses import replace
from pathlib import Path

from excite_cli.shown.answer import Table
from excite_cli.summary.campaign import campaign_answer, round_in_words
from tests.campaign.test_records import WHOLE


def test_the_reason_comes_first_and_seconds_add_up() -> None:
    answer = campaign_answer(WHOLE, Path("place"), {"page": "page.html"})
    assert answer.parts[0] == "spent"
    table = answer.parts[1]
    assert isinstance(table, Table)
    (row,) = table.rows
    assert dict(zip(table.columns, row, strict=True)) == {
        "round": "1",
        "motions": "1 of 2",
        "pace": "30%",
        "seconds": "12",
        "efficiency": "",
        "declared": "10.00%",
        "with effects": "2.00%",
        "torque std [σ]": "0.3",
        "effects": "spring on elbow",
    }
    assert "1 round, 1 motion, 12 s of motion" in str(answer.parts[2])
    assert answer.parts[-1] == "page: place/page.html"
    assert answer.data["seconds"] == 12.5
    assert answer.data["rounds"][0]["motions"][0]["rejected"] == ["no"]


def test_only_a_complete_one_is_good() -> None:
    for end, good in (("complete", True), ("budget", False), ("stuck", False)):
        assert campaign_answer(replace(WHOLE, ended=end), Path(), {}).good is good  # type: ignore[arg-type]


def test_a_round_in_words() -> None:
    learned = WHOLE.rounds[0].learned
    assert learned is not None
    assert round_in_words(1, learned) == (
        "round 1: held-out error 10.00% → 2.00% of the torque on the newest motion, with spring on "
        "elbow; open: a or b"
    )
    assert round_in_words(2, replace(learned, effects=(), open=())).endswith(
        "with no effect; no ambiguous effects, nothing left to explain"
    )
