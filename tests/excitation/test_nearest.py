"""The instant at which a motion is nearest to something, against distances by coal."""

from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.load import load_spec
from excite_cli.constraints.self_collision import SelfCollision
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.excitation.nearest import closest_time, nearest_bodies
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.geometry.coal_distances import CoalDistances
from excite_cli.geometry.link_meshes import Poses
from excite_cli.trajectory.fade import Segment

AT = np.array([1.0])
CONFIG = Path(__file__).parents[2] / "configs" / "smoke.yaml"


def _moving(changes: list[str]) -> tuple[Problem, Segment]:
    problem = build_problem(load_spec(CONFIG, changes), CONFIG.parent)
    still = problem.still(problem.robot.posture)
    wild = still + 0.15 * np.random.default_rng(3).normal(size=still.shape)
    return problem, Segment("motion", problem.trajectory, wild)


@pytest.fixture(scope="module")
def moving() -> tuple[Problem, Segment]:
    return _moving([])


def test_no_other_instant_is_nearer(moving: tuple[Problem, Segment]) -> None:
    problem, segment = moving
    kept = next(each for each in problem.constraints if isinstance(each, SelfCollision))
    coal = CoalDistances(problem.robot, kept.capsules, kept.pairs.checked)
    at = closest_time(problem, segment)
    times = np.linspace(0.0, segment.trajectory.duration, 400)
    q = segment.trajectory.states(np.append(times, at), segment.coefficients)[0]
    distances = coal.distances(q).min(axis=1)
    assert distances[-1] <= distances[:-1].min() + 2e-3
    assert distances[-1] < np.median(distances) - 0.01


def test_without_distances_it_is_the_start_and_nothing_is_near() -> None:
    problem, segment = _moving(["constraints.self_collision=null"])
    assert closest_time(problem, segment) == 0.0
    states = States(problem.kinematics, *segment.trajectory.states(AT, segment.coefficients))
    margins = [constraint.margins(states) for constraint in problem.constraints]
    assert nearest_bodies(problem, Poses.of(problem.robot, states.q), margins) is None
