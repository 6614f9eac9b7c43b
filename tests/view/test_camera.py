import numpy as np
import pytest

from excite_cli.view.camera import fitted_camera

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


def test_rays_go_through_what_is_projected_there() -> None:
    camera = fitted_camera(POINTS, (640, 480), 35, 18)
    places = camera.project(POINTS)
    towards = POINTS - camera.eye
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    np.testing.assert_allclose(camera.rays(places[:, 0], places[:, 1]), towards, atol=1e-12)


def test_azimuth_and_elevation() -> None:
    camera = fitted_camera(POINTS, (100, 100), 90, 0)
    assert camera.eye[1] > 2.0  # from +y
    low, high = camera.project(np.array([[0, 0, 0.0], [0, 0, 1.0]]))
    assert high[1] < low[1]  # z is up
    left, right = camera.project(np.array([[0.3, 0, 0.0], [-0.3, 0, 0.0]]))
    assert left[0] < right[0]
