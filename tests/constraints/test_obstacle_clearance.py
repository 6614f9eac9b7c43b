"""Floor, walls and boxes: gradients, bounds, reasons, and what a motion does with and without."""

from functools import cache

import numpy as np
import pytest

from excite_cli.constraints.obstacle_clearance import Surroundings
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.errors import NoAdmissibleMotionError
from excite_cli.excitation.admissible import fine_times, worst_margins
from excite_cli.excitation.motion import Motion
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.start import clear_posture
from excite_cli.excitation.task import MotionTask
from tests.constraints.test_gradients import check_gradients
from tests.excitation.smoke import one_motion, smoke
from tests.geometry.obstacle_worlds import coal_distances

AROUND = (
    "constraints.surroundings={floor: 0.0, margin: 0.02, "
    "walls: {wall: {point: [-0.5, 0, 0], normal: [1, 0.2, 0]}}, "
    "boxes: {table: {size: [0.5, 1.2, 0.04], position: [0.55, 0, 0.3]}, "
    "shelf: {size: [0.3, 0.3, 0.3], position: [0, 0.7, 0.7], orientation: [0.3, 0.2, 0.6]}}}"
)


def _problem(*settings: str) -> Problem:
    return smoke("optimizer.max_iterations=40", "sequence.motions=1", *settings)


@cache
def _around() -> tuple[Problem, Surroundings]:
    problem = _problem(AROUND)
    (found,) = (c for c in problem.constraints if isinstance(c, Surroundings))
    return problem, found


def _least_by_coal(problem: Problem, constraint: Surroundings, motion: Motion) -> float:
    """Least distance less what is kept [m] at 1 kHz, of the true capsules and boxes."""
    states = problem.states(motion.coefficients, problem.trajectory.basis(fine_times(problem)))
    quick = constraint.margins(states).min(axis=0)
    near = np.argsort(quick)[:4]  # of all pairs the four that come nearest: coal is slow
    pairs = [constraint.pairs.checked[k] for k in near]
    args = (problem.robot, constraint.capsules, constraint.obstacles, pairs, states.q)
    return float((coal_distances(*args) - constraint.pairs.kept[near]).min())


def test_gradients_equal_differences() -> None:
    problem, constraint = _around()
    for seed in range(6):
        check_gradients(problem.robot, constraint, seed, 2e-6)
    assert "tool – table" in constraint.labels
    things = {label.split(" – ")[1] for label in constraint.labels}
    assert things == {"floor", "wall", "table", "shelf"}
    assert not any(label.startswith("base") for label in constraint.labels)


@pytest.mark.parametrize("share", [0.3, 1.0])
def test_quick_margins_are_exact_within_reach_and_bounds_beyond(share: float) -> None:
    problem, constraint = _around()
    states = States(problem.kinematics, *problem.robot.draw_states(80, 2))
    exact, reach = constraint.margins(states), share * constraint.scale
    quick = constraint.margins_within(states, reach)
    near = exact < reach
    assert near.any()
    np.testing.assert_allclose(quick[near], exact[near], atol=1e-12)
    assert np.all((quick >= reach)[~near])


@pytest.mark.long
def test_with_it_the_margin_is_kept_and_without_it_the_table_is_hit() -> None:
    problem, constraint = _around()
    kept = one_motion(problem)
    assert all(worst.margin >= 0 for worst in worst_margins(problem, kept.coefficients).values())
    assert kept.margins["surroundings"].unit == "m"
    assert _least_by_coal(problem, constraint, kept) > -1e-6
    free = one_motion(_problem())
    assert _least_by_coal(problem, constraint, free) < -0.05  # not merely within the margin


def _lid(height: float, more: str = "margin: 0.02") -> str:
    wall = f"{{point: [0, 0, {height}], normal: [0, 0, -1]}}"
    return f"constraints.surroundings={{{more}, walls: {{lid: {wall}}}}}"


def _at_posture(problem: Problem) -> tuple[Surroundings, np.ndarray]:
    """The constraint, and the distances of all its pairs [m] at robot.posture."""
    (constraint,) = (c for c in problem.constraints if isinstance(c, Surroundings))
    states = States(problem.kinematics, problem.robot.posture[None], *np.zeros((2, 1, 5)))
    return constraint, (constraint.margins(states) + constraint.pairs.kept)[0]


def test_a_posture_within_the_margin_is_moved_a_little() -> None:
    """A lid 5 mm above the arm, 2 cm are to be kept."""
    least = float(_at_posture(_problem(_lid(0.9)))[1].min())
    near = _problem(_lid(0.9 - least + 0.005))
    start = clear_posture(MotionTask(near), 1)
    assert not start.as_configured
    assert np.abs(start.posture - near.robot.posture).max() < 0.8
    touching = _problem(_lid(0.9 - least - 0.001))
    with pytest.raises(NoAdmissibleMotionError, match=r"is 0.001 m behind lid"):
        clear_posture(MotionTask(touching), 1)


def test_a_posture_inside_a_thing_is_refused_with_link_thing_and_depth() -> None:
    table = "{size: [0.6, 1.2, 0.1], position: [0.5, 0, 0.7]}"
    inside = _problem(f"constraints.surroundings={{boxes: {{table: {table}}}}}")
    constraint, distances = _at_posture(inside)
    deepest = int(np.argmin(distances))
    link = constraint.labels[deepest].split(" – ")[0]
    message = f"at robot.posture, {link} is {-distances[deepest]:.3f} m inside table"
    with pytest.raises(NoAdmissibleMotionError, match=message):
        clear_posture(MotionTask(inside), 1)


def test_what_leaves_no_posture_is_named() -> None:
    """Level between floor and lid the arm touches neither, but has no 10 cm to both."""
    level = "robot.posture={shoulder_pitch: 1.5708, elbow: 0, slide: 0.05}"
    around = _lid(0.5, "margin: 0.1, floor: 0.3")
    with pytest.raises(NoAdmissibleMotionError, match=r"surroundings \(\w+ – (lid|floor)\)"):
        clear_posture(MotionTask(_problem(level, around)), 1)
