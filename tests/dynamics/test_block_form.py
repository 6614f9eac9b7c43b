"""The paper's block form against Pinocchio: differences of its regressor."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.dynamics.block_form import block_pull_back
from excite_cli.dynamics.block_kinematics import body_jacobians, body_motions, joints_of
from excite_cli.robot.model import Array, Robot, build_robot
from tests.robot.random_robots import ROW_CHOICES, Rows, random_robot

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


def test_random_robots_repeat_and_are_physical() -> None:
    first, second = random_robot(7, joints=6), random_robot(7, joints=6)
    assert first.fingerprint() == second.fingerprint()
    assert first.n == 6
    for inertia in list(first.model.inertias)[1:]:
        pseudo = inertia.toPseudoInertia().toMatrix()
        assert np.linalg.eigvalsh(pseudo).min() > 0


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
