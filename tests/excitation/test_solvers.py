import sys
from collections.abc import Callable

import numpy as np
import pytest

from excite_cli.config.constraints_spec import ConstraintsSpec, JointLimitsSpec, TorqueSpec
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.config.spec import OptimizerSpec, Spec
from excite_cli.config.trajectory_spec import FourierSpec, GridSpec, SamplingSpec
from excite_cli.constraints.base import Array
from excite_cli.errors import ConfigError, MissingExtraError
from excite_cli.excitation.motion import Outcome
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.excitation.progress import Measure, Progress, Status
from excite_cli.excitation.solvers.base import Effort, Solver
from excite_cli.excitation.solvers.catalogue import build_solver
from excite_cli.excitation.solvers.interior_point import InteriorPoint
from excite_cli.excitation.solvers.linearised import Linearised, dips, gathered, lowest
from excite_cli.excitation.solvers.quadratic_program import build_backend
from excite_cli.excitation.solvers.quasi_newton import damped_update
from excite_cli.excitation.solvers.restoration import BestAdmissible, least_distance
from excite_cli.excitation.solvers.slsqp import ScipySlsqp
from excite_cli.excitation.solvers.sqp import SequentialQuadratic
from excite_cli.excitation.stack import Stack
from excite_cli.excitation.start import clear_posture, random_start
from excite_cli.excitation.task import MotionTask

MAKERS: dict[str, Callable[[], Solver]] = {
    "interior_point": InteriorPoint,
    "sqp-daqp": lambda: SequentialQuadratic("daqp"),
    "sqp-piqp": lambda: SequentialQuadratic("piqp"),
    "slsqp": ScipySlsqp,
}
every_solver = pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
every_backend = pytest.mark.parametrize("backend", ["daqp", "piqp"])


@pytest.fixture(scope="module")
def problem() -> Problem:
    return build_problem(
        Spec(
            robot=RobotSpec(urdf="example-robot-data:ur10"),
            trajectory=FourierSpec(harmonics=3),
            sampling=SamplingSpec(
                cost=GridSpec(samples=20, step=0.4), constraints=GridSpec(samples=80, step=0.1)
            ),
            constraints=ConstraintsSpec(
                joint_limits=JointLimitsSpec(acceleration=4.0), torque=TorqueSpec(scale=0.8)
            ),
        )
    )


def start(task: MotionTask, seed: int = 1) -> Array:
    return random_start(task, clear_posture(task, seed), (seed, 1, 0))


def solved(
    task: MotionTask, solver: Solver, iterations: int = 25, seconds: float = 60.0
) -> tuple[Outcome, list[Progress]]:
    seen: list[Progress] = []
    outcome = solver.solve(task, start(task), Effort(iterations, seconds, 1e-3), seen.append)
    return outcome, seen


def condition_number(task: MotionTask, x: Array) -> float:
    return task.objective.stacked_condition_number(task.coefficients(x))


@every_solver
def test_outcome_is_admissible_and_far_better_than_its_start(
    problem: Problem, make: Callable[[], Solver]
) -> None:
    task = MotionTask(problem)
    outcome, _ = solved(task, make())
    assert lowest(task.values(task.states(outcome.x))) > 0
    assert condition_number(task, outcome.x) < 0.5 * condition_number(task, start(task))


@every_solver
def test_same_start_gives_the_same_outcome(problem: Problem, make: Callable[[], Solver]) -> None:
    first, _ = solved(MotionTask(problem), make(), iterations=8)
    second, _ = solved(MotionTask(problem), make(), iterations=8)
    np.testing.assert_array_equal(first.x, second.x)


@every_solver
def test_max_iterations_and_progress(problem: Problem, make: Callable[[], Solver]) -> None:
    outcome, seen = solved(MotionTask(problem), make(), iterations=5)
    assert outcome.iterations == 5
    assert outcome.status is Status.ITERATION_LIMIT
    assert [progress.iteration for progress in seen] == [1, 2, 3, 4, 5]
    assert all(1 <= progress.stage.number <= progress.stage.total for progress in seen)
    assert {progress.figure.measure for progress in seen} == {Measure.CONDITION_NUMBER}


@every_solver
def test_no_time_at_all_still_gives_an_admissible_outcome(
    problem: Problem, make: Callable[[], Solver]
) -> None:
    task = MotionTask(problem)
    outcome, _ = solved(task, make(), seconds=0.02)
    assert outcome.status is Status.TIME_LIMIT
    assert lowest(task.values(task.states(outcome.x))) > 0


@pytest.fixture(scope="module")
def reference(problem: Problem) -> float:
    task = MotionTask(problem)
    return condition_number(task, solved(task, InteriorPoint(), 120)[0].x)


@every_solver
def test_solvers_agree_on_how_good_a_motion_can_be(
    problem: Problem, reference: float, make: Callable[[], Solver]
) -> None:
    task = MotionTask(problem)
    assert condition_number(task, solved(task, make(), 120)[0].x) < 1.25 * reference


@every_solver
def test_second_motion_improves_on_its_stack(problem: Problem, make: Callable[[], Solver]) -> None:
    first = MotionTask(problem)
    block = first.objective.block(first.coefficients(solved(first, make(), 15)[0].x))
    stack = Stack.empty(problem.base.rank).with_rows(block)
    second = MotionTask(problem, stack)
    outcome, _ = solved(second, make(), 15)
    alone = np.linalg.svd(stack.factor, compute_uv=False)
    assert condition_number(second, outcome.x) < alone[0] / alone[-1]


def test_catalogue_builds_what_the_spec_names() -> None:
    assert isinstance(build_solver(OptimizerSpec()), InteriorPoint)
    assert isinstance(build_solver(OptimizerSpec(method="slsqp")), ScipySlsqp)
    solver = build_solver(OptimizerSpec(method="sqp", qp_solver="daqp"))
    assert isinstance(solver, SequentialQuadratic)
    assert solver.backend.name == "daqp"


@every_backend
def test_missing_library_names_the_extra(backend: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, backend, None)
    with pytest.raises(MissingExtraError, match=r"pip install excite-cli\[qp\]") as caught:
        build_solver(OptimizerSpec(method="sqp", qp_solver=backend))
    assert backend in str(caught.value)
    assert isinstance(build_solver(OptimizerSpec(method="interior_point")), InteriorPoint)


def test_unknown_backend_is_refused_with_the_nearest_name() -> None:
    with pytest.raises(ConfigError, match="Did you mean 'daqp'"):
        build_backend("dapq")


@every_backend
@pytest.mark.parametrize("seed", range(5))
def test_backend_meets_the_conditions_of_optimality(backend: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    root, gradient, rows = rng.normal(size=(8, 8)), rng.normal(size=8), rng.normal(size=(15, 8))
    hessian = root @ root.T + np.eye(8)
    bounds = rows @ rng.normal(size=8) - rng.uniform(0, 0.5, size=15)
    found = build_backend(backend).minimise(hessian, gradient, rows, bounds)
    assert found is not None
    slack = rows @ found.x - bounds
    assert slack.min() > -1e-7
    assert found.multipliers.min() >= 0
    np.testing.assert_allclose(hessian @ found.x + gradient, rows.T @ found.multipliers, atol=1e-5)
    np.testing.assert_allclose(found.multipliers * slack, 0.0, atol=1e-5)


@every_backend
def test_backend_tells_contradicting_rows(backend: str) -> None:
    rows = np.array([[1.0, 0.0], [-1.0, 0.0]])
    found = build_backend(backend).minimise(np.eye(2), np.zeros(2), rows, np.ones(2))
    assert found is None


def test_linearised_residuals_match_differences(problem: Problem) -> None:
    task = MotionTask(problem)
    x, direction = start(task), np.random.default_rng(3).normal(size=task.size)
    states = task.states(x)
    linear = Linearised(task, states, task.values(states))
    h = 1e-6
    ahead, behind = (task.values(task.states(x + s * h * direction)) for s in (1, -1))
    differences = [(a - b) / (2 * h) for a, b in zip(ahead, behind, strict=True)]
    expected = gathered(differences, linear.near)
    np.testing.assert_allclose(gathered(linear.change(direction), linear.near), expected, atol=1e-6)
    np.testing.assert_allclose(linear.dense(linear.near) @ direction, expected, atol=1e-6)


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


def test_restoration_brings_a_broken_motion_inside(problem: Problem) -> None:
    task = MotionTask(problem)
    x = start(task)
    best = BestAdmissible(task)
    spectrum = task.cost(x, problem.criterion)[2]
    best.offer(x, task.values(task.states(x)), spectrum)
    resting = task.variables(problem.still(problem.robot.posture))
    broken = resting + 3.0 * (x - resting)
    assert lowest(task.values(task.states(broken))) < 0
    best.offer_restored(broken)
    assert lowest(task.values(task.states(best.kept()))) > 0
    assert condition_number(task, best.kept()) < condition_number(task, x)


@pytest.mark.parametrize("seed", range(5))
def test_damped_update_stays_positive_definite(seed: int) -> None:
    rng = np.random.default_rng(seed)
    hessian = np.eye(6)
    for _ in range(20):
        hessian = damped_update(hessian, rng.normal(size=6), rng.normal(size=6))
        assert np.linalg.eigvalsh(hessian).min() > 0
