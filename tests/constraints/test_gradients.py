"""Gradients of every constraint against differences, on random and real robots."""

import numpy as np
import pytest

from excite_cli.config.constraints_spec import (
    BoxSpec,
    ConstraintsSpec,
    ContactSpec,
    DiscSpec,
    JointLimitsSpec,
    PolygonSpec,
    SelfCollisionSpec,
    SurroundingsSpec,
    TorqueSpec,
)
from excite_cli.config.robot_spec import JointLimits, RobotSpec, TransmissionSpec
from excite_cli.config.spec import UncertaintySpec
from excite_cli.constraints.base import Constraint
from excite_cli.constraints.catalogue import build_constraints
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.forward_kinematics import BatchKinematics, States
from excite_cli.dynamics.regressor import InverseDynamics
from excite_cli.dynamics.uncertain_inertias import InertiaUncertainty, inertia_uncertainty
from excite_cli.dynamics.whole_robot import CenterOfMass
from excite_cli.errors import ConfigError
from excite_cli.excitation.gradient_check import central_differences
from excite_cli.proof.enclosed_motion import EnclosedMotion, enclosed_states, intervals_of
from excite_cli.robot.model import Robot, build_robot
from excite_cli.trajectory.fourier import FourierTrajectory
from tests.robot.coupled_robots import CLAW, HAND, coupled_robot
from tests.robot.random_robots import random_robot


def _all(balance: DiscSpec | PolygonSpec, collision: bool) -> ConstraintsSpec:
    return ConstraintsSpec(
        joint_limits=JointLimitsSpec(acceleration=8.0, jerk=60.0),
        torque=TorqueSpec(scale=0.7),
        balance=balance,
        self_collision=SelfCollisionSpec() if collision else None,
        any_speed=True,
    )


def check_gradients(robot: Robot, constraint: Constraint, seed: int, tolerance: float) -> None:
    kinematics = BatchKinematics(robot)
    q, v, a = robot.draw_states(3, seed)
    drawn = (q, v, a, 10.0 * a[::-1])
    states = States(kinematics, *drawn)
    margins = constraint.margins(states)
    assert margins.shape == (3, len(constraint.labels)) == (3, len(constraint.scale))
    columns = np.random.default_rng(seed).permutation(margins.shape[1])[:4]
    times = np.repeat(np.arange(3), len(columns))
    every = np.tile(columns, 3)
    parts = constraint.gradients(states, times, every)
    for row, (t, column) in enumerate(zip(times, every, strict=True)):
        for order, part in enumerate(parts):

            def margin(x: np.ndarray, t: int = t, c: int = column, order: int = order) -> float:
                moved = [each[t : t + 1] for each in drawn]
                moved[order] = x[None]
                return float(constraint.margins(States(kinematics, *moved))[0, c])

            expected = central_differences(margin, drawn[order][t], 1e-6)
            found = np.zeros(robot.n) if part is None else part[row]
            size = 1.0 + np.abs(expected).max()
            assert np.abs(found - expected).max() < tolerance * size, constraint.labels[column]


@pytest.mark.parametrize("seed", range(4))
def test_gradients_on_random_robots(seed: int) -> None:
    robot = random_robot(seed, joints=4, floating=seed % 2 == 1)
    polygon = PolygonSpec(kind="polygon", vertices=((1, 1), (-1, 1), (-1, -1), (1, -1)))
    for constraint in build_constraints(_all(polygon, collision=False), robot):
        check_gradients(robot, constraint, seed, 1e-6)


def test_gradients_on_a_real_arm_with_capsules() -> None:
    robot = build_robot(RobotSpec(urdf="example-robot-data:panda"))
    for constraint in build_constraints(_all(DiscSpec(radius=0.3), collision=True), robot):
        check_gradients(robot, constraint, 1, 1e-5)


@pytest.mark.parametrize("uncertain", [False, True])
@pytest.mark.parametrize("parts", [HAND, CLAW], ids=["hand", "claw"])
def test_gradients_where_joints_follow_others(parts: tuple, uncertain: bool) -> None:
    robot = coupled_robot(parts, base="floating", rows=("joints",))
    around = SurroundingsSpec(
        floor=-0.2, boxes={"box": BoxSpec(size=(1, 1, 1), position=(2, 0, 0))}
    )
    ground = ContactSpec(friction=0.7)
    spec = _all(DiscSpec(radius=0.3), collision=True).model_copy(
        update={"contact": ground, "surroundings": around}
    )
    found = build_constraints(spec, robot, known(robot, uncertain))
    assert {"joint_torque", "balance", "contact", "self_collision", "surroundings"} <= {
        constraint.name for constraint in found
    }
    for constraint in found:
        check_gradients(robot, constraint, 1, 1e-5)


def with_motors() -> Robot:
    wrist = TransmissionSpec(
        joints=("shoulder", "wrist"),
        motors=("m1", "m2"),
        matrix=((0.5, 0.5), (0.4, -0.6)),
        limits={"m1": JointLimits(position=(-1.5, 2.0), velocity=1.5, acceleration=5.0, jerk=40.0,
                                  effort=3.0),
                "m2": JointLimits(effort=4.0)},
    )  # fmt: skip
    return coupled_robot(HAND, transmissions=(wrist,))


def known(robot: Robot, uncertain: bool) -> InertiaUncertainty | None:
    if not uncertain:
        return None
    return inertia_uncertainty(UncertaintySpec(mass=0.1), robot, find_base_parameters(robot))


@pytest.mark.parametrize("uncertain", [False, True])
def test_motors_that_drive_several_joints_are_bounded(uncertain: bool) -> None:
    robot = with_motors()
    spec = ConstraintsSpec(
        joint_limits=JointLimitsSpec(acceleration=8.0, scale=0.5), torque=TorqueSpec(scale=0.5)
    )
    found = {each.name: each for each in build_constraints(spec, robot, known(robot, uncertain))}
    of_motors = ("motor_position", "motor_velocity", "motor_acceleration", "motor_jerk",
                 "motor_torque")  # fmt: skip
    assert set(of_motors) < set(found)
    for name in of_motors:
        check_gradients(robot, found[name], 1, 1e-5)
    assert found["motor_torque"].labels == ("m1 lower", "m2 lower", "m1 upper", "m2 upper")
    q, v, a = robot.draw_states(30, 1)
    states = States(BatchKinematics(robot), q, v, a)
    matrix = np.array([[0.5, 0.5], [0.4, -0.6]])
    theta, speed = (np.linalg.solve(matrix, x[:, :2].T).T for x in (q, v))
    position = np.column_stack([theta[:, 0] + 1.5, 2.0 - theta[:, 0]])
    np.testing.assert_allclose(found["motor_position"].margins(states), position, atol=1e-12)
    allowed = 0.5 * 1.5
    velocity = np.column_stack([allowed + speed[:, 0], allowed - speed[:, 0]])
    np.testing.assert_allclose(found["motor_velocity"].margins(states), velocity, atol=1e-12)
    torque = InverseDynamics(robot).torques(q, v, a)[:, :2] @ matrix
    plain = np.hstack([np.array([1.5, 2.0]) + torque, np.array([1.5, 2.0]) - torque])
    margins = found["motor_torque"].margins(states)
    if uncertain:
        assert (margins < plain).all()
    else:
        np.testing.assert_allclose(margins, plain, atol=1e-12)


def test_a_pace_is_a_share_of_all_limits_of_motion() -> None:
    """Of joints and of motors; positions stay."""
    robot = with_motors()
    limits = JointLimitsSpec(acceleration=8.0, jerk=90.0, scale=0.5)
    full, slow = (
        build_constraints(ConstraintsSpec(joint_limits=each), robot)
        for each in (limits, limits.model_copy(update={"pace": 0.4}))
    )
    assert len(full) == 8
    for one, other in zip(full, slow, strict=True):
        share = 1.0 if one.name.endswith("position") else 0.4
        np.testing.assert_allclose(other.scale, share * one.scale)


@pytest.mark.parametrize("uncertain", [False, True])
def test_bounds_of_motors_between_instants_hold_at_instants(uncertain: bool) -> None:
    robot = with_motors()
    family = FourierTrajectory(3, 1.5)
    drawn = np.random.default_rng(0).normal(size=(family.n_coefficients, robot.n))
    coefficients = drawn * [0.4, 0.4, 0.01]
    intervals = intervals_of(family, 0.02)
    motion = EnclosedMotion(robot, enclosed_states(family, coefficients, intervals))
    spec = ConstraintsSpec(joint_limits=JointLimitsSpec(), torque=TorqueSpec())
    found = build_constraints(spec, robot, known(robot, uncertain))
    for constraint in (each for each in found if each.name.startswith("motor")):
        least = constraint.least(motion)
        assert least is not None
        for s in (-1.0, -0.3, 0.0, 1.0):
            times = intervals.middles + s * intervals.halves
            at = States.along(BatchKinematics(robot), family, coefficients, times)
            margins = constraint.margins(at)
            assert (margins - least).min() > -1e-9
            assert (margins - least).min() < 0.05 * constraint.scale.max()


def test_disc_margin_is_inside_the_circle() -> None:
    robot = random_robot(2, joints=4)
    spec = ConstraintsSpec(joint_limits=None, balance=DiscSpec(radius=0.05, center=(0.1, -0.2)))
    (disc,) = build_constraints(spec, robot)
    states = States(BatchKinematics(robot), *robot.draw_states(200, 0))
    margins = disc.margins(states).min(axis=1)
    center = CenterOfMass(robot).position(states)[:, :2]
    radial = 0.05 - np.linalg.norm(center - [0.1, -0.2], axis=1)
    assert (margins >= 0).any()
    assert np.all(radial[margins >= 0] >= 0)
    # The inscribed polygon of 16 sides gives away less than 2 % of the radius.
    assert np.all(margins[radial > 0] >= radial[radial > 0] - 0.02 * 0.05)


def test_polygon_takes_vertices_in_any_order_and_its_margin() -> None:
    robot = random_robot(2, joints=3)
    corners = ((0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0))
    spec = ConstraintsSpec(
        joint_limits=None, balance=PolygonSpec(kind="polygon", vertices=corners, margin=0.1)
    )
    (polygon,) = build_constraints(spec, robot)
    states = States(BatchKinematics(robot), *robot.draw_states(50, 1))
    x, y = CenterOfMass(robot).position(states)[:, :2].T
    expected = np.minimum.reduce([x, 2 - x, y, 2 - y]) - 0.1
    assert np.allclose(polygon.margins(states).min(axis=1), expected)


CORNER = ((0, 0), (1, 0), (0, 1))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"balance": {"vertices": ((0, 0), (1, 1), (2, 2))}}, "lie on a line"),
        ({"balance": {"vertices": CORNER, "margin": 0.6}}, "leaves nothing of the polygon"),
        (
            {"joint_limits": {"position_margin": 3.0}},
            "position_margin: 3 leaves no range for joint_",
        ),
    ],
)
def test_what_leaves_no_room_is_refused(given: dict, message: str) -> None:
    given.get("balance", {})["kind"] = "polygon"
    spec = ConstraintsSpec.model_validate(given)
    with pytest.raises(ConfigError, match=message):
        build_constraints(spec, random_robot(1, joints=2))


@pytest.mark.parametrize("share", [0.3, 1.0])
def test_quick_margins_are_exact_within_reach_and_bounds_beyond(share: float) -> None:
    robot = build_robot(RobotSpec(urdf="example-robot-data:panda"))
    for constraint in build_constraints(_all(DiscSpec(radius=0.3), collision=True), robot):
        q, v, a = robot.draw_states(60, 2)
        states = States(BatchKinematics(robot), q, v, a, 10.0 * a)
        exact, reach = constraint.margins(states), share * constraint.scale
        quick = constraint.margins_within(states, reach)
        near = exact < reach
        assert np.allclose(quick[near], exact[near], atol=1e-12)
        assert np.all((quick >= reach)[~near])
