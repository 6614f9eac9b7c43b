"""Motions through samples: exact on polynomials, cheap for many knots, slowed without error."""

import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import make_interp_spline

from excite_cli.trajectory.base import Trajectory
from excite_cli.trajectory.bspline import BSplineTrajectory
from excite_cli.trajectory.fade import Chain, Segment
from excite_cli.trajectory.fourier import FourierTrajectory
from excite_cli.trajectory.point_to_point import Slowed
from excite_cli.trajectory.sampled import SampledTrajectory, through_samples

Array = np.ndarray


def _knots(rng: np.random.Generator, count: int) -> Array:
    return 3.0 + np.cumsum(rng.uniform(0.01, 0.4, size=count))


@given(seed=st.integers(0, 10**6), count=st.integers(2, 9), joints=st.integers(1, 4))
@settings(max_examples=40, deadline=None)
def test_one_quintic_is_reproduced_with_all_its_derivatives(
    seed: int, count: int, joints: int
) -> None:
    rng = np.random.default_rng(seed)
    t = _knots(rng, count)
    each = [np.polynomial.Polynomial(rng.normal(size=6)) for _ in range(joints)]

    def at(times: Array, order: int) -> Array:
        return np.column_stack([p.deriv(order)(times) if order else p(times) for p in each])

    family, alpha = through_samples(t, *(at(t, order) for order in range(3)))
    times = np.append(rng.uniform(0.0, family.duration, 20), [0.0, family.duration])
    found = family.derivatives(times, alpha)
    for order in range(6):
        wanted = at(times + t[0], order)
        # The highest derivatives are made of small differences over short intervals.
        tolerance = 1e-12 * 10.0 ** (2.5 * order) * max(1.0, np.abs(at(t, 0)).max())
        assert found[order] == pytest.approx(wanted, rel=1e-6, abs=tolerance)
    states = family.states(times, alpha)
    assert all(np.array_equal(x, y) for x, y in zip(states, found[:3], strict=True))


@given(seed=st.integers(0, 10**6), count=st.integers(2, 12))
@settings(max_examples=30, deadline=None)
def test_the_dense_basis_says_the_same(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    family = SampledTrajectory(np.append(0.0, np.cumsum(rng.uniform(0.1, 1, count - 1))), pace=0.7)
    alpha = rng.normal(size=(family.n_coefficients, 3))
    times = np.sort(np.append(rng.uniform(0.0, family.duration, 12), family.breaks))
    dense, sparse = family.basis(times).states(alpha), family.states(times, alpha)
    for one, other in zip(dense, sparse, strict=True):
        assert one == pytest.approx(other, rel=1e-9, abs=1e-9 * np.abs(other).max())
    last = family.derivatives(times, alpha)
    for order in range(6):
        found = family.derivative(times, order) @ alpha
        assert found == pytest.approx(last[order], rel=1e-8, abs=1e-9 * np.abs(last[order]).max())


def test_positions_alone_give_the_quintic_spline() -> None:
    rng = np.random.default_rng(1)
    t = _knots(rng, 40)
    q = np.cumsum(rng.normal(size=(40, 2)), axis=0)
    family, alpha = through_samples(t, q)
    spline = make_interp_spline(t - t[0], q, k=5)
    times = np.linspace(0.0, family.duration, 333)
    for order, found in enumerate(family.states(times, alpha)):
        wanted = spline(times, order)
        assert found == pytest.approx(wanted, rel=1e-7, abs=1e-8 * np.abs(wanted).max())
    assert family.states(family.knots, alpha)[0] == pytest.approx(q, abs=1e-12)


@pytest.mark.parametrize("given_too", [False, True])
def test_a_fourier_series_comes_back_from_its_samples(given_too: bool) -> None:
    series = FourierTrajectory(5, 0.8)
    alpha = np.random.default_rng(4).normal(size=(11, 3))
    t = np.append(np.arange(0.0, series.duration, 0.01), series.duration)
    q, v, _ = series.states(t, alpha)
    family, coefficients = through_samples(t, q, v if given_too else None)
    times = np.linspace(0.0, series.duration, 1777)
    errors = [
        np.abs(x - y).max()
        for x, y in zip(
            family.states(times, coefficients), series.states(times, alpha), strict=True
        )
    ]
    assert errors[0] < 1e-8
    assert errors[1] < 1e-6
    assert errors[2] < 1e-4


@pytest.mark.parametrize("count", [2, 3, 4, 5])
def test_few_samples_give_the_polynomial_through_them(count: int) -> None:
    t, q = np.arange(count, dtype=float), np.random.default_rng(2).normal(size=(count, 2))
    family, alpha = through_samples(t, q)
    times = np.linspace(0.0, count - 1.0, 21)
    found = family.states(times, alpha)[0]
    for j in range(2):
        wanted = np.polynomial.Polynomial.fit(t, q[:, j], count - 1)(times)
        assert found[:, j] == pytest.approx(wanted, abs=1e-9)
    chain = Chain((Segment("a", family, alpha), Segment("b", family, alpha)))
    in_chain = chain.states(times[:-1] + family.duration)[0]
    assert in_chain == pytest.approx(found[:-1], abs=1e-9), "samples have their place in a chain"


def test_ten_thousand_knots_take_little_memory() -> None:
    t = np.arange(10_001) / 1000
    q = np.sin(np.outer(t, np.arange(1, 15)))
    tracemalloc.start()
    family, alpha = through_samples(t, q)
    family.states(np.linspace(0.0, 10.0, 8000), alpha)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert family.n_coefficients == 30_003
    assert peak < 100e6  # a dense basis would take 2 GB for each derivative


FAMILIES: list[Trajectory] = [
    FourierTrajectory(4, 0.9, at_rest=True),
    BSplineTrajectory(5.0, 12),
    SampledTrajectory(np.array([0.0, 0.3, 1.1, 1.7])),
    Slowed(FourierTrajectory(3, 1.1), 0.9),
]


@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: type(family).__name__)
def test_slowed_is_the_same_path_later_with_the_same_coefficients(family: Trajectory) -> None:
    alpha = np.random.default_rng(5).normal(size=(family.n_coefficients, 2))
    pace = 0.37
    slow = family.slowed(pace)
    wrapped = Slowed(family, pace)
    assert type(slow) is type(family)
    assert slow.n_coefficients == family.n_coefficients
    assert slow.duration == pytest.approx(family.duration / pace)
    assert slow.at_rest == family.at_rest
    assert slow.breaks == pytest.approx(family.breaks / pace)
    times = np.linspace(0.0, family.duration, 41)
    before, after = family.derivatives(times, alpha), slow.derivatives(times / pace, alpha)
    for order, (one, other) in enumerate(zip(before[:4], after[:4], strict=True)):
        assert other == pytest.approx(one * pace**order, rel=1e-9, abs=1e-9)
    for one, other in zip(slow.orders(times / pace, alpha), after, strict=False):
        assert one == pytest.approx(other, rel=1e-9, abs=1e-9)
    for one, other in zip(wrapped.orders(times / pace, alpha), after, strict=False):
        assert one == pytest.approx(other, rel=1e-9, abs=1e-9)
    again = slow.slowed(1 / pace)
    assert again.states(times, alpha)[2] == pytest.approx(before[2], rel=1e-9, abs=1e-9)
    assert slow.beyond(alpha) == pytest.approx(
        family.beyond(alpha) * pace ** (family.smooth_orders + 1)
    )
