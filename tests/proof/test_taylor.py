"""Enclosures, and states of trajectories, hold at every instant and are as narrow as can be."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.proof.enclosed_motion import enclosed_states, intervals_of
from excite_cli.proof.taylor import (
    Taylor,
    applied,
    cross,
    dot,
    joined,
    matmul,
    sine_and_cosine,
    stacked,
    transposed,
)
from excite_cli.trajectory.base import Trajectory
from excite_cli.trajectory.bspline import BSplineTrajectory
from excite_cli.trajectory.fourier import FourierTrajectory

INSIDE = np.linspace(-1.0, 1.0, 41)
ROUNDING = 1e-12


def random_model(rng: np.random.Generator, *shape: int, spread: float = 1.0) -> Taylor:
    sizes = np.array([1.0, spread, spread**2]).reshape(3, *([1] * len(shape)))
    terms = rng.normal(size=(3, *shape)) * sizes
    return Taylor(terms, spread**3 * rng.uniform(0, 1, shape))


def member(model: Taylor, rng: np.random.Generator) -> Callable[[float], np.ndarray]:
    """A function that the model encloses: its error moves about within the radius."""
    error, rate = rng.uniform(-1, 1, model.shape), rng.uniform(1, 9)
    return lambda s: model.at(s) + model.radius * error * np.cos(rate * s)


def assert_encloses(model: Taylor, values: Callable[[float], np.ndarray]) -> None:
    for s in INSIDE:
        off = np.abs(values(s) - model.at(s)) - model.radius
        assert off.max() <= ROUNDING
        assert np.all(values(s) >= model.lower() - ROUNDING)
        assert np.all(values(s) <= model.upper() + ROUNDING)
        assert np.all(np.abs(values(s)) <= model.size + ROUNDING)
        assert np.all(np.abs(values(s) - model.center) <= model.reach + ROUNDING)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([0.01, 0.3, 2.0]))
def test_arithmetic_encloses(seed: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    a, b = (random_model(rng, 4, 3, 3, spread=spread) for _ in range(2))
    x, y = (random_model(rng, 4, 3, spread=spread) for _ in range(2))
    known = rng.normal(size=(5, 3))
    fa, fb, fx, fy = (member(model, rng) for model in (a, b, x, y))
    cases = [
        (a + b, lambda s: fa(s) + fb(s)),
        (a - b, lambda s: fa(s) - fb(s)),
        (-a, lambda s: -fa(s)),
        (a + 2.5, lambda s: fa(s) + 2.5),
        (a - known[0], lambda s: fa(s) - known[0]),
        (a.times(b), lambda s: fa(s) * fb(s)),
        (a.scaled(-3.0), lambda s: -3.0 * fa(s)),
        (matmul(a, b), lambda s: fa(s) @ fb(s)),
        (applied(a, x), lambda s: (fa(s) @ fx(s)[..., None])[..., 0]),
        (cross(x, y), lambda s: np.cross(fx(s), fy(s))),
        (dot(x, y), lambda s: (fx(s) * fy(s)).sum(-1)),
        (x.through(known), lambda s: fx(s) @ known.T),
        (x.summed(-1), lambda s: fx(s).sum(-1)),
        (transposed(a), lambda s: fa(s).swapaxes(-1, -2)),
        (a[:, 1], lambda s: fa(s)[:, 1]),
        (stacked([x, y]), lambda s: np.stack([fx(s), fy(s)], axis=-1)),
        (joined([x, y]), lambda s: np.concatenate([fx(s), fy(s)], axis=-1)),
    ]
    for model, values in cases:
        assert_encloses(model, values)
    for model, values in zip(sine_and_cosine(x), (np.sin, np.cos), strict=True):
        assert_encloses(model, lambda s, values=values: values(fx(s)))


def test_bounds_of_a_parabola_are_exact() -> None:
    inside = Taylor(np.array([1.0, 0.5, 1.0]).reshape(3, 1), np.zeros(1))
    assert inside.lower() == pytest.approx(1.0 - 0.0625)
    assert inside.upper() == pytest.approx(2.5)
    outside = Taylor(np.array([1.0, -3.0, 1.0]).reshape(3, 1), np.array([0.25]))
    assert outside.lower() == pytest.approx(1.0 + 1.0 - 3.0 - 0.25)
    assert outside.upper() == pytest.approx(5.0 + 0.25)


def test_radius_falls_with_the_third_power() -> None:
    """A product of sines over shorter and shorter intervals."""
    widths = []
    for h in (0.2, 0.1, 0.05):
        x = Taylor(np.array([0.7, h, 0.0]).reshape(3, 1), np.zeros(1))
        sine, cosine = sine_and_cosine(x)
        widths.append(float(sine.times(cosine).radius[0]))
    assert widths[0] / widths[1] == pytest.approx(8.0, rel=0.25)
    assert widths[1] / widths[2] == pytest.approx(8.0, rel=0.15)


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
        # At a knot the jerk of a cubic spline jumps to that of what follows.
        last = 4 if abs(s) < 1 else 3
        for order, value in enumerate(family.orders(times, coefficients)[:last]):
            enclosed = found.order(order)
            close = 1e-9 * max(1.0, float(np.abs(value).max()))
            assert np.all(np.abs(value - enclosed.at(s)) <= enclosed.radius + close)
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
