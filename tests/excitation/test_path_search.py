"""Ways round obstacles: free on a finer grid, and found where brute force says there is one."""

from collections import deque
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.load import load_spec
from excite_cli.constraints.base import Array
from excite_cli.constraints.keep_out import KeepOut, Region
from excite_cli.errors import NoAdmissibleMotionError
from excite_cli.excitation import path_search
from excite_cli.excitation.admissible import smallest_margins
from excite_cli.excitation.base_motion import base_motion
from excite_cli.excitation.generate import generate_motion
from excite_cli.excitation.path_search import FreeSpace, find_way, standing_margins
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.excitation.solvers.interior_point import InteriorPoint
from excite_cli.excitation.stack import Stack
from excite_cli.excitation.task import MotionTask

CONFIG = Path(__file__).parents[2] / "configs" / "smoke.yaml"
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
BRIEF = ("sampling={}", "optimizer.max_iterations=15")


def _problem(*settings: str) -> Problem:
    return build_problem(load_spec(CONFIG, [*BRIEF, *settings]), CONFIG.parent)


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
    for seed in range(2):
        way = find_way(table, start, end, seed).way
        assert way is not None
        assert np.array_equal(way[[0, -1]], [start, end])
        assert min(margin.min() for margin in standing_margins(table, _fine(way))) > 0.0


def test_the_same_seed_gives_the_same_way(table: Problem) -> None:
    start, end = table.boundary.postures
    one, again, other = (find_way(table, start, end, seed).way for seed in (4, 4, 5))
    assert one is not None
    assert again is not None
    assert np.array_equal(one, again)
    assert not np.array_equal(one, other)


def test_a_free_way_is_straight(table: Problem) -> None:
    start = table.boundary.postures[0]
    near = start - np.array([0.2, 0.3, 0.1, 0.0, 0.0])
    search = find_way(table, start, near, 1)
    assert search.way is not None
    assert len(search.way) == 2


def test_a_motion_round_the_wall_keeps_all_constraints(table: Problem) -> None:
    solver = InteriorPoint()
    motion = generate_motion(table, solver, Stack.empty(table.columns), 1, 1, lambda _: None)
    assert "surroundings" in motion.note
    assert "wall" in motion.note
    times = np.linspace(0.0, 8.0, 8001)
    assert all(m.min() >= 0 for m in smallest_margins(table, motion.coefficients, times))
    q, _, _ = table.trajectory.states(np.array([0.0, 8.0]), motion.coefficients)
    assert np.abs(q - table.boundary.postures).max() < 1e-9


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


def test_a_closed_off_posture_is_told_with_what_is_between(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(path_search, "_EXTENSIONS", 150)
    spline = (
        "trajectory={family: bspline, duration: 6, control_points: 14, start: posture, "
        "end: {elbow: 1.5}}"
    )
    task = MotionTask(_problem(spline, "constraints.keep_out={band: {elbow: [0.95, 1.15]}}"))
    with pytest.raises(NoAdmissibleMotionError) as error:
        base_motion(task, 1)
    for words in ("keep_out, band", "of the way", "elbow came to 0.9", "may be disconnected"):
        assert words in str(error.value)
