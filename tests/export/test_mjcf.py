"""MuJoCo's own inverse dynamics of the exported file against Y φ + effects."""

import numpy as np
import pytest

from excite_cli.config.data_spec import EffectSpec
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.catalogue import declared_effects
from excite_cli.errors import RobotError
from excite_cli.export.mjcf import mjcf
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.robot.model import Array, Robot, build_robot
from excite_cli.simulation.build import true_inertias
from tests.robot.coupled_robots import CLAW, HAND, coupled_robot
from tests.robot.random_robots import random_robot

mujoco = pytest.importorskip("mujoco")
KINDS = ("viscous_friction", "armature", "spring", "coulomb_friction", "ripple")


def inverse(text: str, q: Array, v: Array, a: Array) -> tuple[Array, Array]:
    """Torque without friction loss, and the friction losses."""
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    data = mujoco.MjData(model)
    torques = np.empty_like(q)
    for t in range(len(q)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[t], v[t], a[t]
        mujoco.mj_inverse(model, data)
        torques[t] = data.qfrc_inverse
    return torques, np.array(model.dof_frictionloss)


def check(robot: Robot) -> None:
    phi = true_inertias(robot, 0.3, seed=2)
    effects = declared_effects(tuple(EffectSpec(kind=kind) for kind in KINDS), robot)
    rng = np.random.default_rng(0)
    values = tuple(rng.uniform(0.1, 2.0, len(effect.parameters)) for effect in effects)
    exported = mjcf(robot, IdentifiedModel(phi, effects, np.concatenate(values)))
    q, v, a = robot.draw_states(15, seed=1)
    expected = RigidBody(robot, phi, q, v, a).load
    n = robot.n
    for j in range(n):
        viscous, armature, spring = (float(values[k * n + j][0]) for k in range(3))
        preload = float(values[2 * n + j][1])
        expected[:, j] += viscous * v[:, j] + armature * a[:, j] + spring * q[:, j] + preload
    found, friction = inverse(exported.text, q, v, a)
    assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()
    assert friction == pytest.approx([float(values[3 * n + j][0]) for j in range(n)])
    assert any("ripple" in note for note in exported.notes)


@pytest.mark.parametrize("floating", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_random_trees(seed: int, floating: bool) -> None:
    check(random_robot(seed, joints=5, floating=floating))


def test_an_arm_with_its_limits_and_names() -> None:
    robot = build_robot(RobotSpec(urdf="example-robot-data:ur10"))
    check(robot)
    text = mjcf(robot, IdentifiedModel(standard_parameters(robot))).text
    model = mujoco.MjModel.from_xml_string(text)
    assert [model.joint(j).name for j in range(robot.n)] == list(robot.joint_names)
    assert model.jnt_range[:, 0] == pytest.approx(robot.limits.lower)
    assert model.jnt_limited.all()


@pytest.mark.parametrize("parts", [HAND, CLAW], ids=["hand", "claw"])
def test_joints_that_follow_others(parts: tuple) -> None:
    """Torques of all joints, gathered, are those of the drivers; the engine holds the followers."""
    robot = coupled_robot(parts)
    phi = true_inertias(robot, 0.3, seed=2)
    text = mjcf(robot, IdentifiedModel(phi)).text
    q, v, a = robot.draw_states(15, seed=1)
    found, _ = inverse(text, robot.all_positions(q), robot.all_rates(v), robot.all_rates(a))
    expected = RigidBody(robot, phi, q, v, a).load
    assert np.abs(robot.gathered(found) - expected).max() < 1e-9 * np.abs(expected).max()
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qpos[:] = robot.all_positions(robot.posture)
    for _ in range(200):  # the robot falls
        mujoco.mj_step(model, data)
    own = [robot.tree.joint_names.index(name) for name in robot.joint_names]
    assert np.abs(data.qpos[own] - robot.posture).max() > 0.01
    np.testing.assert_allclose(data.qpos, robot.all_positions(data.qpos[own]), atol=1e-3)


def test_an_impossible_body_is_refused() -> None:
    robot = random_robot(1, joints=3)
    phi = true_inertias(robot, 0.3, seed=2)
    phi[4] = -1.0
    with pytest.raises(RobotError, match=r"not one that MuJoCo accepts.*consistent: true"):
        mjcf(robot, IdentifiedModel(phi))
