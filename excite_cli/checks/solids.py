"""Links whose mass does not fit into their shapes: density, place and spread.

A link's mass lies within its shapes; of these the convex hull, and the box [l, u] along the axes
of the link's frame around them and its joints, are taken, h = (u − l)/2 and middle b. Then

    density   m / V, V the hull's volume, is that of some material
    place and spread   tr Σ + |c − b|² ≤ |h|²: the mean square distance of mass from the middle,
              with c the centre of mass and Σ = (tr I / 2 · 1 − I) / m the spread about it

and an inertia that is not about c but about the frame has a spread of at least |c|² along c. No
even body with a joint at its end has that: a rod of length L has L²/12, with |c|² = L²/4.

Measured on 126 descriptions with shapes (arms, hands, quadrupeds, humanoids, 2,246 moving links):
densities are 220 to 5,800 kg/m³ for 90 % of the links, 15,000 at most but for placeholders.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from excite_cli.checks.base import DescriptionCheck, Log
from excite_cli.checks.bodies import LinkBody, link_bodies
from excite_cli.checks.check_result import CheckResult, few
from excite_cli.errors import RobotError
from excite_cli.geometry.link_shapes import collision_model, placed_shapes, visual_model
from excite_cli.robot.mesh_paths import unusable, without_unusable
from excite_cli.robot.model import Array, Robot, links_by_joint

# Corners of all shapes of every link, collision and visual ones, in the frame of the link.


def link_corners(robot: Robot) -> dict[str, Array]:
    """Corners (N, 3) [m] by the link's name; none of meshes that are missing or cannot be read."""
    described = robot.description
    lacking = {**unusable(described, "collision"), **unusable(described, "visual")}
    usable = replace(robot, description=without_unusable(described, tuple(lacking)))
    found: dict[str, list[Array]] = {}
    for of_kind in (collision_model, visual_model):
        try:
            geometry = of_kind(usable)
            for item, link, points in placed_shapes(usable, geometry):
                frame = robot.model.frames[item.parentFrame].placement
                own = (points - np.array(frame.translation)) @ np.array(frame.rotation)
                found.setdefault(link, []).append(own)
        except RobotError:  # a shape of another kind: what was read so far counts
            continue
    return {link: np.vstack(points) for link, points in found.items()}


NAME = "masses and shapes of links"
_DENSEST = 20_000.0  # kg/m³, above tungsten; links of real robots end at 15,000
_LIGHTEST = 3.0  # kg/m³; links of real robots begin at 10
_WATER = 1000.0  # kg/m³, at which a shape that is large enough to count is weighed
_COUNTS = 1e-3  # of all that moves [kg/kg]: lighter links are placeholders of frames and sensors
_LARGE = 1e-2  # of all that moves: links whose lack of mass shows
_BEYOND = 1.5  # times |h|: 72 of 2,260 links have 1 to 1.5, as their shapes lack parts
_DUST = 1e-4  # kg·m²: less is seen in no torque
_NEAR = 0.01  # m: centres nearer to the frame show no difference
_SEVERAL, _MOST = 3, 0.8  # links, share of them: one alone may be a body with two heavy ends


@dataclass(frozen=True)
class _Solid:
    """A link that moves, what carries it, and the box low, high (3,) [m] and volume [m³] of it."""

    body: LinkBody
    joint: str
    low: Array
    high: Array
    volume: float

    @property
    def beyond(self) -> float:
        """Root mean square distance of the mass from the box's middle over half its diagonal."""
        off = self.body.centre - (self.low + self.high) / 2
        square = max(float(np.trace(self.body.spread)), 0.0) + float(off @ off)
        return float(np.sqrt(square) / np.linalg.norm((self.high - self.low) / 2))


class MisfitSolids(DescriptionCheck):
    """Masses beside the shapes of their links."""

    name = NAME

    def look(self, log: Log) -> list[CheckResult]:
        """Of all links with both."""
        return misfit_solids(log.robot)


def misfit_solids(robot: Robot) -> list[CheckResult]:
    """A doubt for each way in which masses do not fit the shapes."""
    groups = links_by_joint(robot)
    if not robot.floating:
        groups.pop("", None)  # what stands on the ground is in no torque
    bodies = {body.name: body for body in link_bodies(robot) if body.mass > 0.0}
    carried = {link: joint for joint, links in groups.items() for link in links}
    moved = sum(body.mass for name, body in bodies.items() if name in carried)
    corners = link_corners(robot)
    solids = [_solid(bodies[name], carried[name], corners[name])
              for name in carried if name in bodies and name in corners]  # fmt: skip
    heavy = [each for each in solids if each.body.mass > _COUNTS * moved]
    dense = [each for each in heavy if each.body.mass > _DENSEST * each.volume > 0.0]
    outside = [each for each in solids if _is_outside(each)]
    inside = [each for each in solids if each not in outside and each.body.mass > _LARGE * moved]
    masses = {joint: sum(bodies[link].mass for link in links if link in bodies)
              for joint, links in groups.items()}  # fmt: skip
    light = [each for each in solids if each.volume * _WATER > _LARGE * moved
             and masses[each.joint] < _LIGHTEST * each.volume]  # fmt: skip
    about = _about_frames(inside)
    return [
        *_results("density", dense, _density_words, "Is a mass in g, or a shape too small"),
        *_results("density", light, _density_words, "Is a shape in mm, or a mass missing"),
        *_results("outside_shape", outside, _outside_words, "Is it another frame, or another unit"),
        *_results("inertia_frame", about, _frame_words, "Is the inertia one about the link's frame,"
                  " where a URDF gives it about the centre of mass"),
    ]  # fmt: skip


def _solid(body: LinkBody, joint: str, corners: Array) -> _Solid:
    every = np.vstack([corners, body.joints])
    try:
        volume = float(ConvexHull(corners).volume)
    except (QhullError, ValueError):  # flat
        volume = 0.0
    return _Solid(body, joint, every.min(axis=0), every.max(axis=0), volume)


def _is_outside(solid: _Solid) -> bool:
    body, size = solid.body, float(np.linalg.norm(solid.high - solid.low))
    seen = float(np.trace(body.inertia)) / 2 + body.mass * float(body.centre @ body.centre)
    return size > 0.0 and solid.beyond > _BEYOND and seen > _DUST


def _about_frames(solids: Sequence[_Solid]) -> list[_Solid]:
    """Those with a spread of |c|² and more along c, where nearly all of the long links have it."""
    long, about = 0, []
    for each in solids:
        away, spread, even = _along(each)
        if away > max(even, _NEAR) and spread > 0.0:
            long += 1
            about += [each] if spread >= away else []
    return about if len(about) >= max(_SEVERAL, _MOST * long) else []


def _along(solid: _Solid) -> tuple[float, float, float]:
    """|c|, the spread [m] along c, and that of a body that is even between the box's ends there."""
    away = float(np.linalg.norm(solid.body.centre))
    line = solid.body.centre / max(away, 1e-9)
    spread = float(np.sqrt(max(float(line @ solid.body.spread @ line), 0.0)))
    return away, spread, float(np.abs(line) @ (solid.high - solid.low) / np.sqrt(12.0))


def _density_words(solid: _Solid) -> str:
    mass, litres = solid.body.mass, 1e3 * solid.volume
    return (
        f"density {mass / solid.volume:.3g} kg/m³ ({mass:.3g} kg in a convex hull of {litres:.3g} "
        f"l) is outside {_LIGHTEST:g} to {_DENSEST:g}"
    )


def _outside_words(solid: _Solid) -> str:
    body, half = solid.body, (solid.high - solid.low) / 2
    off = float(np.linalg.norm(body.centre - (solid.low + solid.high) / 2))
    gyration = float(np.sqrt(max(np.trace(body.spread), 0.0)))
    return (
        f"centre of mass {1e3 * off:.3g} mm off the middle of its bounding box, radius of gyration "
        f"√(tr I / 2m) {1e3 * gyration:.3g} mm, beside half the box's diagonal of "
        f"{1e3 * np.linalg.norm(half):.3g} mm"
    )


def _frame_words(solid: _Solid) -> str:
    away, spread, even = (1e3 * each for each in _along(solid))
    return (
        f"along the line from its frame to its centre of mass, {away:.3g} mm, the mass spreads by "
        f"{spread:.3g} mm, that of an even body by {even:.3g} mm"
    )


def _results(
    kind: str, solids: Sequence[_Solid], words: Callable[[_Solid], str], meant: str
) -> list[CheckResult]:
    """One doubt for all `solids`, with the figures of the heaviest; none without any."""
    if not solids:
        return []
    first = max(solids, key=lambda each: each.body.mass)
    others = [each.body.name for each in solids if each is not first]
    more = f"; and so for {few(others)}" if others else ""
    text = (
        f"{first.body.name}: {words(first)}{more}. {meant}? Correct <inertial> or the shapes in "
        "the description"
    )
    joints = tuple(dict.fromkeys(each.joint for each in solids if each.joint))
    return [CheckResult(NAME, kind, "doubt", text, joints)]
