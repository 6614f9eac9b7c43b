"""Derivatives of the regressor and of torques: by adjoints, by the block form, by differences.

The paper's block form against differences of Pinocchio's regressor, adjoints against the block
form, and torques at whatever inertias a fit leaves.
"""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.dynamics.block_form import block_pull_back
from excite_cli.dynamics.block_kinematics import body_jacobians, body_motions, joints_of
from excite_cli.dynamics.regressor import Regressor, standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.dynamics.spatial_adjoint import FictitiousInertiaAdjoint, SpatialAdjoint
from excite_cli.excitation.gradient_check import relative_error
from excite_cli.robot.model import Array, Robot, build_robot
from tests.robot.coupled_robots import CLAW, HAND, coupled_robot
from tests.robot.random_robots import ROW_CHOICES, Rows, random_robot


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


FEW = settings(max_examples=40, deadline=None, derandomize=True)
SEEDS, SIZES = st.integers(0, 10_000), st.integers(1, 8)


@pytest.fixture(scope="module")
def talos_arms() -> Robot:
    arms = tuple(f"arm_{side}_{k}_joint" for side in ("left", "right") for k in range(1, 8))
    return build_robot(RobotSpec(urdf="example-robot-data:talos", joints=arms))


def pinocchio_regressor(robot: Robot, q: Array, v: Array, a: Array) -> Array:
    data = robot.model.createData()
    states = zip(robot.configurations(q), robot.velocities(v), robot.velocities(a), strict=True)
    full = [pin.computeJointTorqueRegressor(robot.model, data, *state).copy() for state in states]
    # Pinocchio returns a regressor of one row without its first dimension.
    return np.reshape(full, (len(q), robot.model.nv, -1))[:, robot.rows]


def pull_back_error(robot: Robot, count: int = 4, seed: int = 0) -> float:
    """Relative error of Z : ∂Y against fourth-order central differences of Pinocchio's Y."""
    states = np.array(robot.draw_states(count, seed))
    rng = np.random.default_rng(seed)
    Z = rng.normal(size=(count, len(robot.rows), 10 * robot.n_bodies))
    h = 1e-3
    expected = np.zeros_like(states)
    for which in range(3):
        for column in range(robot.n):
            for step, weight in ((-2, 1 / 12), (-1, -2 / 3), (1, 2 / 3), (2, -1 / 12)):
                moved = states.copy()
                moved[which, :, column] += step * h
                value = np.einsum("trp,trp->t", Z, pinocchio_regressor(robot, *moved))
                expected[which, :, column] += weight / h * value
    q, v, a = states
    got = np.array(block_pull_back(robot, q, v, a, Z))
    return float(np.abs(got - expected).max() / np.abs(expected).max())


@FEW
@given(seed=SEEDS, joints=SIZES, branches=st.booleans(), prismatic=st.booleans())
def test_pull_back_is_the_derivative_on_fixed_robots(
    seed: int, joints: int, branches: bool, prismatic: bool
) -> None:
    robot = random_robot(seed, joints, branches=branches, prismatic=prismatic)
    assert pull_back_error(robot, seed=seed) < 1e-8


@FEW
@given(seed=SEEDS, joints=SIZES, rows=st.sampled_from(ROW_CHOICES))
def test_pull_back_is_the_derivative_on_floating_robots(seed: int, joints: int, rows: Rows) -> None:
    robot = random_robot(seed, joints, floating=True, rows=rows)
    assert pull_back_error(robot, seed=seed) < 1e-8


def test_talos_arms(talos_arms: Robot) -> None:
    assert talos_arms.n == 14
    assert pull_back_error(talos_arms, count=3) < 1e-8


def test_every_kind_of_joint_is_met() -> None:
    robots = [random_robot(seed) for seed in range(12)]
    kinds = {joint.shortname() for robot in robots for joint in list(robot.model.joints)[1:]}
    aligned = {f"JointModel{kind}{axis}" for kind in "RP" for axis in "XYZ"}
    assert kinds == aligned | {"JointModelRevoluteUnaligned", "JointModelPrismaticUnaligned"}


def test_basic_jacobian_and_accelerations_are_the_derivatives_of_the_motion() -> None:
    """Along a motion, [ṗ; ω] = J_B q̇, and ω̇, p̈ are the rates of ω and ṗ."""
    robot = random_robot(3, joints=6)
    joints = joints_of(robot)
    q, v, a = robot.draw_states(5, 1)
    h = 1e-5

    def speeds(step: float) -> list[tuple[Array, Array]]:
        motions = body_motions(robot, joints, q + step * v + step**2 / 2 * a, v + step * a, a)
        bases = [jacobian.basic for jacobian in body_jacobians(joints, motions, robot.n)]
        twists = [np.einsum("trn,tn->tr", basis, v + step * a) for basis in bases]
        return list(zip((motion.position for motion in motions), twists, strict=True))

    motions = body_motions(robot, joints, q, v, a)
    for motion, before, now, after in zip(motions, speeds(-h), speeds(0), speeds(h), strict=True):
        twist_rate = (after[1] - before[1]) / (2 * h)
        np.testing.assert_allclose((after[0] - before[0]) / (2 * h), now[1][:, :3], atol=1e-6)
        np.testing.assert_allclose(now[1][:, 3:], motion.velocity, atol=1e-12)
        np.testing.assert_allclose(twist_rate[:, 3:], motion.angular, atol=1e-6)
        gravity = robot.model.gravity.linear
        np.testing.assert_allclose(twist_rate[:, :3], motion.linear + gravity, atol=1e-6)


STEP = 1e-6


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("share", [0.5, -3.0])
def test_derivatives_are_those_of_the_torque_for_negative_masses_too(
    seed: int, share: float
) -> None:
    robot = random_robot(seed, joints=5)
    rng = np.random.default_rng(seed)
    phi = standard_parameters(robot) * rng.uniform(0.5, 1.5, 10 * robot.n_bodies)
    phi[::20] *= share
    q, v, a = rng.normal(size=(3, 2, robot.n))
    body = RigidBody(robot, phi, q, v, a)
    for k, part in enumerate((body.by_position, body.by_velocity, body.mass)):
        size = np.abs(body.load).max() + np.abs(part).max()
        for j in range(robot.n):
            ends = []
            for sign in (1.0, -1.0):
                moved = [q.copy(), v.copy(), a.copy()]
                moved[k][:, j] += sign * STEP
                ends.append(RigidBody(robot, phi, *moved).regressor @ phi)
            slope = (ends[0] - ends[1]) / (2 * STEP)
            assert part[:, :, j] == pytest.approx(slope, rel=1e-6, abs=1e-6 * size)
