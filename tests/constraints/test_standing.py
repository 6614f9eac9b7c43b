"""What holds at a motion's own speed and standing still holds at any speed between."""

import numpy as np
import pytest

from excite_cli.api.loading import load_problem
from excite_cli.constraints.base import Constraint
from excite_cli.dynamics.forward_kinematics import BatchKinematics, States
from excite_cli.excitation.admissible import verdicts
from excite_cli.excitation.problem import Problem
from excite_cli.proof.enclosed_motion import EnclosedMotion, enclosed_states, intervals_of
from tests.excitation.smoke import CONFIG

OF_FORCES = {"joint_torque", "zmp", "contact"}
QUICK = ["constraints.self_collision=null", "constraints.any_speed=true"]
TALOS = CONFIG.with_name("talos_base.yaml")


@pytest.fixture(scope="module", params=["uncertain", "as in the URDF"])
def problem(request: pytest.FixtureRequest) -> Problem:
    """A humanoid on its feet."""
    more = [] if request.param == "uncertain" else ["uncertainty=null"]
    return load_problem(TALOS, [*QUICK, *more])


def both(problem: Problem) -> list[tuple[Constraint, Constraint]]:
    """Constraints of forces, each with that of the standing robot."""
    by_name = {each.name: each for each in problem.constraints}
    return [(by_name[name], by_name[f"{name}_standing"]) for name in sorted(OF_FORCES)]


def test_only_what_is_about_forces_is_asked_of_the_standing_robot(problem: Problem) -> None:
    names = [each.name for each in problem.constraints]
    standing = {f"{name}_standing" for name in OF_FORCES}
    assert {name for name in names if name.endswith("_standing")} == standing
    plain = [each.name for each in load_problem(TALOS, QUICK[:1]).constraints]
    assert [name for name in names if name not in standing] == plain
    found = verdicts(problem, problem.still(problem.robot.posture))
    states = {each.name: each.state for each in found}
    assert all(states[name] == "proved" for name in standing), "standing still is proved"


def test_slower_motions_keep_what_the_motion_and_the_standing_robot_keep(
    problem: Problem,
) -> None:
    """Joint torques are never worse than the worse of both; zero moment points keep their sign."""
    rng = np.random.default_rng(4)
    q, v, a = problem.robot.draw_states(200, 4)
    q = problem.robot.posture + 0.5 * (q - problem.robot.posture)
    v, a = 0.3 * v, 0.3 * a
    kinematics = BatchKinematics(problem.robot)
    for constraint, standing in both(problem):
        own, still = (
            constraint.margins(States(kinematics, q, *rates)) for rates in ((v, a), (0 * v, 0 * a))
        )
        np.testing.assert_allclose(standing.margins(States(kinematics, q, v, a)), still)
        for s in rng.uniform(size=5):
            slowed = constraint.margins(States(kinematics, q, s * v, s * s * a))
            if constraint.name == "joint_torque":
                assert np.all(slowed > np.minimum(own, still) - 1e-9)
            kept = (own >= 0.0).all(axis=1) & (still >= 0.0).all(axis=1)
            assert kept.any()
            assert np.all(slowed[kept] > -1e-9)


def test_bounds_over_intervals_are_those_of_the_standing_robot(problem: Problem) -> None:
    """Never above the margins within, and hardly below those of torques, over 0.2 ms."""
    rng = np.random.default_rng(1)
    still = problem.still(problem.robot.posture)
    moved = still + 0.02 * rng.normal(size=still.shape)
    intervals = intervals_of(problem.trajectory, 2e-4).only(slice(0, None, 1000))
    states = enclosed_states(problem.trajectory, moved, intervals)
    motion = EnclosedMotion(problem.robot, states)
    q, v, a = problem.trajectory.states(intervals.middles, moved)
    assert np.abs(a).max() > 1.0
    middle = States(BatchKinematics(problem.robot), q, v, a)
    for constraint, standing in both(problem):
        bounds, margins = standing.least(motion), standing.margins(middle)
        assert bounds is not None
        assert np.all(margins[bounds >= 0.0] >= 0.0)
        if constraint.name == "joint_torque":
            assert np.all(bounds <= margins + 1e-9)
            np.testing.assert_allclose(bounds, margins, atol=0.05)  # N·m
            own = constraint.least(motion)
            assert own is not None
            assert np.abs(own - bounds).max() > 1.0
