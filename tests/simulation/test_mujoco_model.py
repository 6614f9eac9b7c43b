"""MuJoCo's inverse dynamics against Pinocchio's, on robots of every make."""

from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.dynamics.pseudo_inertia import pseudo_inertias, ten_parameters
from excite_cli.dynamics.regressor import InverseDynamics, standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.errors import RobotError
from excite_cli.measurement.run_identity import RunId
from excite_cli.robot.model import Array, Robot, build_robot
from excite_cli.simulation.build import assemble, make, true_inertias
from excite_cli.simulation.mujoco_model import build_plant
from tests.robot.coupled_robots import CLAW, HAND, coupled_robot, urdf_of
from tests.robot.random_robots import random_robot

mujoco = pytest.importorskip("mujoco")


def mujoco_torques(robot: Robot, phi: Array, q: Array, v: Array, a: Array) -> Array:
    plant = build_plant(robot, phi)
    data = plant.new_data()
    torques = np.empty_like(q)
    for t in range(len(q)):
        data.qpos[:] = plant.coordinates(q[t])
        data.qvel[:], data.qacc[:] = plant.spread @ v[t], plant.spread @ a[t]
        mujoco.mj_inverse(plant.model, data)
        torques[t] = plant.spread.T @ data.qfrc_inverse
    return torques


def assert_same_dynamics(robot: Robot) -> None:
    q, v, a = robot.draw_states(20, seed=3)
    expected = InverseDynamics(robot).torques(q, v, a)
    found = mujoco_torques(robot, standard_parameters(robot), q, v, a)
    assert np.abs(found - expected).max() < 1e-9 * max(1.0, np.abs(expected).max())
    phi = true_inertias(robot, 0.2, seed=7)
    expected = RigidBody(robot, phi, q, v, a).regressor @ phi
    found = mujoco_torques(robot, phi, q, v, a)
    assert np.abs(found - expected).max() < 1e-9 * max(1.0, np.abs(expected).max())


@pytest.mark.parametrize("floating", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_random_trees(seed: int, floating: bool) -> None:
    assert_same_dynamics(random_robot(seed, joints=6, floating=floating))


@pytest.mark.parametrize("base", ["fixed", "floating"])
@pytest.mark.parametrize("parts", [HAND, CLAW], ids=["hand", "claw"])
def test_grippers_whose_fingers_follow(parts: tuple, base: str) -> None:
    assert_same_dynamics(coupled_robot(parts, base=base))


@pytest.mark.parametrize("parts", [HAND, CLAW], ids=["hand", "claw"])
def test_followers_stay_where_they_are_led_while_the_robot_falls(parts: tuple) -> None:
    robot = coupled_robot(parts, posture={"shoulder": 0.5})
    plant = build_plant(robot, standard_parameters(robot))
    data = plant.new_data()
    data.qpos[:] = plant.coordinates(robot.posture)
    for _ in range(400):
        mujoco.mj_step(plant.model, data)
    fallen = data.qpos[plant.motor]
    assert np.abs(fallen - robot.posture).max() > 0.02
    np.testing.assert_allclose(data.qpos, plant.coordinates(fallen), atol=1e-6)


def test_a_follower_without_mass_is_told(tmp_path: Path) -> None:
    head, tail = urdf_of(HAND).split('<link name="right_finger">')
    rest = tail[tail.index("</inertial>") + len("</inertial>") :]
    (tmp_path / "hand.urdf").write_text(f'{head}<link name="right_finger">{rest}')
    robot = build_robot(RobotSpec(urdf=str(tmp_path / "hand.urdf")))
    with pytest.raises(RobotError, match=r"'finger_2', which follows another one, moves no iner"):
        make(assemble(robot, standard_parameters(robot), RunId("a"), ()), 1e-3)


def test_arms_and_a_part_of_a_humanoid_on_a_hoist() -> None:
    """And gravity of the config."""
    joints = tuple(f"arm_{side}_{k}_joint" for side in ("left", "right") for k in range(1, 8))
    hoist = {"base": "floating", "rows": ("base", "joints"), "base_orientation": (0.1, -0.2, 0.3)}
    for name, more in (
        ("ur10", {}),
        ("panda", {}),
        ("ur10", {"gravity": (1.0, 2.0, -3.0)}),
        ("talos", {"joints": joints, "posture": {"torso_1_joint": 0.3}, **hoist}),
    ):
        assert_same_dynamics(build_robot(RobotSpec(urdf=f"example-robot-data:{name}", **more)))


def test_a_soft_joint_that_does_not_give_is_a_joint_with_a_rotor() -> None:
    robot = random_robot(5, joints=4, prismatic=False)
    phi = standard_parameters(robot)
    q, v, a = robot.draw_states(5, seed=1)
    plant = build_plant(robot, phi, soft=[2])
    rotor = 0.7
    plant.model.dof_armature[plant.motor[2]] = rotor
    data = plant.new_data()
    expected = InverseDynamics(robot).torques(q, v, a)
    for t in range(len(q)):
        data.qpos[plant.motor], data.qvel[plant.motor], data.qacc[plant.motor] = q[t], v[t], a[t]
        mujoco.mj_inverse(plant.model, data)
        motor = data.qfrc_inverse[plant.motor]
        assert motor[2] == pytest.approx(expected[t, 2] + rotor * a[t, 2], abs=1e-9)
        assert data.qfrc_inverse[plant.gear[2]] == pytest.approx(expected[t, 2], abs=1e-9)


def test_true_inertias_are_off_by_what_was_asked_and_belong_to_bodies(tmp_path: Path) -> None:
    robot = random_robot(2, joints=6)
    nominal = standard_parameters(robot).reshape(-1, 10)
    for error in (0.05, 0.2):
        found = true_inertias(robot, error, seed=1).reshape(-1, 10)
        off = np.abs(found[:, 0] / nominal[:, 0] - 1.0)
        assert (off > 0.4 * error).all()
        assert (off < 1.6 * error).all()
        change = np.linalg.norm(found - nominal, axis=1) / np.linalg.norm(nominal, axis=1)
        assert 0.4 * error < np.median(change) < 2 * error
        for ten in found:
            pseudo = pseudo_inertias(ten)[0]
            assert np.linalg.eigvalsh(pseudo).min() >= -1e-12
            assert ten_parameters(pseudo) == pytest.approx(ten, abs=1e-14)
    assert np.array_equal(true_inertias(robot, 0.0, seed=1), standard_parameters(robot))
    again = true_inertias(robot, 0.2, seed=1)
    assert np.array_equal(again, true_inertias(robot, 0.2, seed=1))
    assert not np.array_equal(again, true_inertias(robot, 0.2, seed=2))
