"""Both families: exact derivatives, pull-back, rest, constants, and the bound between samples."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.config.trajectory_spec import BSplineSpec, FourierSpec
from excite_cli.excitation.gradient_check import central_differences, relative_error
from excite_cli.trajectory.base import Trajectory, harmonics_for, with_freedom
from excite_cli.trajectory.bspline import BSplineTrajectory
from excite_cli.trajectory.fourier import FourierTrajectory

FAMILIES: list[Trajectory] = [
    FourierTrajectory(harmonics=4, base_frequency=0.9),
    FourierTrajectory(harmonics=5, base_frequency=1.3, at_rest=True),
    BSplineTrajectory(duration=6.0, control_points=12, degree=5, at_rest=True),
    BSplineTrajectory(duration=4.0, control_points=9, degree=4, at_rest=False),
]


@pytest.mark.parametrize("family", FAMILIES, ids=repr)
def test_velocity_acceleration_and_jerk_are_derivatives_of_position(family: Trajectory) -> None:
    times = np.linspace(0.03, 0.97, 31) * family.duration
    h = 1e-4
    after, at, before = (family.basis(times + shift) for shift in (h, 0.0, -h))
    assert relative_error(at.velocity, (after.position - before.position) / (2 * h)) < 1e-6
    assert relative_error(at.acceleration, (after.velocity - before.velocity) / (2 * h)) < 1e-6
    assert relative_error(at.jerk, (after.acceleration - before.acceleration) / (2 * h)) < 1e-5


@pytest.mark.parametrize("family", FAMILIES, ids=repr)
def test_pull_back_is_the_transpose_of_the_states(family: Trajectory) -> None:
    rng = np.random.default_rng(3)
    basis = family.basis(np.linspace(0, family.duration, 17))
    weights = rng.normal(size=(3, 17, 2))
    alpha = rng.normal(size=(family.n_coefficients, 2))

    def cost(coefficients: np.ndarray) -> float:
        return sum(
            float((w * x).sum()) for w, x in zip(weights, basis.states(coefficients), strict=True)
        )

    found = basis.pull_back(*weights)
    assert relative_error(found, central_differences(cost, alpha)) < 1e-8


@pytest.mark.parametrize("family", FAMILIES, ids=repr)
def test_free_directions_are_orthonormal_and_keep_rest(family: Trajectory) -> None:
    free = family.free_directions
    assert np.allclose(free.T @ free, np.eye(free.shape[1]))
    ends = family.basis(np.array([0.0, family.duration]))
    if family.at_rest:
        assert free.shape[1] < family.n_coefficients
        scale = np.abs(family.basis(np.linspace(0, family.duration, 50)).acceleration).max()
        assert np.abs(ends.velocity @ free).max() < 1e-9 * scale
        assert np.abs(ends.acceleration @ free).max() < 1e-9 * scale
    else:
        assert free.shape[1] == family.n_coefficients
        assert np.abs(ends.velocity).max() > 0.1


@pytest.mark.parametrize("family", FAMILIES, ids=repr)
def test_constant_stands_still_within_the_free_directions(family: Trajectory) -> None:
    q = np.array([0.3, -1.2, 2.0])
    alpha = family.constant(q)
    position, velocity, acceleration = family.basis(np.linspace(0, family.duration, 23)).states(
        alpha
    )
    assert np.allclose(position, q)
    assert np.abs(velocity).max() < 1e-12
    assert np.abs(acceleration).max() < 1e-11
    free = family.free_directions
    assert np.allclose(free @ (free.T @ alpha), alpha)


@settings(max_examples=40, derandomize=True, deadline=None)
@given(
    harmonics=st.integers(1, 12),
    extra=st.integers(1, 60),
    seed=st.integers(0, 10_000),
)
def test_sampling_factor_bounds_what_lies_between_the_samples(
    harmonics: int, extra: int, seed: int
) -> None:
    family = FourierTrajectory(harmonics, base_frequency=0.7)
    samples = 2 * harmonics + extra
    step = family.duration / samples
    factor = family.sampling_factor(samples, step)
    assert factor is not None
    alpha = np.random.default_rng(seed).normal(size=(family.n_coefficients, 1))
    grid = family.basis(np.arange(samples) * step).position @ alpha
    fine = family.basis(np.linspace(0, family.duration, 20 * samples)).position @ alpha
    assert np.abs(fine).max() <= np.abs(grid).max() / factor * (1 + 1e-9)


def test_sampling_factor_needs_a_whole_period_and_enough_samples() -> None:
    family = FourierTrajectory(harmonics=10, base_frequency=np.pi / 4)
    assert family.sampling_factor(400, 0.02) == pytest.approx(np.cos(np.pi * 10 / 400))
    assert family.sampling_factor(400, 0.019) is None
    assert family.sampling_factor(20, 0.4) is None
    assert FAMILIES[2].sampling_factor(400, 0.015) is None


def test_fourier_is_equation_50() -> None:
    family = FourierTrajectory(harmonics=2, base_frequency=0.5)
    a1, a2, b1, b2, q0 = alpha = np.array([0.3, -0.2, 0.5, 0.1, 0.7])
    t = 1.234
    expected = (
        a1 * np.sin(0.5 * t) + a2 * np.sin(1.0 * t) + b1 * np.cos(0.5 * t) + b2 * np.cos(t) + q0
    )
    assert family.basis(np.array([t])).position @ alpha == pytest.approx(expected)


def test_harmonics_grow_with_time_and_fall_with_joints_and_small_accelerations() -> None:
    counts = [harmonics_for(duration, np.full(6, 10.0)) for duration in (1.0, 5.0, 8.0, 30.0)]
    assert counts == [5, 7, 12, 12]
    counts = [harmonics_for(10.0, np.full(joints, 10.0)) for joints in (7, 14, 20, 30, 60)]
    assert counts == [12, 12, 10, 7, 5]
    # At 0.5 rad/s² a motion of 0.05 rad can have 0.5 Hz: five harmonics of ten seconds.
    assert harmonics_for(12.0, np.full(6, 0.5)) == 6
    assert harmonics_for(12.0, np.array([0.5, 0.5, 0.5, 20.0, 20.0])) == 6
    assert harmonics_for(12.0, np.full(6, np.inf)) == 12


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
