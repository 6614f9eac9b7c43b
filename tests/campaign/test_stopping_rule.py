"""What is open after a round, and when a campaign ends."""

from dataclasses import replace

import pytest

from excite_cli.campaign.records import (
    Campaign,
    CampaignOptions,
    CampaignRound,
    PlayedMotion,
    RoundFindings,
)
from excite_cli.campaign.stopping_rule import ended, left_on_newest, still_open
from excite_cli.diagnosis.records import Diagnosis, ErrorReduction
from excite_cli.diagnosis.verdict import HeldOutVerdict
from excite_cli.identification.errors_of_torque import Errors
from tests.diagnosis.synthetic_diagnosis import make_diagnosis


def errors(share: float, rms: float, joints: tuple[str, ...]) -> Errors:
    shares, sizes = dict.fromkeys(joints, share), dict.fromkeys(joints, rms)
    return Errors(share, share, shares, shares, sizes, sizes, (share, share), {}, sizes)


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    """Nothing is left, and the newest motion is predicted as well as the others."""
    diagnosis = make_diagnosis()
    good = errors(0.01, 0.1, diagnosis.joint_names)
    before = errors(0.05, 0.5, diagnosis.joint_names)
    return replace(diagnosis, trained=good, before=before, after=good, excess_residuals=())


def test_what_is_open(found: Diagnosis) -> None:
    assert still_open(found, ()) == ()
    assert still_open(found, ("a or b",)) == ("a or b: not distinguished yet",)
    left = replace(found, excess_residuals=make_diagnosis().excess_residuals)
    assert still_open(left, ()) == ("elbow: excess residual of the torque",)
    useless = replace(found, before=found.after, after=errors(0.011, 0.1, found.joint_names))
    words = "the effects found do not lower the error on the newest motion"
    assert words in still_open(useless, ())


@pytest.mark.parametrize(
    ("share", "rms", "open_"),
    [
        (0.014, 0.14, False),  # as chance makes it
        (0.04, 0.4, True),
        (0.04, 0.1, False),  # the same in N·m: the motion asks for less torque
        (0.01, 0.4, False),  # the same share: the motion asks for more
        (0.0019, 5.0, False),  # a share of no matter
    ],
)
def test_what_is_missed_on_the_newest_motion(
    found: Diagnosis, share: float, rms: float, open_: bool
) -> None:
    joints = found.joint_names
    held_out = replace(found, after=errors(share, rms, joints))
    assert [text.split(":")[0] for text in left_on_newest(held_out)] == list(joints) * open_


@pytest.mark.parametrize(("worse", "open_"), [(0.01, True), (0.001, False)])
def test_a_name_that_does_harm_is_open(found: Diagnosis, worse: float, open_: bool) -> None:
    named = replace(
        found.effects[0],
        verdict=HeldOutVerdict.HARMFUL,
        removes={
            "elbow": ErrorReduction(-worse, -worse, -0.1),
            "slide": ErrorReduction(0.1, 0.1, 1.0),
        },
    )
    told = still_open(replace(found, effects=(named,)), ())
    words = "viscous friction on elbow: the newest motion is predicted worse with it"
    assert told == (words,) * open_


def campaign(
    *rounds: tuple[tuple[str, ...], tuple[str, ...]],
    known: float = 0.1,
    pace: float = 1.0,
    **asked: float,
) -> Campaign:
    """Rounds with (what is open, pairs); each of two motions of 10 s at this `pace`."""
    made = []
    for number, (open_, pairs) in enumerate(rounds, start=1):
        motions = [
            PlayedMotion(f"r{number}_m{k}", "excite", "p.h5", k, pace, 10.0, "log") for k in (1, 2)
        ]
        findings = RoundFindings(0.1, 0.01, ("spring on elbow",), open_, pairs, known)
        made.append(CampaignRound(number, tuple(motions), findings))
    return Campaign("", "", "", CampaignOptions(**asked), tuple(made))  # type: ignore[arg-type]


NOTHING: tuple[tuple[str, ...], tuple[str, ...]] = ((), ())
PAIR = (("a or b: not distinguished yet",), ("a or b",))


def test_it_ends_once_a_motion_looked_for_more_and_nothing_is_open() -> None:
    done = ended(campaign(NOTHING, NOTHING), None)
    assert done.ended == "complete"
    assert "identified without r2_m2" in done.reason
    assert "Effects: spring on elbow; none is ambiguous." in done.reason


OPEN = (("x",), ())
OTHER = (("c or d: not distinguished yet",), ("c or d",))


@pytest.mark.parametrize(
    ("rounds", "precision", "how"),
    [
        (campaign(), None, ""),
        (campaign(NOTHING), None, ""),
        (campaign(NOTHING, OPEN), None, ""),
        # Not below full pace, nor before the precision that is asked for.
        (campaign(NOTHING, NOTHING, from_speed=0.3, pace=0.6), None, ""),
        (campaign(NOTHING, NOTHING, from_speed=0.3, pace=1.0), None, "complete"),
        (campaign(NOTHING, NOTHING, NOTHING, from_speed=0.3, pace=0.6), None, "complete"),
        (campaign(NOTHING, NOTHING, known=0.2), 0.1, ""),
        (campaign(NOTHING, NOTHING, known=0.2), 0.2, "complete"),
        # Pairs that three rounds do not tell apart, and nothing else.
        (campaign(PAIR, PAIR), None, ""),
        (campaign(PAIR, PAIR, OTHER), None, ""),
        (campaign(PAIR, PAIR, ((*PAIR[0], "x"), PAIR[1])), None, ""),
        (campaign(PAIR, PAIR, PAIR), None, "stuck"),
    ],
)
def test_when_it_ends(rounds: Campaign, precision: float | None, how: str) -> None:
    done = ended(rounds, precision)
    assert done.ended == how
    assert how != "stuck" or "a or b" in done.reason


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        ({"most_rounds": 2}, "the budget of 2 rounds (--max-rounds) is spent. Open: x."),
        ({"most_seconds": 40.0}, "the robot moved for 40 s (--max-seconds). Open: x."),
    ],
)
def test_a_budget_that_is_spent_says_what_is_open(asked: dict[str, float], told: str) -> None:
    done = ended(campaign(NOTHING, OPEN, **asked), None)
    assert done.ended == "budget"
    assert told in done.reason
