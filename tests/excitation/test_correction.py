import numpy as np

from excite_cli.config.load import load_spec
from excite_cli.excitation.correction import (
    chosen_rows,
    corrected,
    dips,
    gathered,
    least_distance,
    lowest,
)
from excite_cli.excitation.problem import build_problem
from excite_cli.excitation.residuals import REACH
from excite_cli.excitation.start import clear_posture, random_start
from excite_cli.excitation.task import MotionTask
from tests.cli.program import SMOKE


def _task() -> MotionTask:
    return MotionTask(build_problem(load_spec(SMOKE), SMOKE.parent))


def test_chosen_rows_match_differences() -> None:
    task = _task()
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
    task = _task()
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
