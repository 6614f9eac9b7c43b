"""Ways round obstacles, and from the robot's posture into a motion and back.

Ways are free on a finer grid, and found where brute force says there is one; programs are without
a jump, at rest at their ends, and keep all constraints.
"""

from collections import deque
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from excite_cli.config.trajectory_spec import BSplineSpec
from excite_cli.constraints.base import Array
from excite_cli.constraints.keep_out import KeepOut, Region
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.errors import ConfigError, NoAdmissibleMotionError
from excite_cli.excitation import path_search
from excite_cli.excitation.admissible import smallest_margins
from excite_cli.excitation.base_motion import base_motion
from excite_cli.excitation.connection import State, joined_states, judge_of
from excite_cli.excitation.entry import program
from excite_cli.excitation.path_search import FreeSpace, find_way, standing_margins
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.task import MotionTask
from excite_cli.trajectory.base import Trajectory
from excite_cli.trajectory.fade import Chain, Fade, Segment
from excite_cli.trajectory.point_to_point import PointToPoint
from tests.excitation.smoke import one_motion, smoke

# A table with a wall across it: the arm, low on one side, is to come down on the other.
TABLE = (
    "constraints.surroundings={floor: -0.3, margin: 0.01, boxes: "
    "{wall: {size: [0.8, 0.05, 0.8], position: [0.6, 0, 0.4]}}}"
)
ACROSS = (
    "trajectory={family: bspline, duration: 8, control_points: 16, "
    "start: {shoulder_yaw: -1.3, shoulder_pitch: 1.3, elbow: 0.4}, "
    "end: {shoulder_yaw: 1.2, shoulder_pitch: 1.3, elbow: 0.4}}"
)


def _problem(*settings: str) -> Problem:
    return smoke("sampling={}", "optimizer.max_iterations=12", *settings)


@pytest.fixture(scope="module")
def table() -> Problem:
    return _problem(TABLE, ACROSS)


def _fine(way: Array) -> Array:
    """Postures on the way, closer to each other than the search looks."""
    share = np.linspace(0.0, 1.0, 800, endpoint=False)[:, None]
    pieces = [one + share * (two - one) for one, two in pairwise(way)]
    return np.vstack([*pieces, way[-1:]])


def test_the_straight_way_is_blocked_and_the_way_found_is_clear(table: Problem) -> None:
    start, end = table.boundary.postures
    straight = standing_margins(table, _fine(np.array([start, end])))
    assert min(margin.min() for margin in straight) < -0.02
    one, again, other = (find_way(table, start, end, seed).way for seed in (0, 0, 1))
    for way in (one, other):
        assert way is not None
        assert np.array_equal(way[[0, -1]], [start, end])
        assert min(margin.min() for margin in standing_margins(table, _fine(way))) > 0.0
    assert np.array_equal(one, again), "the same seed gives the same way"
    assert not np.array_equal(one, other)
    free = find_way(table, start, start - np.array([0.2, 0.3, 0.1, 0.0, 0.0]), 1).way
    assert free is not None
    assert len(free) == 2, "a free way is straight"


def test_a_motion_round_the_wall_keeps_all_constraints(table: Problem) -> None:
    motion = one_motion(table)
    assert "surroundings" in motion.note
    assert "wall" in motion.note
    times = np.linspace(0.0, 8.0, 8001)
    assert all(m.min() >= 0 for m in smallest_margins(table, motion.coefficients, times))
    q, _, _ = table.trajectory.states(np.array([0.0, 8.0]), motion.coefficients)
    start, end = table.boundary.postures
    assert np.abs(q - [start, end]).max() < 1e-9
    chain = program(table, _standing(table, end), start)
    assert [s.name for s in chain.segments].count("entry") > 1
    _judge(table, chain, start)


def _connected(space: FreeSpace, start: Array, end: Array, cells: int) -> bool:
    """By brute force, on a grid of two joints; neighbours share a side."""
    axes = [np.linspace(space.lower[j], space.upper[j], cells) for j in range(2)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    free = space.free(grid.reshape(-1, 2)).reshape(cells, cells)
    first, last = (
        tuple(int(np.argmin(np.abs(axis - x))) for axis, x in zip(axes, posture, strict=True))
        for posture in (start, end)
    )
    seen, queue = {first}, deque([first])
    while queue:
        i, j = queue.popleft()
        for near in ((i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)):
            if min(near) >= 0 and max(near) < cells and free[near] and near not in seen:
                seen.add(near)
                queue.append(near)
    return last in seen


def test_it_finds_a_way_where_brute_force_does_and_none_where_there_is_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(path_search, "_EXTENSIONS", 800)
    plain = _problem(
        "robot.joints=[shoulder_pitch, elbow]",
        "constraints={joint_limits: {velocity: false}}",
    )
    limits = plain.robot.limits
    rng = np.random.default_rng(8)
    counts = {True: 0, False: 0}
    for seed in range(30):
        low = rng.uniform(-2.6, 2.0, (7, 2))
        size = rng.permuted(np.column_stack([np.full(7, 0.25), rng.uniform(2.0, 5.2, 7)]), axis=1)
        regions = tuple(
            Region(f"r{k}", np.arange(2), low[k], low[k] + size[k]) for k in range(len(low))
        )
        problem = replace(plain, constraints=(*plain.constraints, KeepOut(plain.robot, regions)))
        ends = rng.uniform(limits.lower, limits.upper, (2, 2))
        if min(margin.min() for margin in standing_margins(problem, ends)) < 0.04:
            continue
        wide = _connected(FreeSpace(problem, ends, 0.5), *ends, 80)
        narrow = _connected(FreeSpace(problem, ends, 0.0), *ends, 160)
        if wide == narrow and counts[wide] < 4:
            counts[wide] += 1
            assert (find_way(problem, *ends, seed).way is not None) == wide
    assert min(counts.values()) >= 2


def test_what_is_closed_off_is_told_with_what_is_between(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(path_search, "_EXTENSIONS", 150)
    band = "constraints.keep_out={band: {elbow: [0.95, 1.15]}}"
    beyond = _problem(SPLINE.format(", start: posture, end: {elbow: 1.5}"), band)
    with pytest.raises(NoAdmissibleMotionError) as error:
        base_motion(MotionTask(beyond), 1)
    for words in ("keep_out, band", "of the way", "elbow came to 0.9", "may be disconnected"):
        assert words in str(error.value)
    problem = _problem(band)
    posture = problem.robot.posture
    still = _standing(problem, posture + np.array([0.0, 0.0, 0.7, 0.0, 0.0]))
    with pytest.raises(NoAdmissibleMotionError, match=r"entry into the motion.*keep_out, band"):
        program(problem, still, posture)
    folded = posture + np.array([0.0, 1.5, 1.7, 0.0, 0.0])
    with pytest.raises(NoAdmissibleMotionError, match=r"posture of the entry.*self_collision"):
        program(problem, _standing(problem, posture), folded)


def _standing(problem: Problem, posture: Array) -> Segment:
    return Segment("motion", problem.trajectory, problem.trajectory.constant(posture))


SPLINE = "trajectory={{family: bspline, duration: 6, control_points: 14{}}}"
FAMILIES = {
    "series": "trajectory.at_rest=false",
    "series at rest": "trajectory.at_rest=true",
    "spline": SPLINE.format(""),
    "closed spline": SPLINE.format(", start: posture, end: posture"),
    "moving spline": SPLINE.format(", at_rest: false"),
}


def _motion(problem: Problem) -> Segment:
    if isinstance(problem.spec.trajectory, BSplineSpec) and not problem.trajectory.at_rest:
        # Slow enough that there is room to gather and to lose speed.
        points = 0.05 * np.random.default_rng(4).normal(size=(14, problem.robot.n))
        points[:, -1] *= 0.1
        return Segment("motion", problem.trajectory, problem.robot.posture + points)
    return Segment("motion", problem.trajectory, one_motion(problem).coefficients)


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


@pytest.mark.long
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


@pytest.mark.parametrize("jerk", [1e6, 5.0])
def test_the_quickest_polynomial_is_near_a_bound(jerk: float) -> None:
    problem = _problem("constraints.torque=null", f"constraints.joint_limits.jerk={jerk}")
    start = problem.robot.posture
    end = start + np.array([1.0, 0.2, -0.3, 0.0, 0.0])
    piece = joined_states(
        problem, judge_of(problem), "entry", State.resting(start), State.resting(end)
    )
    times = np.linspace(0.0, piece.trajectory.duration, 4001)
    _, v, a, j = piece.trajectory.orders(times, piece.coefficients)
    used = max(np.abs(v / problem.robot.limits.velocity).max(), np.abs(a).max() / 10.0)
    used = max(used, np.abs(j).max() / jerk)
    assert 1 / 1.15**3 < used <= 1.0


def test_what_does_not_close_is_not_repeated() -> None:
    problem = _problem(ACROSS)
    moving = Segment("motion", problem.trajectory, problem.boundary.offset)
    with pytest.raises(ConfigError, match="does not end as it begins"):
        program(problem, moving, problem.boundary.postures[0], periods=2)
