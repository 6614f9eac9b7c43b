import numpy as np
import pytest

from excite_cli.constraints.obstacle_clearance import Surroundings
from excite_cli.constraints.self_collision import SelfCollision
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.dynamics.whole_robot import CenterOfMass
from excite_cli.excitation.problem import Problem
from excite_cli.geometry.mesh_distances import CoalDistances
from excite_cli.trajectory.fade import Segment
from excite_cli.view.instants import Instants, instants_of

TIMES = np.linspace(0.0, 6.0, 41)


@pytest.fixture(scope="module")
def instants(problem: Problem, segment: Segment) -> Instants:
    return instants_of(problem, segment, TIMES)


@pytest.fixture(scope="module")
def states(problem: Problem, segment: Segment) -> States:
    return States.along(problem.kinematics, segment.trajectory, segment.coefficients, TIMES)


def test_the_nearest_pair_is_the_nearest(
    problem: Problem, instants: Instants, states: States
) -> None:
    nearest, found = instants.nearest, []
    for constraint in problem.constraints:
        if isinstance(constraint, SelfCollision):
            coal = CoalDistances(problem.robot, constraint.capsules, constraint.pairs.checked)
            found.append(coal.distances(states.q))
        elif isinstance(constraint, Surroundings):
            found.append(constraint.margins(states) + constraint.pairs.kept)
    assert nearest is not None
    np.testing.assert_allclose(nearest.distances, np.hstack(found).min(axis=1), atol=1e-6)
    assert len(set(nearest.labels)) > 2  # pairs of both kinds were nearest
    assert {len(capsules) for capsules in nearest.capsules} == {1, 2}


def test_the_line_is_as_long_as_the_distance_and_ends_on_the_capsules(
    problem: Problem, instants: Instants
) -> None:
    nearest = instants.nearest
    assert nearest is not None
    lengths = np.linalg.norm(nearest.ends[:, 1] - nearest.ends[:, 0], axis=1)
    np.testing.assert_allclose(lengths, np.abs(nearest.distances), atol=1e-9)
    capsules = next(c.capsules for c in problem.constraints if isinstance(c, SelfCollision))
    for t in range(len(TIMES)):
        for capsule, end in zip(nearest.capsules[t], nearest.ends[t], strict=False):
            assert capsule in capsules
            axis = instants.poses.points(capsule.joint, np.stack([capsule.start, capsule.end]))[t]
            along = axis[1] - axis[0]
            share = np.clip((end - axis[0]) @ along / max(along @ along, 1e-12), 0, 1)
            away = np.linalg.norm(end - axis[0] - share * along)
            assert away == pytest.approx(capsule.radius, abs=1e-9)


def test_margins_are_the_smallest_of_each_constraint(
    problem: Problem, instants: Instants, states: States
) -> None:
    assert [track.name for track in instants.margins] == [c.name for c in problem.constraints]
    for track, constraint in zip(instants.margins, problem.constraints, strict=True):
        margins = constraint.margins(states)
        np.testing.assert_allclose(track.shares, (margins / constraint.scale).min(axis=1))
        column = constraint.labels.index(track.labels[7])
        assert track.values[7] == margins[7, column]
        assert track.units[7] == constraint.unit_of(column)
    np.testing.assert_allclose(instants.mass, CenterOfMass(problem.robot).position(states))
    assert instants.zmp is None
    assert instants.index_at(0.29) == 2
    assert instants.index_at(99.0) == 40
