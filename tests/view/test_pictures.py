import io
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from excite_cli.excitation.problem import Problem
from excite_cli.trajectory.fade import Segment
from excite_cli.view import pictures
from excite_cli.view.instants import instants_of
from excite_cli.view.pictures import View, motion_gif, still_png
from excite_cli.view.rays import fitted_camera
from excite_cli.view.scene import build_scene
from excite_cli.view.studio import QUICK, Studio
from excite_cli.workers.base import Workers
from excite_cli.workers.context import open_workers

pytest.importorskip("embreex")
Image = pytest.importorskip("PIL.Image")
SMALL = View(size=(96, 72), caption=False, capsules=False, distance=False, mass=False)


def _pixels(content: bytes) -> np.ndarray:
    image = Image.open(io.BytesIO(content))
    assert image.format == "PNG"
    return np.asarray(image.convert("RGB")).astype(float)


@pytest.fixture(scope="module", autouse=True)
def _quickly() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pictures, "FINE", QUICK)
        yield


@pytest.fixture(scope="module")
def plain(problem: Problem, segment: Segment) -> bytes:
    return still_png(problem, segment, SMALL, time=1.0)


def test_the_robot_is_in_the_picture(plain: bytes) -> None:
    pixels = _pixels(plain)
    assert pixels.shape == (72, 96, 3)
    np.testing.assert_array_equal(pixels[0, 0], 255)  # paper
    dark = (pixels.max(axis=2) < 150).mean()
    assert 0.01 < dark < 0.5
    seen = np.argwhere(pixels.min(axis=2) < 200)
    assert np.ptp(seen[:, 0]) > 36  # it fills the picture


@pytest.mark.parametrize("what", ["capsules", "distance", "mass", "caption", "ghosts"])
def test_what_can_be_shown_beside_it(
    problem: Problem, segment: Segment, plain: bytes, what: str
) -> None:
    look = replace(SMALL, **{what: 3 if what == "ghosts" else True})
    change = np.abs(_pixels(still_png(problem, segment, look, time=1.0)) - _pixels(plain))
    assert (change.max(axis=2) > 8).mean() > 0.002


def test_a_robot_is_seen_through_a_plane_that_is_no_floor(
    problem: Problem, segment: Segment
) -> None:
    """Half of it is below the plane, as on a robot that hangs from it."""
    times = np.array([1.0])
    scene = build_scene(problem, [segment.trajectory.states(times, segment.coefficients)[0]])
    scene = replace(scene, ground=float(scene.center[2]) + 0.3)
    camera = fitted_camera(scene.outline, SMALL.size, SMALL.azimuth, SMALL.elevation)
    poses = instants_of(problem, segment, times).poses
    hidden, seen = (
        Studio(replace(scene, solid=solid), camera, SMALL.azimuth, QUICK).picture(poses, 0)
        for solid in (True, False)
    )
    dark = [(picture.max(axis=2) < 150).mean() for picture in (hidden, seen)]
    assert dark[1] > dark[0] + 0.01


def test_other_instants_and_sides_look_different(
    problem: Problem, segment: Segment, plain: bytes
) -> None:
    assert still_png(problem, segment, SMALL, time=1.0) == plain
    later = _pixels(still_png(problem, segment, SMALL, time=2.5))
    behind = _pixels(still_png(problem, segment, replace(SMALL, azimuth=170.0), time=1.0))
    for other in (later, behind):
        assert (np.abs(other - _pixels(plain)).max(axis=2) > 30).mean() > 0.02


@pytest.mark.long
def test_a_gif_of_the_whole_motion(problem: Problem, segment: Segment) -> None:
    """Workers draw the same one."""
    look = replace(SMALL, size=(64, 48), capsules=True)

    def drawn(**more: Workers) -> tuple[bytes, list[int]]:
        told: list[int] = []
        gif = motion_gif(problem, segment, look, 10, 0.6, lambda _, done: told.append(done), **more)
        return gif, told

    content, told = drawn()
    image = Image.open(io.BytesIO(content))
    assert image.format == "GIF"
    assert image.n_frames == 6
    assert image.info["duration"] == 100
    assert image.info["loop"] == 0
    assert told == list(range(7))
    frames = []
    for frame in range(6):
        image.seek(frame)
        frames.append(np.asarray(image.convert("RGB")).astype(float))
    assert all(np.abs(a - b).max() > 60 for a, b in pairwise(frames))
    with open_workers(2) as workers:
        shared, told = drawn(workers=workers)
    assert told == sorted(told)
    assert told[-1] == 6
    assert shared == content


def test_rays_are_sent_only_where_something_stands(
    problem: Problem, segment: Segment, monkeypatch: pytest.MonkeyPatch
) -> None:
    look = replace(SMALL, capsules=True)
    sent: list[float] = []
    seen = Studio._seen

    def counted(self: Studio, view: object, sight: Any, *middle: object) -> object:
        sent.append(len(sight.directions) / (96 * 72))
        return seen(self, view, sight, *middle)  # type: ignore[arg-type]

    monkeypatch.setattr(Studio, "_seen", counted)
    fast = _pixels(still_png(problem, segment, look, time=1.0))
    assert 0.01 < sent[0] < 0.7
    monkeypatch.setattr(Studio, "_near", lambda self, shown: np.ones(96 * 72, dtype=bool))
    np.testing.assert_array_equal(fast, _pixels(still_png(problem, segment, look, time=1.0)))
    assert 1.0 in sent
