"""Enclosed states hold at every instant of their intervals, for every family."""

import numpy as np
import pytest

from excite_cli.proof.enclosed_trajectory import enclosed_states, intervals_of
from excite_cli.trajectory.base import Trajectory
from excite_cli.trajectory.bspline import BSplineTrajectory
from excite_cli.trajectory.fourier import FourierTrajectory

FAMILIES = [
    FourierTrajectory(6, 0.9),
    FourierTrajectory(1, 3.0),
    BSplineTrajectory(3.0, 12, 5),
    BSplineTrajectory(2.0, 9, 3),
    BSplineTrajectory(2.0, 14, 8),
]


@pytest.mark.parametrize("family", FAMILIES, ids=str)
@pytest.mark.parametrize("width", [0.3, 0.02])
def test_states_lie_within(family: Trajectory, width: float) -> None:
    rng = np.random.default_rng(4)
    coefficients = rng.normal(size=(family.n_coefficients, 3))
    intervals = intervals_of(family, width)
    found = enclosed_states(family, coefficients, intervals)
    for s in np.linspace(-1, 1, 17):
        times = intervals.middles + s * intervals.halves
        actual = family.basis(times).states(coefficients)
        for enclosed, value in zip((found.q, found.v, found.a), actual, strict=True):
            assert np.all(np.abs(value - enclosed.at(s)) <= enclosed.radius + 1e-9)
    ends = np.sort(np.concatenate([intervals.middles - intervals.halves, [family.duration]]))
    assert ends[0] == pytest.approx(0.0, abs=1e-12)
    assert np.all(intervals.halves <= width / 2 + 1e-12)
    assert intervals.halves.sum() * 2 == pytest.approx(family.duration)


@pytest.mark.parametrize("family", FAMILIES, ids=str)
def test_enclosures_are_narrow(family: Trajectory) -> None:
    rng = np.random.default_rng(5)
    coefficients = rng.normal(size=(family.n_coefficients, 2))
    wide, narrow = (
        enclosed_states(family, coefficients, intervals_of(family, width)).q.radius.max()
        for width in (0.02, 0.01)
    )
    assert narrow < 1e-2
    assert wide / narrow > 6.0


@pytest.mark.parametrize("family", FAMILIES, ids=str)
def test_derivatives_are_those_of_the_basis(family: Trajectory) -> None:
    rng = np.random.default_rng(6)
    coefficients = rng.normal(size=(family.n_coefficients, 2))
    times = np.linspace(0.0513, family.duration - 0.0613, 7)  # none at a knot
    states = family.basis(times).states(coefficients)
    derivatives = family.derivatives(times, coefficients)
    for order, state in enumerate(states):
        np.testing.assert_allclose(derivatives[order], state, atol=1e-9)
    step = 1e-6
    for order in range(2, family.smooth_orders):
        later, earlier = (family.derivative(times + d, order) @ coefficients for d in (step, -step))
        np.testing.assert_allclose(
            (later - earlier) / (2 * step),
            derivatives[order + 1],
            rtol=1e-4,
            atol=1e-4 * np.abs(derivatives[order + 1]).max() + 1e-6,
        )


def test_halves_cover_the_same_time() -> None:
    intervals = intervals_of(FAMILIES[0], 0.5)
    halved = intervals.halved()
    assert len(halved) == 2 * len(intervals)
    assert halved.halves.sum() == pytest.approx(intervals.halves.sum())
    starts = np.sort(halved.middles - halved.halves)
    np.testing.assert_allclose(starts[::2], np.sort(intervals.middles - intervals.halves))
