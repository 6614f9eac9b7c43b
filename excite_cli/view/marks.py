"""Marks over a picture: the nearest distance, the centre of mass, the zero-moment point, words."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from excite_cli.errors import optional_module
from excite_cli.robot.model import Array
from excite_cli.view.geometry import Colour, in_bytes
from excite_cli.view.instants import Instants
from excite_cli.view.rays import Camera
from excite_cli.view.scene import Scene
from excite_cli.view.translucent import NEAREST, REGION

_FINER = 3  # marks are drawn this many times larger, then shrunk, for smooth edges
_INK: Colour = (0.13, 0.15, 0.18)
_PAPER: Colour = (1.0, 1.0, 1.0)


def pillow_part(name: str) -> Any:
    """The module `PIL.<name>`.

    Raises
    ------
    MissingExtraError
        Pillow is not installed.
    """
    return optional_module(
        f"PIL.{name}",
        "Pictures need Pillow, which is not installed. Run: pip install 'excite-cli[view]'",
    )


class Marks:
    """Draws over pictures of one camera; sizes follow the picture's."""

    def __init__(self, scene: Scene, camera: Camera) -> None:
        self._scene, self._camera = scene, camera
        self._unit = max(min(camera.width, camera.height) / 480, 0.5)  # [pixels]
        self._font = pillow_part("ImageFont").load_default(size=round(13 * self._unit))

    def drawn(
        self,
        picture: NDArray[np.uint8],
        instants: Instants,
        instant: int,
        distance: bool,
        mass: bool,
        caption: str,
    ) -> Any:
        """The picture (height, width, 3) with its marks, as a Pillow image."""
        library = pillow_part("Image")
        image = library.fromarray(picture)
        size = (self._camera.width * _FINER, self._camera.height * _FINER)
        layer = library.new("RGBA", size, (255, 255, 255, 0))
        pen = pillow_part("ImageDraw").Draw(layer)
        words: list[tuple[Array, str, Colour]] = []
        if mass:
            self._mass(pen, instants, instant)
        if distance and instants.nearest is not None:
            words.append(self._distance(pen, instants, instant))
        if (drawn := layer.getbbox()) is not None:
            left, top = drawn[0] // _FINER, drawn[1] // _FINER
            right, bottom = -(-drawn[2] // _FINER), -(-drawn[3] // _FINER)
            box = tuple(_FINER * each for each in (left, top, right, bottom))
            layer = layer.reduce(_FINER, box)
            image.paste(layer, (left, top), layer)
        text = pillow_part("ImageDraw").Draw(image)
        for place, word, colour in words:
            self._write(text, place, word, colour, anchor="lm")
        if caption:
            pad = 9 * self._unit
            place = np.array([pad, self._camera.height - pad])
            if text.textlength(caption, font=self._font) > self._camera.width - 2 * pad:
                caption = caption.replace(", ", "\n", 1)
            caption += f"\n{self._scene.ground_words}"
            self._write(text, place, caption, _INK, anchor="ld")
        return image

    def _distance(self, pen: Any, instants: Instants, instant: int) -> tuple[Array, str, Colour]:
        nearest = instants.nearest
        assert nearest is not None
        ends = self._camera.project(nearest.ends[instant])
        self._line(pen, ends, 3.4, _PAPER)
        for end in ends:
            self._dot(pen, end, 4.2, _PAPER)
        self._line(pen, ends, 1.8, NEAREST)
        for end in ends:
            self._dot(pen, end, 3.0, NEAREST)
        right = ends[int(np.argmax(ends[:, 0]))]
        place = right + np.array([9 * self._unit, 0.0])
        return place, f"{1000 * nearest.distances[instant]:.0f} mm", NEAREST

    def _mass(self, pen: Any, instants: Instants, instant: int) -> None:
        """The centre of mass with its plumb line, and the zero-moment point as a diamond."""
        center = instants.mass[instant]
        region = self._scene.region
        height = region.height if region is not None else self._scene.ground
        if region is not None:
            level = np.full((len(region.corners), 1), height)
            corners = self._camera.project(np.hstack([region.corners, level]))
            self._line(pen, np.vstack([corners, corners[:1]]), 1.2, REGION)
        below = np.array([center[0], center[1], height])
        middle, foot = self._camera.project(np.stack([center, below]))
        self._dashes(pen, middle, foot)
        self._dot(pen, foot, 3.4, _PAPER)
        self._dot(pen, foot, 2.4, REGION if region is not None else _INK)
        if instants.zmp is not None and np.isfinite(instants.zmp[instant]).all():
            place = self._camera.project(np.array([*instants.zmp[instant], height]))
            self._diamond(pen, place, 5.2, _PAPER)
            self._diamond(pen, place, 4.0, NEAREST)
        radius = 6.5 * self._unit * _FINER
        x, y = middle * _FINER
        box = (x - radius, y - radius, x + radius, y + radius)
        pen.ellipse(box, fill=in_bytes(_PAPER), outline=in_bytes(_INK), width=round(radius / 5))
        pen.pieslice(box, 0, 90, fill=in_bytes(_INK))
        pen.pieslice(box, 180, 270, fill=in_bytes(_INK))

    def _dashes(self, pen: Any, start: Array, end: Array) -> None:
        length = float(np.linalg.norm(end - start))
        step = 6 * self._unit
        for k in range(0, int(length / step), 2):
            some = np.array([k, k + 1])[:, None] * step / length
            self._line(pen, start + some * (end - start), 1.4, _INK)

    def _line(self, pen: Any, ends: Array, width: float, colour: Colour) -> None:
        places = [tuple(end * _FINER) for end in ends]
        pen.line(places, fill=in_bytes(colour), width=round(width * self._unit * _FINER))

    def _dot(self, pen: Any, place: Array, radius: float, colour: Colour) -> None:
        reach = radius * self._unit * _FINER
        x, y = place * _FINER
        pen.ellipse((x - reach, y - reach, x + reach, y + reach), fill=in_bytes(colour))

    def _diamond(self, pen: Any, place: Array, radius: float, colour: Colour) -> None:
        reach = radius * self._unit * _FINER
        x, y = place * _FINER
        corners = [(x - reach, y), (x, y - reach), (x + reach, y), (x, y + reach)]
        pen.polygon(corners, fill=in_bytes(colour))

    def _write(self, pen: Any, place: Array, text: str, colour: Colour, anchor: str) -> None:
        pen.text(
            (float(place[0]), float(place[1])),
            text,
            font=self._font,
            fill=in_bytes(colour),
            anchor=anchor,
            stroke_width=round(2 * self._unit),
            stroke_fill=(255, 255, 255),
        )


def caption_of(instants: Instants, instant: int, duration: float) -> str:
    """`2.40 of 8 s, nearest: torso - arm_left_3_link, 12 mm`."""
    words = f"{instants.times[instant]:.2f} of {duration:.4g} s"
    if instants.nearest is None:
        return words
    distance = 1000 * instants.nearest.distances[instant]
    label = instants.nearest.labels[instant].replace("–", "-")  # the font has no dash
    return f"{words}, nearest: {label}, {distance:.0f} mm"
