"""Few capsules around the links of a robot: join what wastes little room, cut what wastes much."""

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from scipy.spatial import ConvexHull, QhullError
from threadpoolctl import threadpool_limits

from excite_cli.arrays import Array
from excite_cli.geometry.capsule_fit import (
    capsule_volume,
    hull_points,
    minimum_volume_capsule,
    principal_axes,
    quick_capsule_volume,
    segment_distances,
    sphere_points,
)
from excite_cli.geometry.link_shapes import LinkShape
from excite_cli.robot.capsule import Capsule

Fit = tuple[Array, Array, float]

JOIN_BELOW = 1.2  # volume of the joined capsule over the sum of the two
MOST_BULGE = 0.03  # [m] that a joined capsule may stand out from those it replaces
SMALL_BULGE = 0.05  # [m] the same where one of the two is small,
SMALL = 1.5e-3  # [m^3] that is, of about the size of a fist
CUT_BULGE = 0.03  # [m] that a capsule may stand out from the hull before it is cut
CUT_GAIN = 0.7  # waste with one capsule more over that without
MOST_PIECES = 3
_CUTS = np.linspace(0.2, 0.8, 7)
_SPHERE = sphere_points(100)


def cover(shapes: Iterable[LinkShape], apart: Collection[str] = ()) -> list[Capsule]:
    """Capsules that contain all shapes; links named in `apart` share theirs with no other."""
    with threadpool_limits(1):  # products of small matrices only wait for other threads
        return _cover(shapes, apart)


def _cover(shapes: Iterable[LinkShape], apart: Collection[str]) -> list[Capsule]:
    by_joint: dict[int, list[LinkShape]] = {}
    for shape in shapes:
        by_joint.setdefault(shape.joint, []).append(shape)
    capsules = []
    for joint in sorted(by_joint):
        alone = [shape for shape in by_joint[joint] if shape.links[0] in apart]
        others = [shape for shape in by_joint[joint] if shape.links[0] not in apart]
        for shape, fit in [*_joined(others), *[(s, _fit(s)) for s in alone]]:
            capsules += _named(shape, _pieces(shape, fit))
    return capsules


def _named(shape: LinkShape, fits: list[Fit]) -> list[Capsule]:
    names = [shape.links[0]] + [f"{shape.links[0]}#{k}" for k in range(2, len(fits) + 1)]
    return [
        Capsule(name, shape.joint, *fit, links=shape.links)
        for name, fit in zip(names, fits, strict=True)
    ]


def _fit(shape: LinkShape) -> Fit:
    return minimum_volume_capsule(shape.points)


@dataclass(frozen=True)
class _Group:
    """Links that share a capsule, and the capsule each had alone."""

    shape: LinkShape
    fit: Fit
    alone: tuple[Fit, ...]

    @property
    def volume(self) -> float:
        return capsule_volume(*self.fit)


def _joined(shapes: list[LinkShape]) -> list[tuple[LinkShape, Fit]]:
    """Join the pair that wastes least until every join would waste too much."""
    groups = [_Group(shape, fit, (fit,)) for shape in shapes for fit in [_fit(shape)]]
    tried: dict[tuple[tuple[str, ...], tuple[str, ...]], _Group | None] = {}
    while True:
        joins = []
        for first, one in enumerate(groups):
            for second, two in enumerate(groups[first + 1 :], first + 1):
                key = (one.shape.links, two.shape.links)
                if key not in tried:
                    tried[key] = _join(one, two)
                join = tried[key]
                if join is not None:
                    joins.append((join.volume / (one.volume + two.volume), first, second, join))
        if not joins:
            return [(group.shape, group.fit) for group in groups]
        _, first, second, join = min(joins, key=lambda entry: entry[0])
        groups[first] = join
        del groups[second]


def _join(one: _Group, two: _Group) -> _Group | None:
    """Both in one capsule, unless that takes too much room or bulges out too far."""
    apart = max(one.volume + two.volume, 1e-12)
    alone = one.alone + two.alone
    points = np.vstack([hull_points(one.shape.points), hull_points(two.shape.points)])
    if quick_capsule_volume(points) > 1.3 * JOIN_BELOW * apart:  # it is at most 1.3 times too large
        return None
    fit = minimum_volume_capsule(points)
    allowed = SMALL_BULGE if min(one.volume, two.volume) < SMALL else MOST_BULGE
    if capsule_volume(*fit) > JOIN_BELOW * apart or _bulge(fit, alone) > allowed:
        return None
    large, small = (one, two) if one.volume >= two.volume else (two, one)
    return _Group(large.shape.joined(small.shape), fit, alone)


def _bulge(fit: Fit, inside: tuple[Fit, ...]) -> float:
    """Largest distance [m] from the surface of a capsule to the nearest of those inside it."""
    start, end, radius = fit
    surface = np.vstack([start + radius * _SPHERE, end + radius * _SPHERE])
    surface = np.vstack([surface, (start + end) / 2 + radius * _SPHERE])
    surface = surface[segment_distances(surface, start, end) > 0.99 * radius]
    gaps = [segment_distances(surface, low, high) - r for low, high, r in inside]
    return float(np.min(gaps, axis=0).max())


def _pieces(shape: LinkShape, fit: Fit) -> list[Fit]:
    """One to three capsules that contain the shape: those that stand out least, fewer preferred."""
    outside = _Outside(shape.points, fit)
    if outside.bulge(fit) <= CUT_BULGE:
        return [fit]
    best, least = None, outside.waste([fit])
    for parts in _divisions(shape):
        cover = [minimum_volume_capsule(part.points, starts=1) for part in parts]
        waste = outside.waste(cover) / CUT_GAIN ** (len(cover) - 1)
        if waste < least:
            best, least = parts, waste
    return [fit] if best is None else [_fit(part) for part in best]


class _Outside:
    """How far capsules stand out of the convex hull of some points, on sampled places."""

    def __init__(self, points: Array, fit: Fit) -> None:
        try:
            self._faces = np.unique(ConvexHull(points).equations.round(6), axis=0)
        except (QhullError, ValueError):  # flat: too small to matter
            self._faces = np.zeros((0, 4))
        self._fit = fit

    @cached_property
    def _sample(self) -> tuple[Array, Array, float]:
        """Places (M, 3) around the capsule, their heights (M,) and the volume of each."""
        start, end, radius = self._fit
        low, high = np.minimum(start, end) - 1.2 * radius, np.maximum(start, end) + 1.2 * radius
        box = _evenly_spread_points()
        places = low + (high - low) * box
        return places, self._heights(places), float(np.prod(high - low)) / len(box)

    def _heights(self, places: Array) -> Array:
        """Height [m] of places above the hull: that above the face that sees them highest."""
        if not len(self._faces):
            return np.zeros(len(places))
        return np.maximum((places @ self._faces[:, :3].T + self._faces[:, 3]).max(axis=1), 0.0)

    def bulge(self, fit: Fit) -> float:
        """Greatest height [m] of the capsule above the hull."""
        start, end, radius = fit
        middle = (start + end) / 2
        surface = np.vstack([place + radius * _SPHERE for place in (start, middle, end)])
        return float(self._heights(surface).max())

    def waste(self, cover: list[Fit]) -> float:
        """Integral [m^4] over the union of the capsules of the height above the hull and 1 cm."""
        places, heights, room = self._sample
        inside = np.zeros(len(places), dtype=bool)
        for start, end, radius in cover:
            inside |= segment_distances(places, start, end) <= radius
        return room * float((heights + 0.01)[inside].sum())


def _divisions(shape: LinkShape) -> list[list[LinkShape]]:
    """Ways to cut a shape: best cut, best cut of a part, and slices across the main axes."""
    divisions = []
    corners = hull_points(shape.points)
    for axis in _main_axes(corners):
        z = corners @ axis
        for count in range(2, MOST_PIECES + 1):
            rest, parts = shape, []
            for height in np.linspace(z.min(), z.max(), count + 1)[1:-1]:
                part, rest = rest.halves(axis, float(height))
                parts.append(part)
            divisions.append([*parts, rest])
    halves = _best_cut(shape)
    if halves is not None:
        divisions.append(halves)
        large, small = sorted(halves, key=lambda part: -quick_capsule_volume(part.points))
        again = _best_cut(large)
        if again is not None:
            divisions.append([*again, small])
    return [parts for parts in divisions if all(len(part.points) >= 4 for part in parts)]


def _best_cut(shape: LinkShape) -> list[LinkShape] | None:
    """The two parts, cut across a main axis, whose capsules take least room."""
    corners = hull_points(shape.points)
    best, place = np.inf, None
    for axis in _main_axes(corners):
        z = corners @ axis
        for share in _CUTS:
            height = float((1 - share) * z.min() + share * z.max())
            parts = shape.cut(axis, height)
            if min(map(len, parts)) < 4:
                continue
            volume = sum(quick_capsule_volume(part) for part in parts)
            if volume < best:
                best, place = volume, (axis, height)
    return None if place is None else list(shape.halves(*place))


def _main_axes(points: Array) -> Array:
    """Axes of the joint frame, or the principal ones where the box along those is smaller."""
    principal = principal_axes(points)
    box, turned = np.ptp(points, axis=0).prod(), np.ptp(points @ principal.T, axis=0).prod()
    return principal if turned < 0.9 * box else np.eye(3)


@cache
def _evenly_spread_points() -> Array:
    """Points (4000, 3) of the unit cube."""
    # Halton's sequence, as scipy.stats.qmc has it; that module takes seconds to import.
    count = np.arange(4000)
    columns = []
    for base in (2, 3, 5):
        left, share, column = count, 1.0 / base, np.zeros(len(count))
        while left.any():
            column += share * (left % base)
            left, share = left // base, share / base
        columns.append(column)
    return np.stack(columns, axis=1)
