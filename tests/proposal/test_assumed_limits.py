"""Limits: the URDF's where a real joint may have them, else assumed and said so."""

import math
from pathlib import Path

import pytest

from excite_cli.proposal.assumed_limits import JointPlan, choose_pace, plan_limits
from tests.proposal.robots import GOOD, arm, joint, link, surveyed, written


def planned(folder: Path, limit: str) -> JointPlan:
    return plan_limits(surveyed(arm(folder, limit)).joints)[0]


def test_sensible_limits_are_left_alone(tmp_path: Path) -> None:
    plan = planned(tmp_path, GOOD)
    assert (plan.lower, plan.upper, plan.velocity, plan.effort) == (-2, 2, 3, 50)
    assert plan.notes == {}
    slow = planned(tmp_path, 'lower="-1" upper="1" velocity="0.5" effort="9"')
    assert slow.acceleration == 2.5


@pytest.mark.parametrize("velocity", ["0", "100", "1e4"])
def test_a_speed_that_no_joint_has_is_replaced(tmp_path: Path, velocity: str) -> None:
    plan = planned(tmp_path, f'lower="-2" upper="2" velocity="{velocity}" effort="50"')
    assert plan.velocity == 3.1
    assert "3.1 rad/s assumed" in plan.notes["velocity"]


@pytest.mark.parametrize("effort", ["0", "1000", "1e6"])
def test_a_torque_that_no_joint_has_bounds_nothing(tmp_path: Path, effort: str) -> None:
    plan = planned(tmp_path, f'lower="-2" upper="2" velocity="3" effort="{effort}"')
    assert math.isnan(plan.effort)


@pytest.mark.parametrize(
    "bounds",
    ['lower="0" upper="0"', 'lower="-1e9" upper="1e9"', ""],
)
def test_a_range_that_is_none_is_replaced(tmp_path: Path, bounds: str) -> None:
    plan = planned(tmp_path, f'{bounds} velocity="3" effort="50"')
    assert (plan.lower, plan.upper) == (-3.1, 3.1)
    assert "±3.1 rad assumed" in plan.notes["position"]
    missing = planned(tmp_path, "")
    assert set(missing.notes) == {"position", "velocity"}
    assert "none" in missing.notes["velocity"]


@pytest.mark.parametrize(
    ("bounds", "wanted"),
    [
        ('lower="1" upper="-1"', (-1, 1)),
        ('lower="0" upper="100"', (0, 3.1)),
        ('lower="1" upper="1e9"', (1, 4.1)),
        ('lower="-100" upper="-2"', (-5.1, -2)),
        ('lower="-1" upper="100"', (-1, 3.1)),
    ],
)
def test_a_plan_stays_within_what_is_given(
    tmp_path: Path, bounds: str, wanted: tuple[float, float]
) -> None:
    plan = planned(tmp_path, f'{bounds} velocity="3" effort="50"')
    assert (plan.lower, plan.upper) == pytest.approx(wanted)


def test_a_joint_of_the_other_side_lends_its_limits(tmp_path: Path) -> None:
    path = written(
        tmp_path,
        link("base"),
        joint("left_arm", "base", "a", 'lower="-1" upper="1" velocity="2" effort="30"'),
        link("a"),
        joint("right_arm", "base", "b", 'lower="-1" upper="1" velocity="100" effort="1000"'),
        link("b"),
    )
    right = plan_limits(surveyed(path).joints)[1]
    assert (right.velocity, right.effort) == (2, 30)
    assert right.notes["velocity"].endswith("as left_arm")
    # The slowest joint sets the pace.
    slow = 'lower="-3" upper="3" velocity="0.4" effort="50"'
    quick = choose_pace(plan_limits(surveyed(arm(tmp_path)).joints))
    pace = choose_pace(plan_limits(surveyed(arm(tmp_path, GOOD, slow)).joints))
    assert quick.duration == 10
    assert pace.slowest == "elbow"
    assert 10 < pace.duration <= 20
    assert pace.base_frequency * pace.duration == pytest.approx(2 * math.pi)
