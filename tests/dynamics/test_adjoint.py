"""Both production pull-backs against the paper's block form, on all kinds of robots."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.dynamics.adjoint import FictitiousInertiaAdjoint
from excite_cli.dynamics.block_form import block_pull_back
from excite_cli.dynamics.regressor import Regressor
from excite_cli.dynamics.spatial_adjoint import SpatialAdjoint
from excite_cli.excitation.gradient_check import relative_error
from excite_cli.robot.model import Robot, build_robot
from tests.robot.coupled_robots import CLAW, HAND, coupled_robot
from tests.robot.random_robots import random_robot


def _draw(robot: Robot, seed: int, pairs: int, samples: int = 4) -> tuple:
    rng = np.random.default_rng(seed)
    states = robot.draw_states(samples, seed)
    left = rng.normal(size=(pairs, samples, len(robot.rows)))
    right = rng.normal(size=(pairs, 10 * robot.n_bodies))
    return states, left, right


@settings(max_examples=25, derandomize=True, deadline=None)
@given(
    seed=st.integers(0, 9999),
    joints=st.integers(1, 7),
    floating=st.booleans(),
    pairs=st.integers(1, 4),
)
def test_both_adjoints_equal_the_block_form(
    seed: int, joints: int, floating: bool, pairs: int
) -> None:
    _assert_alike(random_robot(seed, joints=joints, floating=floating), seed, pairs)


@pytest.mark.parametrize("rows", [("joints",), ("base", "joints"), ("base",)])
@pytest.mark.parametrize("parts", [HAND, CLAW], ids=["hand", "claw"])
def test_both_adjoints_where_joints_follow_others(parts: tuple, rows: tuple[str, ...]) -> None:
    base = "floating" if "base" in rows else "fixed"
    robot = coupled_robot(parts, base=base, rows=rows)
    _assert_alike(robot, 1, 3)
    _assert_slopes(robot)


def _assert_alike(robot: Robot, seed: int, pairs: int) -> None:
    states, left, right = _draw(robot, seed, pairs)
    expected = block_pull_back(robot, *states, left.transpose(1, 2, 0) @ right)
    scale = np.sqrt(sum(float((part**2).sum()) for part in expected))
    for adjoint in (FictitiousInertiaAdjoint(robot), SpatialAdjoint(robot)):
        for found, part in zip(adjoint.pull_back(*states, left, right), expected, strict=True):
            assert np.linalg.norm(found - part) < 1e-9 * scale


@pytest.mark.parametrize("base", ["fixed", "floating"])
def test_adjoints_on_a_real_humanoid_against_differences_of_the_regressor(base: str) -> None:
    rows = ("base", "joints") if base == "floating" else ("joints",)
    _assert_slopes(build_robot(RobotSpec(urdf="example-robot-data:talos", base=base, rows=rows)))


def _assert_slopes(robot: Robot) -> None:
    (q, v, a), left, right = _draw(robot, 5, pairs=3, samples=3)
    rng = np.random.default_rng(1)
    dq, dv, da = rng.normal(size=(3, *q.shape))
    regressor = Regressor(robot)

    def along(step: float) -> float:
        y = regressor.evaluate(q + step * dq, v + step * dv, a + step * da)
        return float(np.einsum("ktr,trp,kp->", left, y, right))

    h = 1e-4
    expected = (8 * (along(h) - along(-h)) - (along(2 * h) - along(-2 * h))) / (12 * h)
    for adjoint in (FictitiousInertiaAdjoint(robot), SpatialAdjoint(robot)):
        gq, gv, ga = adjoint.pull_back(q, v, a, left, right)
        found = float((gq * dq).sum() + (gv * dv).sum() + (ga * da).sum())
        assert found == pytest.approx(expected, rel=1e-7)


def test_a_fictitious_mass_that_cancels_is_harmless() -> None:
    robot = random_robot(3, joints=4)
    states, left, right = _draw(robot, 3, pairs=1)
    right[0] = 0.0
    right[0, 10] = -5.0  # the largest entry, a negative mass
    fast = FictitiousInertiaAdjoint(robot).pull_back(*states, left, right)
    full = SpatialAdjoint(robot).pull_back(*states, left, right)
    assert relative_error(np.stack(fast), np.stack(full)) < 1e-10
