"""A motion at some instants: where everything is, what is nearest, and what margins are left."""

from dataclasses import dataclass

import numpy as np

from excite_cli.constraints.base import Constraint
from excite_cli.constraints.ground_contact import ZeroMomentPoint
from excite_cli.constraints.obstacle_clearance import Surroundings
from excite_cli.constraints.self_collision import SelfCollision
from excite_cli.dynamics.center_of_mass import CenterOfMass
from excite_cli.dynamics.states import States
from excite_cli.dynamics.whole_robot import whole_parameters
from excite_cli.excitation.problem import Problem
from excite_cli.geometry.link_meshes import Poses
from excite_cli.geometry.segments import nearest_points, normals
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.model import Array
from excite_cli.trajectory.chain import Segment


@dataclass(frozen=True, eq=False)
class NearestPair:
    """The pair of capsules, or of a capsule and a thing around, that is nearest at each instant.

    distances (T,) [m], negative where they overlap; ends (T, 2, 3) [m], the points between which
    the distance is; capsules: indices of the one or two capsules; labels: T texts.
    """

    distances: Array
    ends: Array
    capsules: tuple[tuple[int, ...], ...]
    labels: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class MarginTrack:
    """The smallest margin of one constraint at each instant.

    values (T,) in `units` (T texts), below zero where it is broken; shares (T,) of the scale of
    their column; labels: which column that is (T texts).
    """

    name: str
    values: Array
    shares: Array
    units: tuple[str, ...]
    labels: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Instants:
    """A motion at T instants.

    times (T,) [s]; q (T, n); poses of all joints; mass (T, 3), the centre of mass [m];
    zmp (T, 2) [m] or None without a contact constraint; nearest: None where the problem keeps no
    distances.
    """

    name: str
    times: Array
    q: Array
    poses: Poses
    mass: Array
    zmp: Array | None
    nearest: NearestPair | None
    margins: tuple[MarginTrack, ...]

    def index_at(self, time: float) -> int:
        """The instant nearest to `time` [s]."""
        return int(np.argmin(np.abs(self.times - time)))


def instants_of(problem: Problem, segment: Segment, times: Array) -> Instants:
    """Everything that is shown of a motion at `times` (T,) [s]."""
    states = States(problem.kinematics, *segment.trajectory.states(times, segment.coefficients))
    poses = Poses.of(problem.robot, states.q)
    margins = [constraint.margins(states) for constraint in problem.constraints]
    return Instants(
        name=segment.name,
        times=times,
        q=states.q,
        poses=poses,
        mass=CenterOfMass(problem.robot).position(states),
        zmp=_zero_moment_points(problem, states),
        nearest=_nearest(problem, poses, margins),
        margins=tuple(
            _track(constraint, margin)
            for constraint, margin in zip(problem.constraints, margins, strict=True)
        ),
    )


def closest_time(problem: Problem, segment: Segment, rate: float = 100.0) -> float:
    """When [s] the robot comes nearest to itself or to what stands around; 0 if nothing tells."""
    duration = segment.trajectory.duration
    times = np.linspace(0.0, duration, max(2, int(np.ceil(duration * rate)) + 1))
    states = States(problem.kinematics, *segment.trajectory.states(times, segment.coefficients))
    found = [
        constraint.margins(states).min(axis=1)
        for constraint in problem.constraints
        if isinstance(constraint, SelfCollision | Surroundings)
    ]
    return float(times[int(np.argmin(np.min(found, axis=0)))]) if found else 0.0


def _track(constraint: Constraint, margins: Array) -> MarginTrack:
    shares = margins / constraint.scale
    columns = np.argmin(shares, axis=1)
    at = (np.arange(len(margins)), columns)
    return MarginTrack(
        constraint.name,
        margins[at],
        shares[at],
        tuple(constraint.unit_of(int(column)) for column in columns),
        tuple(constraint.labels[int(column)] for column in columns),
    )


def _zero_moment_points(problem: Problem, states: States) -> Array | None:
    """With the inertias of the URDF."""
    for constraint in problem.constraints:
        if isinstance(constraint, ZeroMomentPoint):
            wrench = constraint.ground.wrench.regressor(states) @ whole_parameters(problem.robot)
            load = np.where(np.abs(wrench[:, 2]) > 1e-9, wrench[:, 2], np.nan)
            height = constraint.height
            x = -(wrench[:, 4] - height * wrench[:, 0]) / load
            y = (wrench[:, 3] + height * wrench[:, 1]) / load
            return np.column_stack([x, y])
    return None


def _nearest(problem: Problem, poses: Poses, margins: list[Array]) -> NearestPair | None:
    """Among all pairs of capsules and things that the problem keeps apart."""
    count = len(poses)
    distances, ends, labels = np.full(count, np.inf), np.zeros((count, 2, 3)), [""] * count
    capsules: list[tuple[int, ...]] = [()] * count
    for constraint, margin in zip(problem.constraints, margins, strict=True):
        if isinstance(constraint, SelfCollision):
            found = margin + constraint.margin
        elif isinstance(constraint, Surroundings):
            found = margin + constraint.pairs.kept
        else:
            continue
        columns = found.argmin(axis=1)
        least = found[np.arange(count), columns]
        for t in np.flatnonzero(least < distances):
            i, j = constraint.pairs.checked[int(columns[t])]
            start, along = _axis(poses, constraint.capsules[i], int(t))
            radius = constraint.capsules[i].radius
            if isinstance(constraint, Surroundings):
                contact = constraint.obstacles[j].contacts(start, along)
                normal = contact.normal[:, 0]
                on_axis = start[:, 0] + float(contact.share[0]) * along[:, 0]
                ends[t] = on_axis - radius * normal, on_axis - float(contact.distance[0]) * normal
                capsules[t] = (i,)
            else:
                other, other_along = _axis(poses, constraint.capsules[j], int(t))
                near = nearest_points(start, along, other, other_along)
                normal = normals(near, along, other_along)[:, 0]
                first = start[:, 0] + float(near.share_first[0]) * along[:, 0]
                second = first + near.gap[:, 0]
                ends[t] = first + radius * normal, second - constraint.capsules[j].radius * normal
                capsules[t] = (i, j)
            distances[t] = least[t]
            labels[t] = constraint.labels[int(columns[t])]
    if not np.isfinite(distances).all():
        return None
    return NearestPair(distances, ends, tuple(capsules), tuple(labels))


def _axis(poses: Poses, capsule: Capsule, instant: int) -> tuple[Array, Array]:
    """Start and the vector to the end (3, 1) of a capsule's axis in the world."""
    rotation = poses.rotations[instant, capsule.joint]
    start = rotation @ capsule.start + poses.translations[instant, capsule.joint]
    return start[:, None], (rotation @ (capsule.end - capsule.start))[:, None]
