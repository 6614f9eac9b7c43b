"""From the robot's posture into a motion and back: no jump, at rest, all constraints kept."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.load import load_spec
from excite_cli.config.trajectory_spec import BSplineSpec
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.errors import ConfigError, NoAdmissibleMotionError
from excite_cli.excitation import path_search
from excite_cli.excitation.connection import State, joined_states, judge_of
from excite_cli.excitation.entry import program
from excite_cli.excitation.generate import generate_motion
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.excitation.solvers.interior_point import InteriorPoint
from excite_cli.excitation.stack import Stack
from excite_cli.trajectory.base import Array, Trajectory
from excite_cli.trajectory.fade import Chain, Fade, Segment
from excite_cli.trajectory.point_to_point import PointToPoint
from tests.excitation.test_path_search import ACROSS, TABLE

CONFIG = Path(__file__).parents[2] / "configs" / "smoke.yaml"
FAMILIES = {
    "series": "trajectory.at_rest=false",
    "series at rest": "trajectory.at_rest=true",
    "spline": "trajectory={family: bspline, duration: 6, control_points: 14}",
    "closed spline": "trajectory={family: bspline, duration: 6, control_points: 14, "
    "start: posture, end: posture}",
    "moving spline": "trajectory={family: bspline, duration: 6, control_points: 14, "
    "at_rest: false}",
}


def _problem(*settings: str) -> Problem:
    brief = ("sampling={}", "optimizer.max_iterations=12")
    return build_problem(load_spec(CONFIG, [*brief, *settings]), CONFIG.parent)


def _motion(problem: Problem) -> Segment:
    if isinstance(problem.spec.trajectory, BSplineSpec) and not problem.trajectory.at_rest:
        # Slow enough that there is room to gather and to lose speed.
        points = 0.05 * np.random.default_rng(4).normal(size=(14, problem.robot.n))
        points[:, -1] *= 0.1
        return Segment("motion", problem.trajectory, problem.robot.posture + points)
    solver = InteriorPoint()
    found = generate_motion(problem, solver, Stack.empty(problem.columns), 1, 1, lambda _: None)
    return Segment("motion", problem.trajectory, found.coefficients)


def _judge(problem: Problem, chain: Chain, posture: Array) -> None:
    """All that is asked of a program, on a grid of its own."""
    ends = [
        (State.of(s.trajectory, s.coefficients, 0.0),
         State.of(s.trajectory, s.coefficients, s.trajectory.duration))
        for s in chain.segments
    ]  # fmt: skip
    for (_, before), (after, _) in pairwise(ends):
        assert max(np.abs(getattr(after, x) - getattr(before, x)).max() for x in "qva") < 1e-9
    assert ends[0][0].at_rest
    assert ends[-1][1].at_rest
    assert np.abs(ends[0][0].q - posture).max() < 1e-9
    assert np.abs(ends[-1][1].q - posture).max() < 1e-9
    times = np.linspace(0.0, chain.duration, int(1000 * chain.duration))
    q, v, a = chain.states(times)
    states = States(problem.kinematics, q, v, a)
    for constraint in problem.constraints:
        assert constraint.margins(states).min() > -1e-9, constraint.name
    assert np.abs(np.gradient(q, times, axis=0)[1:-1] - v[1:-1]).max() < 1e-3


@pytest.mark.parametrize("family", FAMILIES)
def test_a_program_is_smooth_at_rest_at_its_ends_and_admissible(family: str) -> None:
    problem = _problem(FAMILIES[family])
    motion = _motion(problem)
    periods = 1 if family in ("spline", "moving spline") else 3
    other = problem.robot.posture + np.array([0.5, -0.4, 0.3, 1.0, 0.02])
    for posture in (problem.robot.posture, other):
        chain = program(problem, motion, posture, periods)
        names = [segment.name for segment in chain.segments]
        assert names.count("motion") == periods
        starts_there = family == "closed spline" and posture is problem.robot.posture
        assert (names[0] == "entry") is not starts_there
        assert (names[-1] == "return") is not starts_there
        _judge(problem, chain, posture)
    alone = program(problem, motion, other, with_return=False)
    assert alone.segments[-1] is motion


def test_a_judge_decides_and_the_motion_swells_where_no_polynomial_will_do() -> None:
    problem = _problem(FAMILIES["series"])
    motion, asked = _motion(problem), judge_of(problem)

    def no_catching_up(trajectory: Trajectory, coefficients: Array) -> str | None:
        moving = np.abs(coefficients[[1, 2, 4, 5]]).max() > 1e-9
        if isinstance(trajectory, PointToPoint) and moving:
            return "a rule of this test"
        return asked(trajectory, coefficients)

    posture = problem.robot.posture
    chain = program(problem, motion, posture, 2, judge=no_catching_up)
    fades = [s for s in chain.segments if isinstance(s.trajectory, Fade)]
    assert [s.name for s in fades] == ["entry", "return"]
    _judge(problem, chain, posture)
    with pytest.raises(NoAdmissibleMotionError, match="No admissible entry"):
        program(problem, motion, posture, judge=lambda *_: "a rule of this test")


def test_the_quickest_polynomial_is_near_a_bound() -> None:
    problem = _problem("constraints.torque=null")
    start = problem.robot.posture
    end = start + np.array([1.0, 0.2, -0.3, 0.0, 0.0])
    piece = joined_states(
        problem, judge_of(problem), "entry", State.resting(start), State.resting(end)
    )
    times = np.linspace(0.0, piece.trajectory.duration, 4001)
    _, v, a = piece.trajectory.states(times, piece.coefficients)
    used = max(np.abs(v / problem.robot.limits.velocity).max(), np.abs(a).max() / 10.0)
    assert 1 / 1.15**2 < used <= 1.0


def test_an_entry_goes_round_a_wall() -> None:
    problem = _problem(TABLE, ACROSS)
    start, end = problem.boundary.postures
    still = Segment("motion", problem.trajectory, problem.trajectory.constant(end))
    chain = program(problem, still, start)
    assert [s.name for s in chain.segments].count("entry") > 1
    _judge(problem, chain, start)


def test_a_closed_off_motion_is_not_entered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(path_search, "_EXTENSIONS", 100)
    problem = _problem("constraints.keep_out={band: {elbow: [0.95, 1.15]}}")
    beyond = problem.robot.posture + np.array([0.0, 0.0, 0.7, 0.0, 0.0])
    still = Segment("motion", problem.trajectory, problem.trajectory.constant(beyond))
    with pytest.raises(NoAdmissibleMotionError, match=r"entry into the motion.*keep_out, band"):
        program(problem, still, problem.robot.posture)


def test_a_posture_in_collision_is_named() -> None:
    problem = _problem()
    still = Segment("m", problem.trajectory, problem.trajectory.constant(problem.robot.posture))
    folded = problem.robot.posture + np.array([0.0, 1.5, 1.7, 0.0, 0.0])
    with pytest.raises(NoAdmissibleMotionError, match=r"posture of the entry.*self_collision"):
        program(problem, still, folded)


def test_what_does_not_close_is_not_repeated() -> None:
    problem = _problem(ACROSS)
    moving = Segment("motion", problem.trajectory, problem.boundary.offset)
    with pytest.raises(ConfigError, match="does not end as it begins"):
        program(problem, moving, problem.boundary.postures[0], periods=2)
