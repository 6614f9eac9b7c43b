"""With a constraint its limit holds at 1 kHz; without it the same problem breaks it."""

from functools import cache
from pathlib import Path

import pytest

from excite_cli.config.load import load_spec
from excite_cli.constraints.catalogue import build_constraints
from excite_cli.excitation.admissible import worst_margins
from excite_cli.excitation.generate import generate_motion
from excite_cli.excitation.motion import Motion
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.excitation.solvers.interior_point import InteriorPoint
from excite_cli.excitation.stack import Stack

CONFIG = Path(__file__).parents[2] / "configs" / "smoke.yaml"
COMMON = ("optimizer.max_iterations=60", "sequence.motions=1")
# Limits tight enough to matter, by the name of the margin they keep.
LIMITS = {
    "joint_position": ("constraints.joint_limits.position", "true", "false"),
    "joint_velocity": ("constraints.joint_limits.velocity", "1.2", "false"),
    "joint_acceleration": ("constraints.joint_limits.acceleration", "4.0", "null"),
    "joint_torque": ("constraints.torque", "{scale: 0.25}", "null"),
    "balance": ("constraints.balance", "{kind: disc, radius: 0.02}", "null"),
    "self_collision": ("constraints.self_collision", "{margin: 0.02}", "null"),
}


def _problem(*settings: str) -> Problem:
    return build_problem(load_spec(CONFIG, [*COMMON, *settings]), CONFIG.parent)


def _motion(problem: Problem) -> Motion:
    stack = Stack.empty(problem.base.rank)
    solver = InteriorPoint()
    return generate_motion(problem, solver, stack, 1, 1, lambda progress: None)


@cache
def _with(name: str) -> tuple[Problem, Motion]:
    key, on, _ = LIMITS[name]
    problem = _problem(f"{key}={on}")
    return problem, _motion(problem)


@pytest.mark.parametrize("name", LIMITS)
def test_with_it_the_limit_holds_at_controller_rate(name: str) -> None:
    problem, motion = _with(name)
    margins = worst_margins(problem, motion.coefficients)
    assert name in margins
    for worst in margins.values():
        assert worst.margin >= 0
        assert worst.violations == 0


@pytest.mark.parametrize("name", LIMITS)
def test_without_it_the_same_problem_breaks_it(name: str) -> None:
    judge, _ = _with(name)
    key, _, off = LIMITS[name]
    free = _problem(f"{key}={off}")
    assert name not in {constraint.name for constraint in free.constraints}
    motion = _motion(free)
    assert worst_margins(judge, motion.coefficients)[name].margin < 0


def test_a_limit_of_zero_range_between_samples_is_mended() -> None:
    """A coarse grid misses what happens between its instants; the result still holds."""
    problem = _problem(
        "sampling.constraints={samples: 30, step: 0.2}", "constraints.self_collision.margin=0.03"
    )
    motion = _motion(problem)
    assert all(w.margin >= 0 for w in worst_margins(problem, motion.coefficients, 2000.0).values())


def test_constraints_are_built_in_the_order_of_the_table() -> None:
    problem = _problem()
    names = [
        constraint.name for constraint in build_constraints(problem.spec.constraints, problem.robot)
    ]
    assert names == [n for n in LIMITS if n != "balance"]
