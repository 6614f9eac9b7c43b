"""Where the floor of a robot is of which only the URDF is known: under what does not move.

What stands, rises from what carries it; what hangs or is bolted to a wall does not. With c_l(q) the
centre of mass [m] of limb l (all that one of the first joints carries), m_l its mass [kg] and o the
middle [m] of the box around the shapes that do not move,

    d_l = mean over postures q of c_l(q) − o,    d = Σ m_l d_l / Σ m_l        (3,) [m]

a robot stands if every limb rises (d_l,z > 0) and all together rise more than they lean out:
d_z > |(d_x, d_y)|, that is, steeper than 45°. The ratio d_z / |(d_x, d_y)| of robots that stand was
1.9 or more, of the same ones bolted to walls 0.2 or less (docs/decisions/a-floor-by-default.md).
"""

from dataclasses import dataclass

import numpy as np

from excite_cli.geometry.link_meshes import Poses
from excite_cli.geometry.link_shapes import collision_model, placed_shapes
from excite_cli.robot.carried_bodies import MovedBodies
from excite_cli.robot.model import Array, Robot

# Postures of the mean: as many as `geometry/obstacle_pairs.py` asks what meets what.
_POSTURES, _SEED = 300, 0
_DIGITS = 3  # [m] a floor is level to a millimetre at best


@dataclass(frozen=True)
class Floor:
    """`height` [m] in the world, None where the robot does not stand on one, and why, in words."""

    height: float | None
    words: str


def floor_below(robot: Robot) -> Floor:
    """The lowest point of what does not move, at the robot's posture; 0 if it has no shapes.

    None for a robot that hangs, or leans out from a wall.

    Raises
    ------
    RobotError
        A mesh cannot be used.
    """
    moved, here = MovedBodies(robot), Poses.of(robot, robot.posture[None])
    points, links, lowest = [np.zeros((0, 3))], [], []
    for item, link, local in placed_shapes(robot, collision_model(robot)):
        if not len(moved.moving(int(item.parentJoint))):
            points.append(here.points(int(item.parentJoint), local)[0])
            links.append(link)
            lowest.append(float(points[-1][:, 2].min()))
    still = np.vstack(points)
    # Without shapes the robot is bolted down where its base frame is.
    middle = (still.min(axis=0) + still.max(axis=0)) / 2 if len(still) else np.zeros(3)
    if not _stands(robot, moved, middle):
        return Floor(
            None,
            "what moves does not rise from what carries it: the robot hangs or is bolted to a "
            "wall. --floor HEIGHT gives one",
        )
    height, where = 0.0, "the plane of the world's origin, since what does not move has no shapes"
    if links:
        height = round(min(lowest), _DIGITS) + 0.0  # no -0.0
        where = f"the lowest point of what does not move ({links[int(np.argmin(lowest))]})"
    return Floor(height, f"{where}; --floor HEIGHT for another, --floor none for none")


def _stands(robot: Robot, moved: MovedBodies, middle: Array) -> bool:
    """Whether every limb rises from `middle` (3,) [m], and all together more than they lean."""
    model, poses = robot.model, Poses.of(robot, robot.draw_states(_POSTURES, _SEED)[0])
    first: dict[int, int] = {}  # of every joint that moves, the first one of its limb
    moments: dict[int, Array] = {}
    masses: dict[int, float] = {}
    for joint in range(1, model.njoints):
        if not len(moved.moving(joint)):
            continue
        limb = first[joint] = first.get(int(model.parents[joint]), joint)
        inertia = model.inertias[joint]
        centre = poses.points(joint, np.array(inertia.lever)).mean(axis=0)
        moments[limb] = moments.get(limb, np.zeros(3)) + inertia.mass * (centre - middle)
        masses[limb] = masses.get(limb, 0.0) + inertia.mass
    limbs = [moments[limb] for limb in moments if masses[limb] > 0]
    total = np.sum(limbs, axis=0) if limbs else np.zeros(3)
    rises = all(moment[2] > 0 for moment in limbs)
    return rises and bool(total[2] > np.hypot(total[0], total[1]))
