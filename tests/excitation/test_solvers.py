"""How good a motion the solver finds, and corrections of motions that are slightly broken."""

from dataclasses import replace

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from excite_cli.config.load_spec import parse_spec
from excite_cli.constraints.base import Array
from excite_cli.excitation.base_motion import (
    chosen_rows,
    corrected,
    dips,
    gathered,
    least_distance,
    lowest,
)
from excite_cli.excitation.motion import Outcome
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.excitation.progress import Progress, ProgressMeasure, Status
from excite_cli.excitation.solvers.base import Effort
from excite_cli.excitation.solvers.interior_point import InteriorPoint, damped_update
from excite_cli.excitation.start import clear_posture, random_start
from excite_cli.excitation.task import REACH, MotionTask
from tests.excitation.smoke import task_of

PANDA = """
robot:
  urdf: example-robot-data:panda
  joints: [panda_joint1, panda_joint2, panda_joint3, panda_joint4, panda_joint5, panda_joint6,
           panda_joint7]
  posture: {panda_finger_joint1: 0.001, panda_joint2: -0.7854, panda_joint4: -2.3562,
            panda_joint6: 0.821, panda_joint7: 1.502}
trajectory: {harmonics: 12, base_frequency: 0.628319}
sampling: {constraints: {samples: 200}}
constraints:
  joint_limits: {acceleration: 10.0}
  torque: {scale: 0.8}
  self_collision: {capsules: auto, margin: 0.01}
"""
UR10 = """
robot: {urdf: example-robot-data:ur10}
trajectory: {harmonics: 3}
sampling: {cost: {samples: 20, step: 0.4}, constraints: {samples: 80, step: 0.1}}
constraints: {joint_limits: {acceleration: 4.0}, torque: {scale: 0.8}}
"""


@pytest.fixture(scope="module")
def problem() -> Problem:
    return build_problem(parse_spec(UR10))


def start(task: MotionTask, seed: int = 1) -> Array:
    return random_start(task, clear_posture(task, seed), (seed, 1, 0))


def solved(
    task: MotionTask, iterations: int = 25, seconds: float = 60.0
) -> tuple[Outcome, list[Progress]]:
    seen: list[Progress] = []
    effort = Effort(iterations, seconds, 1e-3)
    outcome = InteriorPoint().solve(task, start(task), effort, seen.append)
    assert lowest(task.values(task.states(outcome.x))) > 0
    return outcome, seen


def condition_number(task: MotionTask, x: Array) -> float:
    return task.objective.stacked_condition_number(task.coefficients(x))


def test_max_iterations_and_progress(problem: Problem) -> None:
    outcome, seen = solved(MotionTask(problem), iterations=5)
    assert outcome.iterations == 5
    assert outcome.status is Status.ITERATION_LIMIT
    assert [progress.iteration for progress in seen] == [1, 2, 3, 4, 5]
    assert all(1 <= progress.stage.number <= progress.stage.total for progress in seen)
    assert {progress.figure.measure for progress in seen} == {ProgressMeasure.CONDITION_NUMBER}
    again, _ = solved(MotionTask(problem), iterations=5)
    np.testing.assert_array_equal(outcome.x, again.x)


def test_no_time_at_all_still_gives_an_admissible_outcome(problem: Problem) -> None:
    assert solved(MotionTask(problem), seconds=0.02)[0].status is Status.TIME_LIMIT


# Condition numbers that SciPy's SLSQP reached on working sets, from the same start, after so many
# iterations (1 December 2026; docs/decisions/interior-point-solver.md).
OF_SLSQP = {25: 14.14, 120: 10.00}


@pytest.mark.parametrize("iterations", OF_SLSQP)
def test_a_motion_is_nearly_as_good_as_another_solver_finds(
    problem: Problem, iterations: int
) -> None:
    task = MotionTask(problem)
    outcome, seen = solved(task, iterations)
    found = condition_number(task, outcome.x)
    assert found <= 1.0001 * min(progress.figure.value for progress in seen)
    assert found < 1.25 * OF_SLSQP[iterations] < 0.2 * condition_number(task, start(task))


def test_second_motion_improves_on_its_stack(problem: Problem) -> None:
    first = MotionTask(problem)
    block = first.objective.block(first.coefficients(solved(first, 15)[0].x))
    stack = Stack.empty(problem.base.rank).with_rows(block)
    second = MotionTask(problem, stack)
    outcome, _ = solved(second, 15)
    alone = np.linalg.svd(stack.factor, compute_uv=False)
    assert condition_number(second, outcome.x) < alone[0] / alone[-1]


def test_damped_update_stays_positive_definite() -> None:
    for seed in range(5):
        rng, hessian = np.random.default_rng(seed), np.eye(6)
        for _ in range(20):
            hessian = damped_update(hessian, rng.normal(size=6), rng.normal(size=6))
            assert np.linalg.eigvalsh(hessian).min() > 0


def test_stages_that_are_run_one_by_one_lead_as_far_as_all_at_once(problem: Problem) -> None:
    solver, task = InteriorPoint(), MotionTask(problem)
    effort = Effort(400, 60.0, 1e-3)
    whole = solver.solve(task, start(task), effort, lambda told: None)
    first = solver.solve(task, start(task), replace(effort, last=3), lambda told: None)
    assert first.last is not None
    assert condition_number(task, first.x) > condition_number(task, whole.x)
    second = solver.solve(
        task, first.last, replace(effort, first=3), lambda told: None, first.memory
    )
    assert condition_number(task, second.x) == pytest.approx(
        condition_number(task, whole.x), rel=0.05
    )


@pytest.mark.long
def test_motions_pass_where_a_constraint_bends_along_the_way() -> None:
    """Panda's fifth and seventh links are within 5 mm of their margin nearly everywhere.

    With curvature of the criterion alone this start ended at 20.9.
    """
    task = MotionTask(build_problem(parse_spec(PANDA)))
    effort = Effort(1000, 60.0, 1e-3)
    with threadpool_limits(1):
        found = InteriorPoint().solve(task, start(task, 1), effort, lambda told: None)
    assert condition_number(task, found.x) < 9.5


def test_chosen_rows_match_differences() -> None:
    task = task_of("constraints.joint_limits.jerk=50")
    x = random_start(task, clear_posture(task, 1), (1, 1, 0))
    direction = np.random.default_rng(3).normal(size=task.size)
    states = task.states(x)
    near = [value < REACH for value in task.values(states)]
    assert all(mask.any() for mask in near)
    h = 1e-6
    ahead, behind = (task.values(task.states(x + s * h * direction)) for s in (1, -1))
    differences = [(a - b) / (2 * h) for a, b in zip(ahead, behind, strict=True)]
    found = chosen_rows(task, states, near) @ direction
    np.testing.assert_allclose(found, gathered(differences, near), atol=1e-6)


def test_a_slightly_broken_motion_is_brought_inside() -> None:
    task = task_of()
    x = random_start(task, clear_posture(task, 1), (1, 1, 0))
    resting = task.variables(task.problem.still(task.problem.robot.posture))
    share = next(s for s in np.arange(1.0, 3.0, 0.02)
                 if lowest(task.values(task.states(resting + s * (x - resting)))) < 0)  # fmt: skip
    broken = resting + share * (x - resting)
    mended = corrected(task, broken)
    assert mended is not None
    assert lowest(task.values(task.states(mended))) > 0
    assert np.linalg.norm(mended - broken) < 0.1 * np.linalg.norm(broken - resting)


def test_least_distance_is_the_projection_onto_the_rows() -> None:
    rows = np.array([[1.0, 0.0], [1.0, 1.0], [0.0, -1.0]])
    found = least_distance(rows, np.array([0.5, 1.0, -2.0]))
    assert found is not None
    np.testing.assert_allclose(found, [0.5, 0.5], atol=1e-12)
    inside = least_distance(rows, np.array([-1.0, -1.0, -1.0]))
    assert inside is not None
    np.testing.assert_allclose(inside, 0.0, atol=1e-12)
    assert least_distance(np.array([[1.0, 0.0], [-1.0, 0.0]]), np.ones(2)) is None


def test_dips_are_found_at_the_ends_too() -> None:
    value = np.array([[0.0], [1.0], [0.5], [0.7], [0.2]])
    np.testing.assert_array_equal(dips(value)[:, 0], [True, False, True, False, True])
