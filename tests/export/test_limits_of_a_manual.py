"""A Panda's motion as its controller judges it: differences of positions at 1 kHz.

Numbers, sampling and differences are written here once more, apart from the program's.
"""

from typing import Any

import numpy as np
import pytest

from excite_cli.config.load_spec import parse_spec
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.export.timed import timed_motion
from excite_cli.trajectory.fade import Chain, Segment
from tests.excitation.smoke import one_motion

CONFIG = """
robot:
  urdf: example-robot-data:panda
  joints: [panda_joint1, panda_joint2, panda_joint3, panda_joint4, panda_joint5, panda_joint6,
           panda_joint7]
  posture: {panda_joint2: -0.785398, panda_joint4: -2.356194, panda_joint6: 1.570796,
            panda_joint7: 0.785398}
  limits_preset: franka_emika_panda
constraints: {torque: {scale: 0.8}}
optimizer: {restarts: 1}
"""
USUAL = "trajectory: {base_frequency: 0.6283185307179586, at_rest: true, harmonics: 5}\n"
# 21 ms of 48, 95 and 143 Hz: acceleration times frequency is jerk, and a Panda's limits meet at
# 500 rad/s, 80 Hz.
FAST = "trajectory: {base_frequency: 299.19930034188507, at_rest: true, harmonics: 3}\n"
# https://frankarobotics.github.io/docs/robot_specifications.html
LOWER = np.array([-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973])
UPPER = np.array([2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973])
RATES = np.array(
    [
        [2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61],
        [15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0],
        [7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10000.0, 10000.0],
    ]
)


def problem(trajectory: str, *changes: str) -> Problem:
    return build_problem(parse_spec(CONFIG + trajectory, "panda.yaml", list(changes)))


def shares(planned: Problem) -> Any:
    """The largest share of speed, acceleration and jerk limits (3,), from standing to standing."""
    motion = one_motion(planned)
    chain = Chain((Segment("motion", planned.trajectory, motion.coefficients),))
    file = timed_motion("motion", planned.robot.joint_names, chain, 1000.0)
    q = file.q
    np.testing.assert_allclose(np.diff(file.t), 1e-3, rtol=1e-6)
    assert (q > LOWER).all()
    assert (q < UPPER).all()
    standing = np.vstack([*[q[:1]] * 3, q, *[q[-1:]] * 3])
    return np.array(
        [(np.abs(np.diff(standing, k, axis=0)) * 1000**k / RATES[k - 1]).max() for k in (1, 2, 3)]
    )


@pytest.mark.long
def test_a_motion_planned_with_the_preset_keeps_the_manual() -> None:
    used = shares(problem(USUAL))
    assert (used < 1).all()
    assert used[:2].max() > 0.95


@pytest.mark.long
def test_jerk_is_kept_with_its_limit_and_broken_without() -> None:
    assert (shares(problem(FAST)) < 1).all()
    without = [f"robot.limits.panda_joint{k}.jerk=1e9" for k in range(1, 8)]
    assert shares(problem(FAST, *without))[2] > 1.1
