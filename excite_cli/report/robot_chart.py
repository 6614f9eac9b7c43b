"""The robot with its joints coloured by a share: a drawing of lines that needs no URDF."""

from collections.abc import Mapping, Sequence
from html import escape
from math import isfinite

import numpy as np

from excite_cli.report.chart import Chart, side_view, svg_line
from excite_cli.robot.model import Array
from excite_cli.robot.tree import Skeleton

_WIDTH, _ROW, _MARGIN = 284.0, 13.0, 12.0  # pt
_ROBOT = 0.52  # of the width; the rest is for names
_LEAST = 150.0  # pt of height


def robot_chart(
    title: str, skeleton: Skeleton, names: Sequence[str], shares: Mapping[str, float], what: str
) -> Chart:
    """Joints as dots, from green (the least share) to vermilion (the most), each with its name.

    `shares` by joint; one that is not known (NaN, missing) is drawn without colour. `what` says
    what the shares are.
    """
    known = {name: share for name, share in shares.items() if isfinite(share)}
    most = max(known.values(), default=1.0) or 1.0
    height = max(_LEAST, _ROW * len(names) + 2 * _MARGIN)
    points, base, tips = _placed(skeleton, height)
    parts = [f'<svg viewBox="0 0 {_WIDTH:g} {height:g}">']
    for j, parent in enumerate(skeleton.parents):
        parts.append(svg_line(base if parent < 0 else points[parent], points[j], 3.0, "var(--ink)"))
        parts.append(svg_line(points[j], tips[j], 3.0, "var(--ink)"))
    rows = np.argsort(points[:, 1], kind="stable")
    left = _WIDTH * _ROBOT + 6.0
    step = (height - 2 * _MARGIN) / max(len(names), 1)
    for row, j in enumerate(rows):
        y = _MARGIN + (row + 0.5) * step
        parts.append(svg_line(points[j], np.array([left, y]), 0.8, "var(--grid)"))
        share = known.get(names[j])
        told = "–" if share is None else f"{share:.1%}"
        parts.append(
            f'<text x="{left + 3:.1f}" y="{y + 3:.1f}" style="font-size: 9px; fill: var(--ink)">'
            f"{escape(names[j])} {told}</text>"
        )
    for j, name in enumerate(names):
        (x, y), colour = points[j], _colour(known.get(name), most)
        parts.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" style="fill: {colour}; '
            f'stroke: var(--card); stroke-width: 1"></circle>'
        )
    ranked = sorted(known.items(), key=lambda item: -item[1])
    worst = ", ".join(f"{name} {share:.1%}" for name, share in ranked)
    return Chart(
        title, "".join([*parts, "</svg>"]), f"{what}, the most first: {worst}.", f"{what}."
    )


def _colour(share: float | None, most: float) -> str:
    if share is None:
        return "var(--muted)"
    return f"color-mix(in oklab, var(--vermilion) {100 * share / most:.0f}%, var(--green))"


def _placed(skeleton: Skeleton, height: float) -> tuple[Array, Array, Array]:
    """Joints (n, 2), base (2,) and tips (n, 2) in the drawing, as large as there is room."""
    flat, _ = side_view(np.array([skeleton.base, *skeleton.joints, *skeleton.tips]))
    low, size = flat.min(axis=0), np.ptp(flat, axis=0)
    room = np.array([_WIDTH * _ROBOT, height]) - 2 * _MARGIN
    scale = float((room / np.maximum(size, 1e-9)).min())
    placed = _MARGIN + (flat - low) * scale + (room - size * scale) / 2
    n = len(skeleton.joints)
    return placed[1 : n + 1], placed[0], placed[n + 1 :]
