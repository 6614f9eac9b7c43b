"""The robot from its meshes: triangles in the colours of its joints, the farthest first."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from excite_cli.arrays import Indices
from excite_cli.report.chart import side_view
from excite_cli.robot.model import Array

_LEVELS = 6  # of light
_DARKEST, _BRIGHTEST = 62, 100  # % of a joint's own colour; the rest is black
_TOWARDS_LAMP = np.array([0.75, -0.05, 0.65])
_SMALLEST = 0.4  # area of a triangle [pt²] that is drawn


@dataclass(frozen=True, eq=False)
class Faces:
    """Triangles `corners` (F, 3, 3) [m] of a robot in its posture, counter-clockwise from outside.

    `joints` (F,): which joint moves each, n for what stands still.
    """

    corners: Array
    joints: Indices


def drawn_faces(
    faces: Faces, place: tuple[float, Array], colours: Sequence[str]
) -> tuple[str, list[str]]:
    """The style of a drawing, and its parts.

    `place`: scale [pt/m] and shift (2,) [pt] of `side_view`. `colours` of the joints (n), then that
    of what stands still.
    """
    scale, shift = place
    flat, depth = side_view(faces.corners)
    flat = flat * scale + shift
    one, two = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    area = 0.5 * (one[:, 1] * two[:, 0] - one[:, 0] * two[:, 1])  # downwards is positive
    seen = np.flatnonzero(area > _SMALLEST)
    seen = seen[np.argsort(depth[seen].mean(axis=1), kind="stable")]
    corners = faces.corners[seen]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    light = np.clip(normals @ _TOWARDS_LAMP, 0.0, 1.0)
    levels = np.rint((_LEVELS - 1) * light).astype(int)
    inks = [f"f{joint}-{level}" for joint, level in zip(faces.joints[seen], levels, strict=True)]
    parts = []
    for ink, own in groupby(range(len(seen)), key=lambda k: inks[k]):
        path = "".join(_triangle(flat[seen[k]]) for k in own)
        parts.append(f'<path d="{path}" style="color: var(--{ink})"></path>')
    style = "; ".join(
        f"--f{j}-{level}: color-mix(in oklab, {colour} {_share(level):.0f}%, black)"
        for j, colour in enumerate(colours)
        for level in range(_LEVELS)
    )
    return style, ['<g class="faces">', *parts, "</g>"]


def _share(level: int) -> float:
    return _DARKEST + (_BRIGHTEST - _DARKEST) * level / (_LEVELS - 1)


def _triangle(corners: Array) -> str:
    (x, y), *others = np.round(10.0 * corners).astype(int) / 10.0
    steps = "".join(f"L{a:g} {b:g}" for a, b in others)
    return f"M{x:g} {y:g}{steps}z"
