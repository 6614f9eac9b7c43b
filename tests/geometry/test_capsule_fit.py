import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.geometry.capsule_fit import (
    capsule_volume,
    hull_points,
    minimum_volume_capsule,
    quick_capsule_volume,
)


def outside(points: np.ndarray, start: np.ndarray, end: np.ndarray, radius: float) -> float:
    """How far the farthest point lies outside the capsule."""
    along = end - start
    share = np.clip((points - start) @ along / max(along @ along, 1e-30), 0, 1)
    gaps = np.linalg.norm(points - start - share[:, None] * along, axis=1)
    return float(gaps.max() - radius)


def sphere(rng: np.random.Generator, count: int) -> np.ndarray:
    points = rng.normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1), st.integers(1, 80), st.integers(0, 3))
def test_contains_every_point(seed: int, count: int, flat_axes: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-3, 1)
    points[:, :flat_axes] = 0.3  # down to a line and a single point
    start, end, radius = minimum_volume_capsule(points)
    assert outside(points, start, end, radius) < 1e-9


@settings(max_examples=6, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1))
def test_recovers_the_capsule_that_points_came_from(seed: int) -> None:
    rng = np.random.default_rng(seed)
    axis, radius, length = sphere(rng, 1)[0], 0.1, rng.uniform(0.1, 0.5)
    ball = radius * sphere(rng, 1500)
    points = np.vstack([ball, ball + length * axis])
    start, end, fitted = minimum_volume_capsule(points)
    true = capsule_volume(np.zeros(3), length * axis, radius)
    assert capsule_volume(start, end, fitted) <= true * (1 + 1e-6)
    assert fitted == pytest.approx(radius, rel=0.03)
    assert abs((end - start) @ axis) == pytest.approx(length, rel=0.03)


def test_a_ball_gives_a_sphere() -> None:
    points = 0.2 * sphere(np.random.default_rng(1), 800) + [1.0, 2.0, 3.0]
    start, end, radius = minimum_volume_capsule(points)
    assert radius == pytest.approx(0.2, abs=1e-3)
    np.testing.assert_allclose(start, end, atol=5e-3)
    np.testing.assert_allclose(start, [1.0, 2.0, 3.0], atol=5e-3)


def test_a_long_box_is_fitted_as_small_as_by_hand() -> None:
    points = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.1, 0.1) for z in (-0.1, 0.1)])
    start, end, radius = minimum_volume_capsule(points)
    by_hand = capsule_volume(np.zeros(3), np.array([1.0, 0, 0]), np.hypot(0.1, 0.1))
    assert capsule_volume(start, end, radius) <= by_hand * (1 + 1e-6)
    assert abs(end - start)[0] > 0.9
    assert abs(end - start)[1:].max() < 1e-3


def test_does_not_depend_on_the_frame() -> None:
    rng = np.random.default_rng(5)
    points = rng.normal(size=(100, 3)) * [0.05, 0.1, 0.3]
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    plain = capsule_volume(*minimum_volume_capsule(points))
    turned = capsule_volume(*minimum_volume_capsule(points @ turn.T + 4.0))
    assert turned == pytest.approx(plain, rel=1e-3)


def test_one_point() -> None:
    start, end, radius = minimum_volume_capsule(np.array([[1.0, 2.0, 3.0]]))
    np.testing.assert_array_equal(start, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(end, start)
    assert radius < 1e-9


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.array([[0.0, np.nan, 0.0]])])
def test_refuses_no_or_infinite_points(points: np.ndarray) -> None:
    with pytest.raises(ValueError, match="at least one point"):
        minimum_volume_capsule(points)


def test_hull_points_keep_the_extremes_of_flat_clouds() -> None:
    rng = np.random.default_rng(0)
    flat = np.column_stack([rng.normal(size=(60, 2)), np.full(60, 0.5)]) @ sphere(rng, 3).T
    for direction in sphere(rng, 20):
        assert (hull_points(flat) @ direction).max() == pytest.approx((flat @ direction).max())
    line = np.outer(np.linspace(0, 1, 9), [1.0, 2.0, 3.0])
    assert len(hull_points(line)) == 2


def test_quick_volume_is_near_the_refined_one() -> None:
    points = np.random.default_rng(3).normal(size=(300, 3)) * [0.1, 0.1, 0.4]
    refined = capsule_volume(*minimum_volume_capsule(points))
    assert 0.9 * refined < quick_capsule_volume(points) < 1.4 * refined
