"""Torque that falls with speed: where it holds, its gradient, bounds over intervals, refusals."""

import numpy as np
import pytest

from excite_cli.config.constraints_spec import ConstraintsSpec, TorqueSpec
from excite_cli.config.robot_spec import JointLimits
from excite_cli.constraints.catalogue import build_constraints
from excite_cli.dynamics.forward_kinematics import BatchKinematics, States
from excite_cli.dynamics.regressor import InverseDynamics
from excite_cli.proof.enclosed_motion import EnclosedMotion, enclosed_states, intervals_of
from excite_cli.robot.model import Robot
from excite_cli.trajectory.fourier import FourierTrajectory
from tests.constraints.test_gradients import check_gradients, known
from tests.robot.coupled_robots import HAND, coupled_robot

# Not concave: torque falls steeply, then slowly, as in field weakening.
POINTS = ((0.0, 10.0), (0.5, 9.0), (1.0, 4.0), (3.0, 3.0))
TORQUE = ConstraintsSpec(joint_limits=None, torque=TorqueSpec(scale=0.5))


def robot() -> Robot:
    return coupled_robot(HAND, limits={"wrist": JointLimits(effort_by_speed=POINTS)})


def test_braking_has_the_torque_of_no_speed() -> None:
    hand = robot()
    (torque,) = build_constraints(TORQUE, hand)
    j = hand.joint_names.index("wrist")
    q, v, a = hand.draw_states(40, 1)
    v[:, j] = np.linspace(-4.0, 4.0, 40)
    needed = InverseDynamics(hand).torques(q, v, a)[:, j]
    speeds, efforts = np.array(POINTS).T
    line = -0.5  # beyond the last point its line goes on
    for side, sign in (("lower", -1.0), ("upper", 1.0)):
        s = sign * v[:, j]
        available = np.where(s > 3.0, 3.0 + line * (s - 3.0), np.interp(s, speeds, efforts))
        column = torque.labels.index(f"wrist {side}")
        margins = torque.margins(States(BatchKinematics(hand), q, v, a))[:, column]
        np.testing.assert_allclose(margins, 0.5 * available - sign * needed, atol=1e-12)


@pytest.mark.parametrize("uncertain", [False, True])
def test_gradients(uncertain: bool) -> None:
    hand = robot()
    (torque,) = build_constraints(TORQUE, hand, known(hand, uncertain))
    for seed in range(4):
        check_gradients(hand, torque, seed, 1e-5)


@pytest.mark.parametrize("uncertain", [False, True])
@pytest.mark.parametrize("width", [0.2, 0.02])
def test_bounds_between_instants_hold_at_instants(uncertain: bool, width: float) -> None:
    hand = robot()
    (torque,) = build_constraints(TORQUE, hand, known(hand, uncertain))
    family = FourierTrajectory(3, 1.5)
    coefficients = 0.4 * np.random.default_rng(0).normal(size=(family.n_coefficients, hand.n))
    intervals = intervals_of(family, width)
    least = torque.least(EnclosedMotion(hand, enclosed_states(family, coefficients, intervals)))
    assert least is not None
    near = []
    for s in np.linspace(-1.0, 1.0, 9):
        times = intervals.middles + s * intervals.halves
        states = States.along(BatchKinematics(hand), family, coefficients, times)
        margins = torque.margins(states)
        assert (margins - least).min() > -1e-9
        near.append(margins)
    if width < 0.1:
        assert (np.min(near, axis=0) - least).max() < 0.05 * torque.scale.max()


@pytest.mark.parametrize("uncertain", [False, True])
def test_what_holds_at_rest_with_the_torque_of_speed_holds_at_any_lower_speed(
    uncertain: bool,
) -> None:
    hand = robot()
    spec = TORQUE.model_copy(update={"any_speed": True})
    moving, standing = build_constraints(spec, hand, known(hand, uncertain))
    assert standing.name == "joint_torque_standing"
    check_gradients(hand, standing, 1, 1e-5)
    q, v, a = hand.draw_states(300, 3)
    kinematics = BatchKinematics(hand)
    full = States(kinematics, q, v, a)
    least = np.minimum(moving.margins(full), standing.margins(full))
    for s in (0.1, 0.5, 0.9):
        slower = moving.margins(States(kinematics, q, s * v, s * s * a))
        assert (slower - least).min() > -1e-9
