"""Surfaces, and the camera that looks at them."""

import numpy as np
import pytest

from excite_cli.view.rays import fitted_camera
from excite_cli.view.surface import (
    Triangles,
    ball_profile,
    box_triangles,
    capsule_triangles,
    cylinder_triangles,
    hull_triangles,
    round_triangles,
    smooth_surface,
    turn_to,
)


def _volume(triangles: Triangles) -> float:
    a, b, c = (triangles.points[triangles.faces[:, k]] for k in range(3))
    return float(np.einsum("kx,kx->k", a, np.cross(b, c)).sum() / 6)


@pytest.mark.parametrize(
    ("triangles", "volume"),
    [
        (box_triangles(np.array([0.1, 0.2, 0.3])), 0.048),
        (cylinder_triangles(0.1, 0.5), np.pi * 0.01),
        (cylinder_triangles(0.1, 0.5, 0.0), np.pi * 0.01 / 3),
        (round_triangles(ball_profile(0.2, 0.0)), 4 / 3 * np.pi * 0.008),
        (
            capsule_triangles(np.array([1.0, 2.0, 3.0]), np.array([1.0, 2.4, 3.3]), 0.1),
            np.pi * 0.01 * 0.5 + 4 / 3 * np.pi * 0.001,
        ),
    ],
)
def test_shapes_have_their_volume_and_face_outwards(triangles: Triangles, volume: float) -> None:
    assert _volume(triangles) == pytest.approx(volume, rel=0.02)
    assert _volume(hull_triangles(triangles.points)) == pytest.approx(volume, rel=0.02)


def test_a_box_keeps_its_edges_sharp() -> None:
    surface = smooth_surface(box_triangles(np.ones(3)))
    assert len(surface.points) == 24  # each corner once for each of its sides
    np.testing.assert_allclose(np.sort(np.abs(surface.normals), axis=1), [[0, 0, 1]] * 24)
    assert (np.einsum("kx,kx->k", surface.points, surface.normals) > 0).all()


def test_a_ball_is_smooth() -> None:
    ball = round_triangles(ball_profile(1.0, 0.0))
    surface = smooth_surface(ball)
    assert np.einsum("kx,kx->k", surface.points, surface.normals).min() > 0.995
    assert len(surface.points) == 48 * 15 + 2
    coarse = smooth_surface(ball, cell=0.3)
    assert len(coarse.faces) < len(ball.faces) / 3, "small detail is dropped"
    assert np.linalg.norm(coarse.points, axis=1).min() > 0.85


def test_triangles_without_area_are_dropped() -> None:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]])
    surface = smooth_surface(Triangles(points, np.array([[0, 1, 2], [0, 1, 3]])))
    assert len(surface.faces) == 1
    np.testing.assert_allclose(surface.normals, [[0, 0, 1]] * 3)
    assert len(smooth_surface(Triangles(points, np.array([[0, 1, 3]]))).faces) == 0
    assert len(hull_triangles(points).faces) == 0


@pytest.mark.parametrize("direction", [[0, 0, 1], [0, 0, -2], [1, 2, 3], [0, 0, 0]])
def test_turn_to(direction: list[float]) -> None:
    turn = turn_to(np.array(direction, dtype=float))
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(turn) == pytest.approx(1.0)
    length = np.linalg.norm(direction)
    if length:
        np.testing.assert_allclose(turn[:, 2], np.array(direction) / length)


POINTS = np.random.default_rng(1).uniform([-1, -0.3, 0], [0.4, 2, 1.5], (60, 3))


@pytest.mark.parametrize("view", [(0.0, 0.0), (35.0, 18.0), (250.0, 80.0), (-70.0, -30.0)])
@pytest.mark.parametrize("size", [(640, 480), (300, 900)])
def test_everything_is_seen_and_fills_the_picture(
    view: tuple[float, float], size: tuple[int, int]
) -> None:
    camera = fitted_camera(POINTS, size, *view, fill=0.9)
    places = camera.project(POINTS)
    spans = np.ptp(places, axis=0) / size
    assert places.min() > 0
    assert (places < size).all()
    assert 0.85 < spans.max() <= 0.91
    np.testing.assert_allclose(
        (places.min(axis=0) + places.max(axis=0)) / 2, np.array(size) / 2, atol=0.02 * max(size)
    )


def test_azimuth_elevation_and_rays() -> None:
    camera = fitted_camera(POINTS, (100, 100), 90, 0)
    assert camera.eye[1] > 2.0  # from +y
    low, high = camera.project(np.array([[0, 0, 0.0], [0, 0, 1.0]]))
    assert high[1] < low[1]  # z is up
    left, right = camera.project(np.array([[0.3, 0, 0.0], [-0.3, 0, 0.0]]))
    assert left[0] < right[0]
    places, towards = camera.project(POINTS), POINTS - camera.eye
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    np.testing.assert_allclose(camera.rays(places[:, 0], places[:, 1]), towards, atol=1e-12)
