"""Drawings of a page: SVG in the colours of its style sheet, with what one sees in words."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from excite_cli.robot.model import Array

# From where drawings of the robot are seen: from far away, a little from above and the side.

_AZIMUTH, _ELEVATION = np.radians(35.0), np.radians(18.0)


def side_view(points: Array) -> tuple[Array, Array]:
    """Across and down (..., 2) [m] of points (..., 3) [m], and how near they are (...) [m]."""
    c, s = np.cos(_AZIMUTH), np.sin(_AZIMUTH)
    towards = points @ np.array([c, s, 0.0])
    across = points @ np.array([-s, c, 0.0])
    up = points[..., 2] * np.cos(_ELEVATION) - towards * np.sin(_ELEVATION)
    near = towards * np.cos(_ELEVATION) + points[..., 2] * np.sin(_ELEVATION)
    return np.stack([across, -up], axis=-1), np.asarray(near)


def svg_line(one: Array, two: Array, width: float, colour: str) -> str:
    """A thick line with round ends, from point to point (2,)."""
    return (
        f'<path d="M{one[0]:.1f} {one[1]:.1f}L{two[0]:.1f} {two[1]:.1f}" '
        f'style="stroke: {colour}; stroke-width: {width:.1f}; stroke-linecap: round"></path>'
    )


Colour = Literal["ink", "muted", "blue", "vermilion", "green", "purple"]


@dataclass(frozen=True)
class Chart:
    """A drawing of a page: SVG, its heading, and what one sees on it in words."""

    title: str
    svg: str
    alternative: str
    caption: str = ""
    wide: bool = False


def thinned(count: int, most: int) -> slice:
    """Every k-th of `count` samples so that at most `most` remain: a page must stay light."""
    return slice(None, None, max(1, -(-count // most)))


def limits_about(values: Iterable[float], share: float = 0.08) -> tuple[float, float]:
    """Lower and upper end of an axis that shows all `values` with a little room."""
    shown = list(values)
    low, high = min(shown), max(shown)
    room = share * max(high - low, 1e-9 * max(abs(low), abs(high)), 1e-12)
    return low - room, high + room


def in_figures(value: float, digits: int = 3) -> str:
    """A number as people write it: `0.00123`, `5.19`, `12400`, `1.2e+07`; `∞` and `–` beside."""
    if value != value:  # NaN
        return "–"
    if value == 0:
        return "0"
    if value in (float("inf"), float("-inf")):
        return "∞" if value > 0 else "-∞"
    if not 1e-4 <= abs(value) < 10 ** (digits + 3):
        return f"{value:.{digits - 1}e}"
    if abs(value) >= 10 ** (digits - 1):
        return f"{value:.0f}"
    return f"{value:#.{digits}g}".rstrip(".")
