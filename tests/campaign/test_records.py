"""The state of a campaign is written whole, and read back as it was."""

from pathlib import Path

import pytest

from excite_cli.campaign.records import (
    STATE,
    Asked,
    Campaign,
    PlayedMotion,
    Round,
    RoundFindings,
    read_campaign,
    write_campaign,
)
from excite_cli.errors import FileError

MOTIONS = (
    PlayedMotion("round_1_motion_1", "first", "round_1.h5", 1, 0.3, 12.5, "a.csv", ("no",)),
    PlayedMotion("round_1_motion_2", "explore", "round_1_explore.h5", 1, 0.3),
)
WHOLE = Campaign(
    "robot: {}",
    "/somewhere",
    "print",
    Asked(0.3, 5, 100.0, False, True),
    (
        Round(
            1,
            MOTIONS,
            RoundFindings(0.1, 0.02, ("spring on elbow",), ("a or b",), ("a or b",), 0.3),
        ),
    ),
    "budget",
    "spent",
    {"excite": "1"},
)


def test_it_is_read_as_it_was_written(tmp_path: Path) -> None:
    write_campaign(tmp_path, WHOLE)
    assert read_campaign(tmp_path) == WHOLE
    assert WHOLE.rounds[0].missing == MOTIONS[1]
    assert WHOLE.seconds == 12.5  # of what is measured
    other = Round(1, MOTIONS[:1])
    assert WHOLE.with_round(other).rounds == (other,)


def test_none_is_told(tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"holds no campaign.*Begin one without --resume"):
        read_campaign(tmp_path)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("{", "is not the state of a campaign: the file: "),
        ('{"config": "x"}', "is not the state of a campaign: config_folder: "),
        ("[1]", "is not the state of a campaign"),
    ],
)
def test_a_damaged_one_is_told(tmp_path: Path, text: str, told: str) -> None:
    (tmp_path / STATE).write_text(text)
    with pytest.raises(FileError) as error:
        read_campaign(tmp_path)
    assert told in str(error.value)
    assert "begin in another folder" in str(error.value)


def test_a_number_of_another_kind_is_told_with_its_place(tmp_path: Path) -> None:
    write_campaign(tmp_path, WHOLE)
    text = (tmp_path / STATE).read_text().replace('"number": 1', '"number": "first"')
    (tmp_path / STATE).write_text(text)
    with pytest.raises(FileError, match=r"rounds\.0\.number"):
        read_campaign(tmp_path)
