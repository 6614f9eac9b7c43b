"""Harmonics and control points that a config leaves open."""

import numpy as np
import pytest

from excite_cli.config.trajectory_spec import BSplineSpec, FourierSpec
from excite_cli.trajectory.freedom import harmonics_for, with_freedom


def test_more_for_longer_motions_up_to_twelve() -> None:
    counts = [harmonics_for(duration, np.full(6, 10.0)) for duration in (1.0, 5.0, 8.0, 30.0)]
    assert counts == [5, 7, 12, 12]


def test_fewer_where_accelerations_are_small() -> None:
    # At 0.5 rad/s² a motion of 0.05 rad can have 0.5 Hz: five harmonics of ten seconds.
    assert harmonics_for(12.0, np.full(6, 0.5)) == 6
    assert harmonics_for(12.0, np.array([0.5, 0.5, 0.5, 20.0, 20.0])) == 6
    assert harmonics_for(12.0, np.full(6, np.inf)) == 12


def test_fewer_where_many_joints_move() -> None:
    counts = [harmonics_for(10.0, np.full(joints, 10.0)) for joints in (7, 14, 20, 30, 60)]
    assert counts == [12, 12, 10, 7, 5]


def test_what_is_given_stays() -> None:
    assert with_freedom(FourierSpec(harmonics=3), np.ones(2)).harmonics == 3
    spline = BSplineSpec(family="bspline", duration=4.0, control_points=15)
    assert with_freedom(spline, np.ones(2)) == spline


@pytest.mark.parametrize("at_rest", [True, False])
def test_a_spline_is_as_free_as_the_series(at_rest: bool) -> None:
    limits = np.full(6, 10.0)
    spline = BSplineSpec(family="bspline", duration=8.0, at_rest=at_rest)
    found = with_freedom(spline, limits)
    held = 4 if at_rest else 0
    assert found.control_points == 2 * harmonics_for(8.0, limits) + 1 + held
