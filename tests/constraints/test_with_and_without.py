"""With a constraint its limit holds at 1 kHz; without it the same problem breaks it."""

import pytest

from excite_cli.excitation.admissible import worst_margins
from excite_cli.excitation.problem import Problem
from tests.excitation.smoke import one_motion, smoke

COMMON = ("optimizer.max_iterations=60", "sequence.motions=1")
# Limits tight enough to matter, by the name of the margin they keep.
LIMITS = {
    "joint_position": ("constraints.joint_limits.position", "true", "false"),
    "joint_velocity": ("constraints.joint_limits.velocity", "1.2", "false"),
    "joint_acceleration": ("constraints.joint_limits.acceleration", "4.0", "null"),
    "joint_jerk": ("constraints.joint_limits.jerk", "10.0", "null"),
    "joint_torque": ("constraints.torque", "{scale: 0.25}", "null"),
    "balance": ("constraints.balance", "{kind: disc, radius: 0.02}", "null"),
    "self_collision": ("constraints.self_collision", "{margin: 0.02}", "null"),
}


def _problem(*settings: str) -> Problem:
    return smoke(*COMMON, *settings)


@pytest.mark.long
@pytest.mark.parametrize("name", LIMITS)
def test_with_it_the_limit_holds_and_without_it_it_is_broken(name: str) -> None:
    """At the controller's rate."""
    key, on, off = LIMITS[name]
    judge, free = _problem(f"{key}={on}"), _problem(f"{key}={off}")
    margins = worst_margins(judge, one_motion(judge).coefficients)
    assert name in margins
    for worst in margins.values():
        assert worst.margin >= 0
        assert worst.violations == 0
    assert name not in {constraint.name for constraint in free.constraints}
    assert worst_margins(judge, one_motion(free).coefficients)[name].margin < 0


def test_with_a_motor_curve_it_holds_and_without_it_is_broken() -> None:
    """Torque that falls with speed; at no speed there is as much as without the curve."""
    judge = _problem("robot.limits={shoulder_pitch: {effort_by_speed: [[0, 72], [2.5, 4]]}}")
    margins = worst_margins(judge, one_motion(judge).coefficients)
    assert all(worst.violations == 0 for worst in margins.values())
    free = one_motion(_problem("robot.limits={shoulder_pitch: {effort: 72}}"))
    broken = worst_margins(judge, free.coefficients)["joint_torque"]
    assert broken.margin < 0
    assert broken.label.startswith("shoulder_pitch")


def test_with_a_pace_it_is_slower_and_without_it_is_not() -> None:
    limits = "constraints.joint_limits={acceleration: 10, pace: %s}"
    judge, free = _problem(limits % 0.4), _problem(limits % 1.0)
    margins = worst_margins(judge, one_motion(judge).coefficients)
    assert all(worst.violations == 0 for worst in margins.values())
    broken = worst_margins(judge, one_motion(free).coefficients)
    assert broken["joint_velocity"].margin < 0
    assert broken["joint_acceleration"].margin < 0


def test_a_limit_of_zero_range_between_samples_is_mended() -> None:
    """A coarse grid misses what happens between its instants; the result still holds."""
    problem = _problem(
        "sampling.constraints={samples: 30, step: 0.2}", "constraints.self_collision.margin=0.03"
    )
    motion = one_motion(problem)
    assert all(w.margin >= 0 for w in worst_margins(problem, motion.coefficients, 2000.0).values())


def test_constraints_are_built_in_the_order_of_the_table() -> None:
    names = [constraint.name for constraint in _problem().constraints]
    assert names == [n for n in LIMITS if n not in {"joint_jerk", "balance"}]
