"""An exported motion played by position control in MuJoCo follows the plan."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.load import load_spec
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.excitation.base_motion import base_motion
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.excitation.start import random_start
from excite_cli.excitation.task import MotionTask
from excite_cli.export.motions import MOTION_EXPORTERS
from excite_cli.export.timed import timed_motion
from excite_cli.measurement.motion_files import read_motion
from excite_cli.measurement.timed_motion import TimedMotion
from excite_cli.simulation.mujoco_model import build_plant
from excite_cli.trajectory.fade import Chain, Segment

mujoco = pytest.importorskip("mujoco")
CONFIG = Path(__file__).parents[2] / "configs" / "smoke.yaml"
RATE = 1000.0
STIFFNESS = 150.0  # rad/s: kp = STIFFNESS² and kv = 2 STIFFNESS per unit of the joint's inertia


@pytest.fixture(scope="module")
def planned() -> tuple[Problem, Chain]:
    """The config's robot, and an admissible motion as fast as its limits let it be."""
    spec = load_spec(CONFIG, ["constraints.self_collision=null"])
    problem = build_problem(spec, CONFIG.parent)
    task = MotionTask(problem)
    x = random_start(task, base_motion(task, 1), (1, 1))
    return problem, Chain((Segment("motion_1", problem.trajectory, task.coefficients(x)),))


def _played(problem: Problem, motion: TimedMotion) -> np.ndarray:
    """RMS error (n,) of position servos with gravity compensation, their targets from the file."""
    assert motion.v is not None
    plant = build_plant(problem.robot, standard_parameters(problem.robot), 5e-4)
    model, data = plant.model, plant.new_data()
    at = plant.motor
    data.qpos[at], data.qvel[at] = motion.q[0], motion.v[0]
    mass = np.empty((model.nv, model.nv))
    errors = np.empty_like(motion.q)
    for k, (q, v) in enumerate(zip(motion.q, motion.v, strict=True)):
        mujoco.mj_forward(model, data)
        errors[k] = q - data.qpos[at]
        if k % 10 == 0:
            mujoco.mj_fullM(model, data, mass)
            inertia = np.diag(mass)[at]
        wanted = STIFFNESS**2 * errors[k] + 2 * STIFFNESS * (v - data.qvel[at])
        data.qfrc_applied[at] = data.qfrc_bias[at] + inertia * wanted
        for _ in range(2):
            mujoco.mj_step(model, data)
    return np.sqrt(np.mean(errors**2, axis=0))


def test_the_plan_is_followed(planned: tuple[Problem, Chain], tmp_path: Path) -> None:
    problem, chain = planned
    exporter = MOTION_EXPORTERS["ros2"]
    joints = problem.robot.joint_names
    timed = timed_motion("m", joints, chain, RATE, False, exporter.whole_nanoseconds)
    path = tmp_path / f"m{exporter.suffix}"
    exporter.write(path, timed)
    motion, _ = read_motion(path, joints)
    span = np.ptp(motion.q, axis=0)
    assert span.max() > 0.5
    error = _played(problem, motion)
    assert error.max() < 1e-3, error  # 0.6 mrad when written, of a motion of 2.1 rad


def test_speeds_of_two_joints_exchanged_would_be_seen(planned: tuple[Problem, Chain]) -> None:
    problem, chain = planned
    joints = problem.robot.joint_names
    motion = timed_motion("m", joints, chain, RATE)
    assert motion.v is not None
    wrong = replace(motion, v=motion.v[:, [1, 0, 2, 3, 4]])
    assert _played(problem, wrong).max() > 5e-3
