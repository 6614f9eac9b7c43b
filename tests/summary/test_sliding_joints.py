"""Units of joints that slide, in words that speak of all joints."""

import pytest

from excite_cli.scoring.records import Replay
from excite_cli.shown.answer import Table
from excite_cli.summary.simulation import replay_parts


@pytest.mark.parametrize(
    ("sliding", "unit"), [((), "mrad"), (("lift",), "mrad (mm)"), (("lift", "turn"), "mm")]
)
def test_a_mean_over_joints_that_slide_and_turn_says_so(
    sliding: tuple[str, ...], unit: str
) -> None:
    deviations = {"lift": 1e-3, "turn": 3e-3}
    for before in (None, {"lift": 1.0, "turn": 2.0}):
        replay = Replay("arm.h5", ("a",), 5.0, before, deviations, sliding=sliding)
        words, table = replay_parts(replay)
        assert isinstance(words, str)
        assert f"by 2 {unit}" in words
        assert isinstance(table, Table)
        assert [row[3] for row in table.rows] == [
            "mm" if joint in sliding else "mrad" for joint in deviations
        ]
