"""The robot at the instant of a motion at which it comes nearest to something, as its capsules.

Seen from afar a capsule is a thick line with round ends, so that the drawing is a few lines of
SVG in the page's own colours, needs no mesh and shows what the constraints see.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from math import isfinite

import numpy as np

from excite_cli.constraints.drawing import NearestBodies
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.excitation.motion import Motion
from excite_cli.excitation.nearest import closest_time, nearest_bodies
from excite_cli.excitation.problem import Problem
from excite_cli.geometry.link_meshes import Poses
from excite_cli.geometry.obstacles import FLOOR, Box, Plane
from excite_cli.report.chart import Chart, in_figures, side_view, svg_line
from excite_cli.report.robot_faces import Faces, drawn_faces
from excite_cli.robot.model import Array
from excite_cli.robot.tree import Skeleton
from excite_cli.trajectory.fade import Segment

_WIDTH, _HEIGHT, _MARGIN = 284.0, 210.0, 8.0  # pt
_THIN = 0.012  # [m] radius of a line between joints, where there are no capsules
_EDGES = [(i, j) for i in range(8) for j in range(i) if (i ^ j).bit_count() == 1]


@dataclass(frozen=True)
class _Stick:
    start: Array
    end: Array
    radius: float
    near: bool = False


def posture_chart(problem: Problem, motion: Motion) -> Chart:
    """The robot where its first `motion` has least room."""
    segment = Segment("", problem.trajectory, motion.coefficients)
    at = closest_time(problem, segment)
    states = States.along(
        problem.kinematics, problem.trajectory, motion.coefficients, np.array([at])
    )
    poses = Poses.of(problem.robot, states.q)
    margins = [constraint.margins(states) for constraint in problem.constraints]
    near = nearest_bodies(problem, poses, margins)
    name = problem.robot.name
    if near is None:
        words = f"{name} at {in_figures(at)} s of its first motion"
    else:
        words = (
            f"{name} at {in_figures(at)} s of its first motion, where it has least room; nearest: "
            f"{near.labels[0]}, distance {in_figures(1e3 * float(near.distances[0]))} mm"
        )
    capsules = " Capsules as the constraints see them." if near is not None else ""
    sticks = _sticks(problem, poses, near)
    floor = _floor(problem, sticks)
    ground = " The frame is the floor." if len(floor) else " No floor is modelled."
    caption = f"{words}.{capsules}{ground} `excite view` plays all motions."
    svg = _drawn(sticks, _boxes(problem), near, floor)
    return Chart(f"{name} in its first motion", svg, f"{words}.", caption)


def _sticks(problem: Problem, poses: Poses, near: NearestBodies | None) -> list[_Stick]:
    """Capsules that constraints look at; where there are none, lines between the joints."""
    close = near.capsules[0] if near is not None else ()
    found = {
        id(capsule): capsule for each in problem.constraints for capsule in each.drawing.capsules
    }
    if found:
        return [
            _Stick(
                poses.points(c.joint, c.start)[0],
                poses.points(c.joint, c.end)[0],
                c.radius,
                any(c is other for other in close),
            )
            for c in found.values()
        ]
    places, parents = poses.translations[0], problem.robot.model.parents
    return [_Stick(places[parents[j]], places[j], _THIN) for j in range(1, len(places))]


def _floor(problem: Problem, sticks: list[_Stick]) -> Array:
    """Corners (4, 3) of the floor below the robot, in order; (0, 3) where none is modelled."""
    heights = [
        each.offset
        for constraint in problem.constraints
        for each in constraint.drawing.obstacles
        if isinstance(each, Plane) and each.name == FLOOR
    ]
    if not heights:
        return np.zeros((0, 3))
    ends = np.array([[stick.start, stick.end] for stick in sticks]).reshape(-1, 3)
    (x, y), (far_x, far_y) = ends[:, :2].min(axis=0), ends[:, :2].max(axis=0)
    corners = [(x, y), (far_x, y), (far_x, far_y), (x, far_y)]
    return np.column_stack([np.array(corners), np.full(4, heights[0])])


def _boxes(problem: Problem) -> list[Array]:
    """Corners (8, 3) of the boxes that stand around."""
    signs = np.array([[1 if k & bit else -1 for bit in (1, 2, 4)] for k in range(8)])
    found = {
        id(each): each
        for constraint in problem.constraints
        for each in constraint.drawing.obstacles
        if isinstance(each, Box)
    }
    return [(signs * box.half) @ box.rotation.T + box.position for box in found.values()]


def _drawn(
    sticks: list[_Stick], boxes: list[Array], near: NearestBodies | None, floor: Array
) -> str:
    """SVG: what is behind first; each capsule with a rim, the nearest in vermilion."""
    ends = np.array([[stick.start, stick.end] for stick in sticks])
    radii = np.array([stick.radius for stick in sticks])
    flat, depth = side_view(ends)
    reach = np.concatenate([flat - radii[:, None, None], flat + radii[:, None, None]])
    corners = [side_view(box)[0] for box in boxes]
    level = side_view(floor)[0]
    every = np.vstack([reach.reshape(-1, 2), *corners, level])
    low, size = every.min(axis=0), np.ptp(every, axis=0)
    room = np.array([_WIDTH, _HEIGHT]) - 2 * _MARGIN
    scale = float((room / np.maximum(size, 1e-9)).min())
    shift = _MARGIN + (room - size * scale) / 2 - low * scale
    parts = [f'<svg viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}">']
    placed = level * scale + shift
    for k in range(len(placed)):
        parts.append(svg_line(placed[k - 1], placed[k], 0.8, "var(--muted)"))
    for box in corners:
        placed = box * scale + shift
        parts += [svg_line(placed[i], placed[j], 0.8, "var(--muted)") for i, j in _EDGES]
    middle = depth.mean(axis=1)
    far, span = middle.min(), max(float(np.ptp(middle)), 1e-9)
    for k in np.argsort(middle, kind="stable"):
        one, two = flat[k] * scale + shift
        width = max(2.0 * radii[k] * scale, 1.6)
        light = 22 + 30 * (middle[k] - far) / span  # what is nearer is darker
        fill = f"color-mix(in oklab, var(--muted) {light:.0f}%, var(--card))"
        if sticks[k].near:
            fill = "color-mix(in oklab, var(--vermilion) 75%, var(--card))"
        parts.append(svg_line(one, two, width, "var(--muted)"))
        parts.append(svg_line(one, two, max(width - 1.4, 0.9), fill))
    if near is not None:
        one, two = side_view(near.ends[0])[0] * scale + shift
        parts.append(svg_line(one, two, 1.6, "var(--vermilion)"))
    return "".join([*parts, "</svg>"])


_DRAWN_WIDTH, _ROW, _DRAWN_MARGIN = 284.0, 13.0, 12.0  # pt
_ROBOT = 0.56  # of the width; the rest is for names
_LEAST = 210.0  # pt of height
_SCALE, _STEPS = 22.0, 24  # pt below, and patches of colour


def robot_chart(
    title: str,
    skeleton: Skeleton,
    names: Sequence[str],
    shares: Mapping[str, float],
    what: str,
    faces: Faces | None = None,
) -> Chart:
    """Joints as dots, from green (no share) to vermilion (the most), each with its name; a scale.

    `shares` by joint; one that is not known (NaN, missing) is drawn without colour. `what` says
    what the shares are. Where `faces` are known, what a joint moves has its colour.
    """
    known = {name: share for name, share in shares.items() if isfinite(share)}
    most = max(known.values(), default=1.0) or 1.0
    height = max(_LEAST, _ROW * len(names) + 2 * _DRAWN_MARGIN)
    points, base, tips, place = _placed(skeleton, height, faces)
    colours = [_colour(known.get(name), most) for name in names]
    style, parts = "", list[str]()
    if faces is not None:
        style, parts = drawn_faces(faces, place, [*colours, "var(--still)"])
    else:
        for j, parent in enumerate(skeleton.parents):
            start = base if parent < 0 else points[parent]
            parts.append(svg_line(start, points[j], 3.0, "var(--ink)"))
            parts.append(svg_line(points[j], tips[j], 3.0, "var(--ink)"))
    rows = np.argsort(points[:, 1], kind="stable")
    left = _DRAWN_WIDTH * _ROBOT + 6.0
    step = (height - 2 * _DRAWN_MARGIN) / max(len(names), 1)
    for row, j in enumerate(rows):
        y = _DRAWN_MARGIN + (row + 0.5) * step
        parts.append(svg_line(points[j], np.array([left, y]), 0.6, "var(--limit)"))
        share = known.get(names[j])
        told = "–" if share is None else f"{share:.1%}"
        parts.append(
            f'<text x="{left + 3:.1f}" y="{y + 3:.1f}" style="font-size: 9px; fill: var(--ink)">'
            f"{escape(names[j])} {told}</text>"
        )
    for (x, y), colour in zip(points, colours, strict=True):
        parts.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.5" style="fill: {colour}; '
            f'stroke: var(--card); stroke-width: 1"></circle>'
        )
    ranked = sorted(known.items(), key=lambda item: -item[1])
    worst = ", ".join(f"{name} {share:.1%}" for name, share in ranked)
    parts += _scale(most, height)
    head = f'<svg viewBox="0 0 {_DRAWN_WIDTH:g} {height + _SCALE:g}" style="{style}">'
    svg = "".join([head, *parts, "</svg>"])
    return Chart(title, svg, f"{what}, the most first: {worst}.", f"{what}.")


def _scale(most: float, top: float) -> list[str]:
    """From no share to the most, with their figures."""
    width = _DRAWN_WIDTH * _ROBOT - 2 * _DRAWN_MARGIN
    step = width / _STEPS
    parts = [
        f'<rect x="{_DRAWN_MARGIN + k * step:.1f}" y="{top:.1f}" width="{step + 0.3:.1f}" '
        f'height="5" style="fill: {_colour((k + 0.5) / _STEPS, 1.0)}"></rect>'
        for k in range(_STEPS)
    ]
    ends = ((_DRAWN_MARGIN, "start", "0"), (_DRAWN_MARGIN + width, "end", f"{most:.1%}"))
    return parts + [
        f'<text x="{x:.1f}" y="{top + 14:.1f}" text-anchor="{anchor}" '
        f'style="font-size: 8.5px; fill: var(--ink)">{text}</text>'
        for x, anchor, text in ends
    ]


def _colour(share: float | None, most: float) -> str:
    if share is None:
        return "var(--muted)"
    return f"color-mix(in oklab, var(--vermilion) {100 * share / most:.0f}%, var(--green))"


def _placed(
    skeleton: Skeleton, height: float, faces: Faces | None
) -> tuple[Array, Array, Array, tuple[float, Array]]:
    """Joints (n, 2), base (2,) and tips (n, 2) in the drawing, as large as there is room.

    Then the scale [pt/m] and the shift (2,) [pt] by which they were placed.
    """
    flat, _ = side_view(np.array([skeleton.base, *skeleton.joints, *skeleton.tips]))
    every = flat if faces is None else np.vstack([flat, side_view(faces.corners)[0].reshape(-1, 2)])
    low, size = every.min(axis=0), np.ptp(every, axis=0)
    room = np.array([_DRAWN_WIDTH * _ROBOT, height]) - 2 * _DRAWN_MARGIN
    scale = float((room / np.maximum(size, 1e-9)).min())
    shift = _DRAWN_MARGIN + (room - size * scale) / 2 - low * scale
    placed, n = flat * scale + shift, len(skeleton.joints)
    return placed[1 : n + 1], placed[0], placed[n + 1 :], (scale, shift)
