"""Links as no such robot has them: far too heavy or light, centre or mass outside of the link.

    mass      more than three times the URDF's, or less than a third
    centre    outside of the link's box by more than two standard deviations
    gyration  √(tr I / 2m), the root mean square distance of the mass from the joint's frame, beyond
              the farthest corner of this box by more than two standard deviations

A mass needs no deviation: the set stands as near to the URDF as the data allow
(`consistent_near_prior`), so that a link far from it was held there, and the data did not let it.

The box spans the frame, the joints and links that the body carries, the URDF's centre of mass, and
the shapes of the URDF (collision, else visual). Where there are no shapes it is wider by a length
of the body on all sides. Shapes are only loaded if a link is outside of the box without them. What
the URDF itself has is not marked.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from excite_cli.dynamics.pseudo_inertia import InertialPrior, body_lengths
from excite_cli.errors import RobotError
from excite_cli.geometry.link_shapes import collision_model, link_shapes, visual_model
from excite_cli.identification.link_changes import LinkChange
from excite_cli.measurement.dataset import Finding
from excite_cli.robot.model import Array, Robot

_TIMES = 3.0  # the URDF's mass, or as small a part of it
_SURELY = 2.0  # standard deviations
_LEAST_MASS = 1e-9  # kg
_NAMED = 3  # links in the warning; the table has all


@dataclass(frozen=True)
class _Box:
    """Corners low and high (3,) [m] in the frame of a body's joint."""

    low: Array
    high: Array

    @property
    def reach(self) -> float:
        """Distance of the farthest corner from the frame's origin [m]."""
        return float(np.linalg.norm(np.maximum(np.abs(self.low), np.abs(self.high))))


def marked(
    robot: Robot,
    links: Sequence[LinkChange],
    phi: Array,
    covariance: Array,
    prior: InertialPrior,
) -> tuple[LinkChange, ...]:
    """`links`, one per body of φ (P,), with their `marks`."""
    bodies = range(len(links))
    radii, usual = _gyrations(phi), _gyrations(prior.mean)
    spreads = [_gyration_std(phi, covariance, body) for body in bodies]

    def outside(boxes: Sequence[_Box]) -> list[list[str]]:
        reaches = np.maximum([box.reach for box in boxes], usual)
        found = zip(links, boxes, radii, spreads, reaches, strict=True)
        return [[*_centre_mark(*each[:2]), *_gyration_mark(*each[2:])] for each in found]

    narrow = [_box(robot, body, prior.mean) for body in bodies]
    marks = outside(narrow)
    if any(marks):
        marks = outside(_with_shapes(robot, narrow, prior.mean))
    return tuple(
        replace(link, marks=(*_mass_mark(link), *own))
        for link, own in zip(links, marks, strict=True)
    )


def implausible(links: Sequence[LinkChange], inertias: str, joints: Sequence[str]) -> list[Finding]:
    """One warning for all links that are marked; `inertias` as the fit took them."""
    found = [link for link in links if link.marks]
    if not found:
        return []
    which = "; ".join(f"{link.link}: {', '.join(link.marks)}" for link in found[:_NAMED])
    more = f"; and {len(found) - _NAMED} more" if len(found) > _NAMED else ""
    kept = "" if inertias == "cad" else "; identification.inertias: cad keeps it near the URDF"
    text = (
        f"no such robot has these links: {which}{more}. The fit puts into them what the declared "
        "model lacks (`excite diagnose` looks for it), a tool that is not in the URDF "
        f"(robot.payload) or a wrong scale of the torques{kept}."
    )
    carried = tuple(link.joint for link in found if link.joint in joints)
    return [Finding("implausible_link", "warning", text, "", carried)]


def _mass_mark(link: LinkChange) -> list[str]:
    mass = link.mass
    if mass.before <= _LEAST_MASS or 1.0 / _TIMES <= mass.after / mass.before <= _TIMES:
        return []
    share = mass.after / mass.before
    found = "next to none" if share < 0.01 else f"{mass.after:.3g} kg"
    return [f"mass {found} where the URDF has {mass.before:.3g} kg"]


def _centre_mark(link: LinkChange, box: _Box) -> list[str]:
    after, std = (np.array([getattr(c, name) for c in link.center]) for name in ("after", "std"))
    beyond = np.abs(after - np.clip(after, box.low, box.high))
    sure = np.where(beyond > _SURELY * std, beyond, 0.0)
    if not sure.any():
        return []
    k = int(sure.argmax())
    return [
        f"centre of mass at {'xyz'[k]} = {1e3 * after[k]:.0f} ± {1e3 * std[k]:.0f} mm, "
        f"{1e3 * sure[k]:.0f} mm outside of the link"
    ]


def _gyration_mark(radius: float, std: float, reach: float) -> list[str]:
    if radius - _SURELY * std <= reach:
        return []
    return [
        f"radius of gyration {1e3 * radius:.0f} ± {1e3 * std:.0f} mm about its joint, where "
        f"the link ends after {1e3 * reach:.0f} mm"
    ]


def _gyrations(phi: Array) -> Array:
    """√(tr I / 2m) (bodies,) [m] about the joint's frame; 0 of what has no mass."""
    bodies = phi.reshape(-1, 10)
    mass, trace = bodies[:, 0], bodies[:, [4, 6, 9]].sum(axis=1)
    square = np.where(mass > _LEAST_MASS, trace / 2.0 / np.maximum(mass, _LEAST_MASS), 0.0)
    return np.asarray(np.sqrt(np.maximum(square, 0.0)))


def _gyration_std(phi: Array, covariance: Array, body: int) -> float:
    """Standard deviation [m] of a body's radius of gyration, to first order."""
    at = 10 * body + np.array([0, 4, 6, 9])
    radius = float(_gyrations(phi)[body])
    # As with centres, at a mass that is not less than its deviation.
    sure = max(float(phi[at[0]]), _LEAST_MASS, float(np.sqrt(covariance[at[0], at[0]])))
    slope = np.append(-radius / 2.0, np.full(3, 0.25 / max(radius, 1e-9))) / sure
    return float(np.sqrt(slope @ covariance[np.ix_(at, at)] @ slope))


def _box(robot: Robot, body: int, cad: Array) -> _Box:
    """Of the frame, of what the body carries, and of the URDF's centre of mass."""
    joint, model = body + 1, robot.model
    points = [np.zeros(3)]
    points += [
        np.array(model.jointPlacements[child].translation)
        for child in range(1, model.njoints)
        if int(model.parents[child]) == joint
    ]
    points += [np.array(f.placement.translation) for f in model.frames if f.parentJoint == joint]
    if cad[10 * body] > _LEAST_MASS:
        points.append(cad[10 * body + 1 : 10 * body + 4] / cad[10 * body])
    return _Box(np.min(points, axis=0), np.max(points, axis=0))


def _with_shapes(robot: Robot, boxes: Sequence[_Box], cad: Array) -> list[_Box]:
    """Boxes that hold the links' shapes, or are wider by a body's length where there are none."""
    points: dict[int, list[Array]] = {}
    for of_kind in (collision_model, visual_model):
        if len(points) == len(boxes):
            break
        try:
            shapes = link_shapes(robot, of_kind(robot))
        except RobotError:  # meshes that are missing are none of a fit's business
            continue
        own: dict[int, list[Array]] = {}
        for shape in shapes:
            own.setdefault(shape.joint - 1, []).append(shape.points)
        points = {**own, **points}
    wider = []
    for body, (box, length) in enumerate(zip(boxes, body_lengths(robot, cad), strict=True)):
        corners = [box.low - length, box.high + length]
        if body in points:
            corners = [box.low, box.high, *points[body]]
        every = np.vstack(corners)
        wider.append(_Box(every.min(axis=0), every.max(axis=0)))
    return wider
