"""Polynomials from state to state, fading motions: exact ends, exact derivatives, and joints."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.trajectory.base import Array, Trajectory
from excite_cli.trajectory.fade import Chain, Fade, Segment
from excite_cli.trajectory.fourier import FourierTrajectory
from excite_cli.trajectory.point_to_point import PointToPoint, at_rest_between

MOTION = FourierTrajectory(harmonics=3, base_frequency=1.1)
PIECES: list[Trajectory] = [PointToPoint(2.7), Fade(MOTION, 1), Fade(MOTION, 2, out=True)]


def _state(trajectory: Trajectory, coefficients: Array, time: float) -> Array:
    return np.array(trajectory.states(np.array([time]), coefficients))[:, 0]


@settings(max_examples=60, derandomize=True, deadline=None)
@given(seed=st.integers(0, 10_000), duration=st.floats(0.05, 60.0))
def test_a_polynomial_has_the_states_it_was_given(seed: int, duration: float) -> None:
    ends = np.random.default_rng(seed).normal(size=(6, 3))
    trajectory = PointToPoint(duration)
    assert np.allclose(_state(trajectory, ends, 0.0), ends[:3], atol=1e-9)
    assert np.allclose(_state(trajectory, ends, duration), ends[3:], atol=1e-9)


def test_from_rest_to_rest_it_is_the_well_known_one() -> None:
    start, end = np.array([0.3, -1.0]), np.array([1.1, 0.5])
    times = np.linspace(0.0, 3.0, 50)
    q, v, a = PointToPoint(3.0).states(times, at_rest_between(start, end))
    s = times[:, None] / 3.0
    assert np.allclose(q, start + (10 * s**3 - 15 * s**4 + 6 * s**5) * (end - start))
    assert np.abs(v[:, 0]).max() == pytest.approx(15 / 8 * 0.8 / 3.0, rel=1e-2)
    assert np.abs(a[:, 0]).max() <= 10 / np.sqrt(3) * 0.8 / 9.0 + 1e-12
    assert np.abs(v[[0, -1]]).max() < 1e-12
    assert np.abs(a[[0, -1]]).max() < 1e-12


@pytest.mark.parametrize("piece", PIECES, ids=repr)
def test_every_order_is_the_derivative_of_the_one_before(piece: Trajectory) -> None:
    times = np.linspace(0.02, 0.98, 41) * piece.duration
    h = 1e-5
    for order in range(piece.smooth_orders):
        slope = (piece.derivative(times + h, order) - piece.derivative(times - h, order)) / (2 * h)
        found = piece.derivative(times, order + 1)
        assert np.abs(found - slope).max() < 1e-6 * max(1.0, np.abs(found).max())
    basis = piece.basis(times)
    for order, rows in enumerate((basis.position, basis.velocity, basis.acceleration)):
        assert np.allclose(rows, piece.derivative(times, order))


@pytest.mark.parametrize("piece", PIECES, ids=repr)
def test_what_lies_beyond_the_derivatives_is_bounded(piece: Trajectory) -> None:
    coefficients = np.random.default_rng(5).normal(size=(piece.n_coefficients, 2))
    times, h = np.linspace(0.01, 0.99, 2000) * piece.duration, 1e-4
    order = piece.smooth_orders
    after, before = (piece.derivative(times + d, order) @ coefficients for d in (h, -h))
    sixth = np.abs(after - before).max(axis=0) / (2 * h)
    bound = piece.beyond(coefficients)
    assert np.all(sixth <= bound * (1 + 1e-6) + 1e-5)
    assert np.all(bound <= 100 * sixth + 1e-5)


@pytest.mark.parametrize("piece", PIECES, ids=repr)
def test_constants_stand_still(piece: Trajectory) -> None:
    posture = np.array([0.4, -2.0])
    q, v, a = piece.states(np.linspace(0, piece.duration, 30), piece.constant(posture))
    assert np.allclose(q, posture)
    assert max(np.abs(v).max(), np.abs(a).max()) < 1e-12


def test_a_motion_swells_from_rest_and_dies_away_without_a_jump() -> None:
    rng = np.random.default_rng(2)
    alpha, posture = rng.normal(size=(MOTION.n_coefficients, 3)), rng.normal(size=3)
    faded = np.vstack([alpha, posture])
    chain = Chain(
        (
            Segment("entry", Fade(MOTION, 2), faded),
            Segment("motion", MOTION, alpha),
            Segment("return", Fade(MOTION, 1, out=True), faded),
        )
    )
    for joint in chain.starts[1:-1]:
        before, after = (np.array(chain.states(np.array([joint + d])))[:, 0] for d in (-1e-13, 0.0))
        assert np.abs(after - before).max() < 1e-9
    for time in (0.0, chain.duration):
        q, v, a = (part[0] for part in chain.states(np.array([time])))
        assert np.allclose(q, posture)
        assert max(np.abs(v).max(), np.abs(a).max()) < 1e-9
    times = np.linspace(0.0, chain.duration, 20_001)
    q, v, a = chain.states(times)
    assert np.abs(np.gradient(q, times, axis=0)[1:-1] - v[1:-1]).max() < 1e-3
    assert np.abs(np.gradient(v, times, axis=0)[1:-1] - a[1:-1]).max() < 1e-2
