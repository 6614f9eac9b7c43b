"""How far set points are from positions: what it is, its gradient, its bounds, its refusals."""

from typing import Any

import numpy as np
import pytest

from excite_cli.config.constraints_spec import ConstraintsSpec, TorqueSpec
from excite_cli.config.data_spec import DriveLawSpec, MeasurementSpec
from excite_cli.constraints.base import Constraint
from excite_cli.constraints.catalogue import build_constraints
from excite_cli.dynamics.forward_kinematics import BatchKinematics, States
from excite_cli.dynamics.regressor import InverseDynamics
from excite_cli.errors import ConfigError
from excite_cli.excitation.admissible import worst_margins
from excite_cli.proof.enclosed_motion import EnclosedMotion, enclosed_states, intervals_of
from excite_cli.robot.model import Robot
from excite_cli.trajectory.fourier import FourierTrajectory
from tests.constraints.test_gradients import check_gradients
from tests.constraints.test_joint_torque import known
from tests.excitation.smoke import one_motion, smoke
from tests.robot.coupled_robots import HAND, coupled_robot

KP, KD, MOST = 30.0, 0.4, {"wrist": 0.3, "finger_1": 0.02}
DRIVES = "measurement={torque: command, command: {kp: 150, kd: 8}}"


def hand() -> Robot:
    return coupled_robot(HAND)


def built(robot: Robot, uncertain: bool = False, **command: Any) -> list[Constraint]:
    law = DriveLawSpec(**{"kp": KP, "kd": KD, **command})
    spec = ConstraintsSpec(joint_limits=None, tracking_error=MOST, any_speed=uncertain)
    measured = MeasurementSpec(torque="command", command=law)
    return list(build_constraints(spec, robot, known(robot, uncertain), measured))


@pytest.mark.parametrize("speeds", [False, True])
def test_it_is_the_distance_that_the_torque_takes(speeds: bool) -> None:
    robot = hand()
    (tracking,) = built(robot, set_point_speeds=speeds)
    assert (tracking.name, tracking.unit) == ("tracking_error", "rad")
    q, v, a = robot.draw_states(40, 1)
    margins = tracking.margins(States(BatchKinematics(robot), q, v, a))
    j = robot.joint_names.index("wrist")
    torque = InverseDynamics(robot).torques(q, v, a)[:, j]
    for side, sign in (("lower", -1.0), ("upper", 1.0)):
        column = tracking.labels.index(f"wrist {side}")
        damping = 0.0 if speeds else KD * np.maximum(sign * v[:, j], 0.0)
        expected = MOST["wrist"] - (sign * torque + damping) / KP
        np.testing.assert_allclose(margins[:, column], expected, atol=1e-12)
    assert {label.split()[0] for label in tracking.labels} == set(MOST)
    units = [tracking.unit_of(k) for k in range(len(tracking.labels))]
    assert units == ["m" if label.startswith("finger") else "rad" for label in tracking.labels]


@pytest.mark.parametrize("uncertain", [False, True])
def test_gradients_and_bounds_between_instants(uncertain: bool) -> None:
    robot = hand()
    family = FourierTrajectory(3, 1.5)
    coefficients = 0.4 * np.random.default_rng(0).normal(size=(family.n_coefficients, robot.n))
    intervals = intervals_of(family, 0.02)
    enclosed = EnclosedMotion(robot, enclosed_states(family, coefficients, intervals))
    found = built(robot, uncertain)
    assert [each.name for each in found] == (
        ["tracking_error", "tracking_error_standing"] if uncertain else ["tracking_error"]
    )
    for tracking in found:
        for seed in range(3):
            check_gradients(robot, tracking, seed, 1e-5)
        least = tracking.least(enclosed)
        assert least is not None
        states = States.along(BatchKinematics(robot), family, coefficients, intervals.middles)
        off = tracking.margins(states) - least
        assert -1e-9 < off.min() <= off.max() < 0.1


def test_with_it_set_points_are_near_and_without_it_are_not() -> None:
    common = (DRIVES, "optimizer.max_iterations=60", "sequence.motions=1")
    judge, free = smoke(*common, "constraints.tracking_error=0.12"), smoke(*common)
    kept = worst_margins(judge, one_motion(judge).coefficients)
    assert all(worst.violations == 0 for worst in kept.values())
    broken = worst_margins(judge, one_motion(free).coefficients)["tracking_error"]
    assert broken.margin < -0.02


def test_limits_of_drives_are_limits_of_torque() -> None:
    settings = "{torque: command, command: {kp: 150, limit: {elbow: 12}}}"
    plain, weak = smoke(), smoke(f"measurement={settings}")
    before, after = (
        next(each for each in problem.constraints if each.name == "joint_torque")
        for problem in (plain, weak)
    )
    label = "elbow upper"
    column = before.labels.index(label)
    assert after.labels[column] == f"{label} (measurement.command.limit)"
    assert after.scale[column] == pytest.approx(0.9 * 12), "the share of constraints.torque.scale"
    others = [k for k, each in enumerate(before.labels) if not each.startswith("elbow")]
    assert [after.labels[k] for k in others] == [before.labels[k] for k in others]
    np.testing.assert_array_equal(after.scale[others], before.scale[others])
    off = smoke("measurement={command: {limit: 1}}").constraints
    assert next(each for each in off if each.name == "joint_torque").labels == before.labels


def test_limits_of_drives_are_enough_where_the_description_has_none() -> None:
    robot, spec = hand(), ConstraintsSpec(joint_limits=None, torque=TorqueSpec())
    measured = MeasurementSpec(torque="command", command=DriveLawSpec(kp=1.0, limit={"wrist": 2}))
    (torque,) = build_constraints(spec, robot, None, measured)
    column = torque.labels.index("wrist upper (measurement.command.limit)")
    assert torque.scale[column] == 2.0


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ((), "constraints.tracking_error: it takes the gains of drives that follow set points. "
         "Give measurement.torque: command and measurement.command.kp, or leave it out."),
        (("measurement={torque: command}",), "measurement.torque: command and measurement.com"),
        ((DRIVES, "constraints.tracking_error={elbw: 0.1}"),
         "constraints.tracking_error: 'elbw' is not a moved joint. Did you mean 'elbow'"),
        (("measurement={torque: command, command: {kp: {elbow: 3}}}",),
         "measurement.command.kp: no value for shoulder_yaw"),
        ((DRIVES, "measurement.command.limit={elbw: 1}", "constraints.tracking_error=null"),
         "measurement.command.limit: 'elbw' is not a moved joint"),
        ((DRIVES, "constraints.tracking_error=0"), "tracking_error"),
    ],
)  # fmt: skip
def test_refusals(changes: tuple[str, ...], words: str) -> None:
    with pytest.raises(ConfigError) as refused:
        smoke("constraints.tracking_error=0.2", *changes)
    assert words in str(refused.value)
