"""Paces of the rounds, and what a motion looks for."""

import pytest

from excite_cli.api.loading import load_case
from excite_cli.campaign.records import looked_for, pace_of
from excite_cli.effects.catalogue import catalogue
from excite_cli.effects.spring import Spring
from tests.cli.program import SMOKE


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
