"""A slowed motion keeps its share of the limits at every instant, and is no slower than that."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.errors import ConfigError
from excite_cli.excitation.entry import PaceLimits, slowing
from excite_cli.trajectory.base import Trajectory
from excite_cli.trajectory.bspline import BSplineTrajectory
from excite_cli.trajectory.fourier import FourierTrajectory
from excite_cli.trajectory.sampled import SampledTrajectory
from tests.excitation.smoke import smoke

FAMILIES: list[Trajectory] = [
    FourierTrajectory(5, 0.8),
    BSplineTrajectory(6.0, 12),
    SampledTrajectory(np.array([0.0, 0.4, 1.0, 1.3, 2.2])),
]


@given(seed=st.integers(0, 10**6), share=st.floats(0.05, 1.0), which=st.integers(0, 2))
@settings(max_examples=25, deadline=None)
def test_the_share_is_kept_and_reached(seed: int, share: float, which: int) -> None:
    rng = np.random.default_rng(seed)
    family = FAMILIES[which]
    alpha = rng.normal(size=(family.n_coefficients, 3))
    limits = PaceLimits(rng.uniform(0.3, 1.0, (3, 3)) * np.array([[5.0], [20.0], [80.0]]))
    pace = slowing(limits, family, alpha, share)
    slow = family.slowed(pace)
    rates = slow.orders(np.linspace(0.0, slow.duration, 20_001), alpha)[1:]
    used = (np.abs(rates).max(axis=1) / limits.largest).max()
    assert 0 < pace <= 1
    assert used <= share * (1 + 1e-9)
    if pace < 1:
        assert used > 0.999 * share


def test_a_motion_that_is_slow_enough_is_not_sped_up() -> None:
    family = FourierTrajectory(2, 0.1)
    limits = PaceLimits(np.array([[100.0], [np.inf], [np.inf]]))
    assert slowing(limits, family, np.ones((5, 1)), 1.0) == 1.0
    assert slowing(limits, family, np.zeros((5, 1)), 0.5) == 1.0


def test_limits_are_those_of_the_constraints() -> None:
    problem = smoke("constraints.joint_limits={acceleration: 7, velocity: 0.9, jerk: 50}")
    robot = problem.robot
    limits = PaceLimits.of(problem.constraints, robot.n).largest
    assert limits[0] == pytest.approx(np.minimum(robot.limits.velocity, 0.9))
    assert limits[1] == pytest.approx(np.full(robot.n, 7.0))
    assert limits[2] == pytest.approx(np.full(robot.n, 50.0))
    assert np.isinf(PaceLimits.of((), 2).largest).all()


@pytest.mark.parametrize(
    ("share", "limit", "words"),
    [
        *((share, 1.0, r"share of the limits from 0\.001 to 1") for share in (0.0, 1.01, np.nan)),
        (0.5, np.inf, "no limits of speed, acceleration or jerk"),
    ],
)
def test_what_cannot_be_kept(share: float, limit: float, words: str) -> None:
    limits = PaceLimits(np.full((3, 1), limit))
    with pytest.raises(ConfigError, match=words):
        slowing(limits, FourierTrajectory(2, 1.0), np.ones((5, 1)), share)
