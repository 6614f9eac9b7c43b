"""When a motion leaves a robot least room to itself and what stands around; what is near then."""

from collections.abc import Sequence

import numpy as np

from excite_cli.constraints.drawing import NearestBodies
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.excitation.problem import Problem
from excite_cli.geometry.link_meshes import Poses
from excite_cli.robot.model import Array
from excite_cli.trajectory.fade import Segment

_RATE = 100.0  # instants looked at [1/s]


def closest_time(problem: Problem, segment: Segment) -> float:
    """When [s] least is left of the distances that are kept; 0 if there are none."""
    duration = segment.trajectory.duration
    times = np.linspace(0.0, duration, max(2, int(np.ceil(duration * _RATE)) + 1))
    states = States.along(problem.kinematics, segment.trajectory, segment.coefficients, times)
    found = [
        constraint.margins(states).min(axis=1)
        for constraint in problem.constraints
        if constraint.drawing.capsules
    ]
    return float(times[int(np.argmin(np.min(found, axis=0)))]) if found else 0.0


def nearest_bodies(
    problem: Problem, poses: Poses, margins: Sequence[Array]
) -> NearestBodies | None:
    """Among all pairs of bodies that the problem keeps apart; `margins` of each constraint."""
    parts = zip(problem.constraints, margins, strict=True)
    found = [near for c, margin in parts if (near := c.nearest(poses, margin)) is not None]
    if not found:
        return None
    chosen = np.argmin([near.distances for near in found], axis=0).tolist()
    at = [(found[index], t) for t, index in enumerate(chosen)]
    return NearestBodies(
        np.array([near.distances[t] for near, t in at]),
        np.array([near.ends[t] for near, t in at]),
        tuple(near.capsules[t] for near, t in at),
        tuple(near.labels[t] for near, t in at),
    )
