"""Motions as pictures without a display: one instant as PNG, a whole motion as GIF."""

import io
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from excite_cli.excitation.nearest import closest_time
from excite_cli.excitation.problem import Problem
from excite_cli.geometry.link_meshes import Poses
from excite_cli.robot.model import Array
from excite_cli.trajectory.fade import Segment
from excite_cli.view.geometry import Colour
from excite_cli.view.ground import PAPER
from excite_cli.view.instants import Instants, instants_of
from excite_cli.view.marks import Marks, caption_of, pillow_part
from excite_cli.view.rays import Camera, embree_part, fitted_camera
from excite_cli.view.scene import Scene, build_scene, outermost
from excite_cli.view.studio import FINE, QUICK, Studio
from excite_cli.view.translucent import CAPSULE, NEAREST, REGION
from excite_cli.workers.base import Here, News, Workers

Told = Callable[[str, int], None]
Said = Callable[[str], None]

_DETAIL, _DETAIL_MOVING = 0.8, 1.2  # detail smaller than so many pixels is dropped
_SEEN = 40  # instants that tell how far a motion reaches
_COLOURS = 255  # of a GIF, the same for all frames, so that nothing flickers
_SAMPLED = 6  # frames that the colours are chosen from


@dataclass(frozen=True)
class View:
    """How a picture is taken.

    size: pixels across and down. azimuth, elevation [°]: from where. capsules, distance, mass,
    caption: what is shown beside the robot; mass None: where a constraint asks for balance.
    ghosts: instants at which it is shown faintly, too.
    """

    size: tuple[int, int] = (1280, 960)
    azimuth: float = 35.0
    elevation: float = 18.0
    capsules: bool = True
    distance: bool = True
    mass: bool | None = None
    caption: bool = True
    ghosts: int = 0


def still_png(
    problem: Problem,
    segment: Segment,
    view: View | None = None,
    time: float | None = None,
    say: Said = lambda text: None,
) -> bytes:
    """The robot at `time` [s] of a motion as a PNG.

    By default at the instant at which it comes nearest to itself or to what stands around it.
    `say` hears what cannot be shown as the URDF says it.

    Raises
    ------
    MissingExtraError
        embreex or Pillow is not installed.
    """
    view = view or View()
    pillow_part("Image")
    embree_part("rtcore_scene")
    duration = segment.trajectory.duration
    at = closest_time(problem, segment) if time is None else float(np.clip(time, 0.0, duration))
    instants = instants_of(problem, segment, np.array([at]))
    others = np.linspace(0.0, duration, view.ghosts + 1)[:-1] + duration / (2 * view.ghosts or 1)
    q = segment.trajectory.states(others, segment.coefficients)[0]
    ghosts = Poses.of(problem.robot, q)
    path = _path(segment)
    scene = build_scene(problem, [path], _cell(problem, path, view))
    if scene.note:
        say(scene.note)
    shown = [outermost(scene.bodies, instants.poses), outermost(scene.bodies, ghosts)]
    camera = fitted_camera(_framed(scene, shown, instants), view.size, view.azimuth, view.elevation)
    studio = Studio(scene, camera, view.azimuth, FINE)
    picture = studio.picture(instants.poses, 0, _capsules(scene, instants, 0, view), ghosts)
    caption = caption_of(instants, 0, duration) if view.caption else ""
    marks = Marks(scene, camera)
    image = marks.drawn(picture, instants, 0, view.distance, _mass(scene, view), caption)
    stream = io.BytesIO()
    image.save(stream, "PNG", optimize=True)
    return stream.getvalue()


def motion_gif(
    problem: Problem,
    segment: Segment,
    view: View,
    frames_per_second: float,
    seconds: float,
    tell: Told = lambda text, done: None,
    say: Said = lambda text: None,
    workers: Workers | None = None,
) -> bytes:
    """A motion as a GIF that repeats, `seconds` long: shorter than the motion means faster.

    `tell` hears of every frame, `say` what cannot be shown as the URDF says it. `workers` share
    the frames (default: drawn here).

    Raises
    ------
    MissingExtraError
        embreex or Pillow is not installed.
    """
    pillow_part("Image")
    embree_part("rtcore_scene")
    duration = segment.trajectory.duration
    count = frame_count(frames_per_second, seconds)
    instants = instants_of(problem, segment, _frame_times(segment, count))
    path = _path(segment)
    scene = build_scene(problem, [path], _cell(problem, path, view, _DETAIL_MOVING))
    if scene.note:
        say(scene.note)
    camera = fitted_camera(
        _framed(scene, [scene.outline], instants), view.size, view.azimuth, view.elevation
    )
    place = workers or Here()
    film = _Film(scene, camera, instants, view, duration, duration / seconds)
    shares = [range(first, count, place.count) for first in range(min(place.count, count))]
    drawn = [0] * len(shares)

    def watch(news: News) -> None:
        drawn[news.index] = len(shares[news.index]) if news.word is None else news.word
        tell(f"frame {min(sum(drawn) + 1, count)}/{count}", sum(drawn))

    found = place.map(_drawn, film, shares, watch)
    pixels = dict(pair for share in found for pair in share)
    fromarray = pillow_part("Image").fromarray
    return _gif([fromarray(pixels[frame]) for frame in range(count)], frames_per_second)


@dataclass(frozen=True)
class _Film:
    """What all frames of a GIF have in common."""

    scene: Scene
    camera: Camera
    instants: Instants
    view: View
    duration: float
    pace: float


def _drawn(
    film: _Film, frames: range, tell: Callable[[int], None]
) -> list[tuple[int, NDArray[np.uint8]]]:
    """Some frames of a GIF, each with its number; `tell` hears how many are done."""
    scene, instants, view = film.scene, film.instants, film.view
    studio, marks = Studio(scene, film.camera, view.azimuth, QUICK), Marks(scene, film.camera)
    images = []
    for done, frame in enumerate(frames):
        tell(done)
        picture = studio.picture(instants.poses, frame, _capsules(scene, instants, frame, view))
        caption = _moving_caption(instants, frame, film) if view.caption else ""
        image = marks.drawn(picture, instants, frame, view.distance, _mass(scene, view), caption)
        images.append((frame, np.asarray(image)))
    return images


def frame_count(frames_per_second: float, seconds: float) -> int:
    """Frames of an animation; two at least."""
    return max(2, round(frames_per_second * seconds))


def _frame_times(segment: Segment, count: int) -> Array:
    """Instants of the frames; a motion that ends where it starts shows that place once."""
    duration = segment.trajectory.duration
    ends = segment.trajectory.states(np.array([0.0, duration]), segment.coefficients)[0]
    closed = bool(np.allclose(ends[0], ends[1], atol=1e-6))
    return np.linspace(0.0, duration, count, endpoint=not closed)


def _moving_caption(instants: Instants, frame: int, film: _Film) -> str:
    words, pace = caption_of(instants, frame, film.duration), film.pace
    return words if abs(pace - 1) < 0.02 else f"{words}, shown {pace:.2g} times as fast"


def _gif(images: list[Any], frames_per_second: float) -> bytes:
    library = pillow_part("Image")
    chosen = images[:: max(1, len(images) // _SAMPLED)][:_SAMPLED]
    palette = _palette(np.concatenate([np.asarray(image).reshape(-1, 3) for image in chosen]))
    frames = [image.quantize(palette=palette, dither=library.Dither.NONE) for image in images]
    stream = io.BytesIO()
    frames[0].save(
        stream,
        "GIF",
        save_all=True,
        append_images=frames[1:],
        duration=round(1000 / frames_per_second),
        loop=0,
        optimize=True,
    )
    return stream.getvalue()


def _palette(pixels: NDArray[np.uint8]) -> Any:
    """The colours of a GIF, as a Pillow image, for pixels (K, 3).

    Each shade counts by the root of its share: marks are few pixels, and would be lost among the
    greys of the ground if all pixels counted the same.
    """
    library = pillow_part("Image")
    red, green, blue = pixels.astype(np.int64).T
    packed, counts = np.unique((red << 16) + (green << 8) + blue, return_counts=True)
    shades = np.stack([packed >> 16, packed >> 8, packed], axis=1).astype(np.uint8)
    repeated = np.repeat(shades, np.ceil(np.sqrt(counts)).astype(int), axis=0)
    exact = np.round(255 * np.array([PAPER, NEAREST, CAPSULE, REGION])).astype(int)
    count = _COLOURS - len(exact)
    mixed = library.fromarray(repeated[None]).quantize(count, library.Quantize.MEDIANCUT)
    palette = library.new("P", (1, 1))
    palette.putpalette([*mixed.getpalette()[: 3 * count], *exact.ravel().tolist()])
    return palette


def _path(segment: Segment) -> Array:
    """Positions (T, n) that tell how far the motion reaches."""
    times = np.linspace(0.0, segment.trajectory.duration, _SEEN)
    return segment.trajectory.states(times, segment.coefficients)[0]


def _cell(problem: Problem, path: Array, view: View, detail: float = _DETAIL) -> float:
    """What a pixel is about as wide as [m]: the robot fills most of a picture."""
    places = Poses.of(problem.robot, path).translations.reshape(-1, 3)
    return detail * max(float(np.linalg.norm(np.ptp(places, axis=0))), 0.1) / max(view.size)


def _framed(scene: Scene, shown: list[Array], instants: Instants) -> Array:
    """Points (K, 3) [m] that the picture must hold."""
    parts = [*shown, *(surface.points for _, surface in scene.boxes)]
    if scene.region is not None:
        corners = scene.region.corners
        parts.append(np.column_stack([corners, np.full(len(corners), scene.region.height)]))
    foot = instants.mass.copy()
    foot[:, 2] = scene.ground
    return np.vstack([*parts, foot])


def _capsules(
    scene: Scene, instants: Instants, instant: int, view: View
) -> list[tuple[int, Colour]]:
    """All capsules, those of the nearest pair in a colour of their own."""
    if not view.capsules:
        return []
    near = instants.nearest.capsules[instant] if instants.nearest is not None else ()
    return [(k, NEAREST if c in near else CAPSULE) for k, c in enumerate(scene.capsules)]


def _mass(scene: Scene, view: View) -> bool:
    return view.mass if view.mass is not None else scene.region is not None
