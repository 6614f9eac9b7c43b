"""What is said of places that the data do not reach: a usual motion, and sizes judged along it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.diagnosis.candidates import Candidate, with_columns
from excite_cli.diagnosis.extrapolation import Reach, UsualMotion, torque_seen
from excite_cli.diagnosis.possible_sizes import PossibleSizes
from excite_cli.diagnosis.training import TrainingData
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.base import Effect, Signals
from excite_cli.effects.catalogue import catalogue
from excite_cli.effects.judgement import Seen
from excite_cli.robot.model import Array, build_robot
from tests.diagnosis.explicit_data import prepared
from tests.effects.motions import signals_at

SAMPLES, STEP = 1000, 0.02
SLOW, FAST = 0.02, 2.0  # rad/s
TORQUE = 3.0  # N·m
ROBOT = build_robot(RobotSpec(urdf="example-robot-data:ur5"))


def crept(fastest: float) -> Signals:
    """Sines of this speed about the middle of every joint's range."""
    t = STEP * np.arange(SAMPLES)
    w = np.linspace(0.7, 1.3, ROBOT.n) * 2.0
    wt = t[:, None] * w
    return signals_at(
        ROBOT, t, fastest / w * np.sin(wt), fastest * np.cos(wt), -fastest * w * np.sin(wt)
    )


def usual(seen: Signals) -> UsualMotion:
    return UsualMotion(ROBOT, standard_parameters(ROBOT), [seen])


def made(
    seen: Signals, effects: Sequence[Effect], tau: Array
) -> tuple[TrainingData, list[Candidate]]:
    run = prepared(np.ones(tau.shape, bool), seen.q, seen.v, tau)
    data = TrainingData((run,), (0,), (np.zeros((*tau.shape, 0)),), (tau,))
    return data, with_columns([(each, 1) for each in effects], [seen], [run])


def kind(name: str, joint: int = 1, **shape: float) -> Effect:
    return catalogue()[name]((joint,), shape)


def test_the_usual_motion_is_smooth_within_the_limits_and_as_fast_as_what_was_seen() -> None:
    s = usual(crept(SLOW)).signals
    lower, upper = ROBOT.limits.ranges()
    assert (s.q >= lower).all()
    assert (s.q <= upper).all()
    assert (np.abs(s.v) <= ROBOT.limits.velocity).all()
    inner = slice(1, -1)
    assert s.rate(s.q)[inner] == pytest.approx(s.v[inner], abs=2e-2)
    assert s.rate(s.v)[inner] == pytest.approx(s.a[inner], abs=1e-1)
    assert np.abs(s.v).max(axis=0).min() > 10 * SLOW
    # It is never slower than what was seen.
    fast = crept(FAST)
    fast = replace(fast, v=np.where(np.arange(ROBOT.n) == 1, 40.0, fast.v))
    width = [np.abs(usual(each).signals.v[:, 1]).max() for each in (fast, crept(0.1))]
    assert width[0] > width[1]


def test_a_spring_of_a_joint_that_crept_is_not_known() -> None:
    """It is 0.15 N·m in the data and would be 20 at the ends; all torque is 3 N·m."""
    seen = crept(SLOW)
    tau = np.full((SAMPLES, ROBOT.n), TORQUE)
    effects = [kind("spring"), kind("viscous_friction"), kind("torque_offset")]
    data, candidates = made(seen, effects, tau)
    assert torque_seen(data) == pytest.approx(np.full(ROBOT.n, TORQUE))
    reach = Reach(candidates, data, usual(seen), always=[1])
    stiff = np.array([20.0, 0.0])
    reason = reach.why_not(0, stiff)
    assert "over the joint's range and speed" in reason
    assert f"all torque {TORQUE:.3g}" in reason
    assert not reach.why_not(0, stiff / 40)  # no more than there is of torque
    assert not reach.why_not(1, np.array([1e3]))  # every robot has it
    assert not reach.why_not(2, np.array([1e3]))  # as large in the data
    assert reach.why_not(0, -stiff)
    large = Seen(np.full(ROBOT.n, 1e9), np.ones(ROBOT.n), 1.0)
    sizes = PossibleSizes(candidates, lambda _, d: d.T @ d, large, (), reach)
    assert "the joint's range and speed" in sizes.why_not(stiff, [0], [0])


def test_what_is_all_but_an_offset_in_the_data_is_not_known() -> None:
    """A spring of 2 N·m/rad over a twentieth of a radian, 2 N·m of it constant."""
    seen = crept(0.05)
    seen = replace(seen, q=seen.q + 1.0)
    names = ("spring", "viscous_friction", "coulomb_friction", "torque_offset", "armature")
    effects = [kind(name) for name in names]
    data, candidates = made(seen, effects, np.full((SAMPLES, ROBOT.n), TORQUE))
    size = np.array([2.0, 0.0])
    assert not Reach(candidates, data, usual(seen), always=[1]).why_not(0, size)
    assert "beside friction and offset" in Reach(
        candidates, data, usual(seen), always=[1, 2, 3, 4]
    ).why_not(0, size)
    # So it is where two of the columns are one, of a joint that never turned round.
    forth = replace(seen, v=np.abs(seen.v) + SLOW)
    data, candidates = made(forth, effects, np.full((SAMPLES, ROBOT.n), TORQUE))
    assert Reach(candidates, data, usual(forth), always=[1, 2, 3, 4]).why_not(0, 2 * size)


def test_a_change_with_time_is_known_from_the_recordings_after_it_alone() -> None:
    """The joint crept when the change had come; it is judged as it is in the last recording."""
    late = replace(crept(SLOW), start=60.0)
    change = kind("friction_change", time_constant=20.0, span=60.0)
    effects = [change, kind("viscous_friction"), kind("coulomb_friction")]
    for seen, known in ((late, False), (replace(crept(FAST), start=60.0), True)):
        data, candidates = made(seen, effects, np.full((SAMPLES, ROBOT.n), TORQUE))
        reach = Reach(candidates, data, usual(seen))
        assert bool(reach.why_not(0, np.array([0.0, 5.0]))) is not known


def test_what_was_seen_over_the_range_or_is_of_some_runs_may_be_any() -> None:
    some = replace(kind("viscous_friction"), runs=("",))
    for fastest, one, size in ((FAST, kind("spring"), [20.0, 0.0]), (SLOW, some, [1e6])):
        seen = crept(fastest)
        data, candidates = made(seen, [one], np.full((SAMPLES, ROBOT.n), TORQUE))
        assert not Reach(candidates, data, usual(seen)).why_not(0, np.array(size))
