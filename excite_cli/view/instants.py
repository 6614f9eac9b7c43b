"""A motion at some instants: where everything is, what is nearest, and what margins are left."""

from dataclasses import dataclass

import numpy as np

from excite_cli.constraints.base import Constraint
from excite_cli.constraints.drawing import NearestBodies
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.dynamics.whole_robot import CenterOfMass
from excite_cli.excitation.nearest import nearest_bodies
from excite_cli.excitation.problem import Problem
from excite_cli.geometry.link_meshes import Poses
from excite_cli.robot.model import Array
from excite_cli.trajectory.fade import Segment


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
    nearest: NearestBodies | None
    margins: tuple[MarginTrack, ...]

    def index_at(self, time: float) -> int:
        """The instant nearest to `time` [s]."""
        return int(np.argmin(np.abs(self.times - time)))


def instants_of(problem: Problem, segment: Segment, times: Array) -> Instants:
    """Everything that is shown of a motion at `times` (T,) [s]."""
    states = States.along(problem.kinematics, segment.trajectory, segment.coefficients, times)
    poses = Poses.of(problem.robot, states.q)
    margins = [constraint.margins(states) for constraint in problem.constraints]
    return Instants(
        name=segment.name,
        times=times,
        q=states.q,
        poses=poses,
        mass=CenterOfMass(problem.robot).position(states),
        zmp=_ground_points(problem, states),
        nearest=nearest_bodies(problem, poses, margins),
        margins=tuple(
            _track(constraint, margin)
            for constraint, margin in zip(problem.constraints, margins, strict=True)
        ),
    )


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


def _ground_points(problem: Problem, states: States) -> Array | None:
    found = (constraint.ground_point(states) for constraint in problem.constraints)
    return next((points for points in found if points is not None), None)
