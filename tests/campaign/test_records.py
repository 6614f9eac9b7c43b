"""The state of a campaign is read back as it was written; paces, and what motions look for."""

from pathlib import Path

import pytest

from excite_cli.api.loading import load_case
from excite_cli.campaign.records import (
    STATE,
    Campaign,
    CampaignOptions,
    CampaignRound,
    PlayedMotion,
    RoundFindings,
    looked_for,
    pace_of,
    read_campaign,
    write_campaign,
)
from excite_cli.effects.catalogue import catalogue
from excite_cli.effects.spring import Spring
from excite_cli.errors import FileError
from tests.cli.program import SMOKE

MOTIONS = (
    PlayedMotion("round_1_motion_1", "first", "round_1.h5", 1, 0.3, 12.5, "a.csv", ("no",)),
    PlayedMotion("round_1_motion_2", "explore", "round_1_explore.h5", 1, 0.3),
)
WHOLE = Campaign(
    "robot: {}",
    "/somewhere",
    "print",
    CampaignOptions(0.3, 5, 100.0, False, True),
    (
        CampaignRound(
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
    other = CampaignRound(1, MOTIONS[:1])
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
        (None, "rounds.0.number"),  # a word where a number should be
    ],
)
def test_a_damaged_one_is_told(tmp_path: Path, text: str | None, told: str) -> None:
    write_campaign(tmp_path, WHOLE)
    wrong = (tmp_path / STATE).read_text().replace('"number": 1', '"number": "first"')
    (tmp_path / STATE).write_text(wrong if text is None else text)
    with pytest.raises(FileError) as error:
        read_campaign(tmp_path)
    assert told in str(error.value)
    assert "begin in another folder" in str(error.value)


@pytest.mark.parametrize(
    ("first", "paces"),
    [(1.0, [1.0, 1.0]), (0.3, [0.3, 0.6, 1.0, 1.0]), (0.1, [0.1, 0.2, 0.4, 0.8, 1.0])],
)
def test_rounds_get_faster_up_to_their_own_pace(first: float, paces: list[float]) -> None:
    assert [pace_of(k, first) for k in range(1, len(paces) + 1)] == pytest.approx(paces)


def test_what_is_known_is_not_looked_for() -> None:
    robot = load_case(SMOKE).robot
    every = looked_for(robot, ())
    spring = Spring((2,))
    assert {(e.kind, e.joints) for e in every} - {
        (e.kind, e.joints) for e in looked_for(robot, (spring,))
    } == {("spring", (2,))}
    assert {e.joints for e in every} == {(j,) for j in range(robot.n)}


def test_only_what_motions_decide_is_looked_for() -> None:
    """Not what the log got wrong, nor what changes over the days, nor other names of the same."""
    kinds = {effect.kind for effect in looked_for(load_case(SMOKE).robot, ())}
    assert {"coulomb_friction", "stribeck_friction", "spring", "ripple"} <= kinds
    assert not kinds & {"torque_offset", "torque_gain", "friction_drift", "asymmetric_friction"}
    assert all(catalogue()[kind].excitable for kind in kinds)
