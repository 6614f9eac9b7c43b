"""Effects that show on all joints, against Pinocchio with the thing itself changed."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp

from excite_cli.effects.base import Signals
from excite_cli.effects.base_tilt import BaseTilt
from excite_cli.effects.contact import Contact
from excite_cli.effects.elasticity import Elasticity
from excite_cli.effects.encoder_offset import EncoderOffset
from excite_cli.effects.payload import Payload
from excite_cli.robot.model import Array, Robot
from tests.effects.motions import signals_at, signals_of
from tests.robot.random_robots import random_robot

ROBOTS = {
    "chain": random_robot(11, joints=4, branches=False, prismatic=False),
    "tree with slides": random_robot(12, joints=5),
    "floating base": random_robot(14, joints=4, floating=True, branches=False),
}


@pytest.fixture(params=list(ROBOTS))
def robot(request: pytest.FixtureRequest) -> Robot:
    return ROBOTS[request.param]


def _torques(robot: Robot, model: pin.Model, signals: Signals, **shift: float) -> Array:
    """RNEA (T, n) of a changed model; `joint` and `by` shift one position."""
    q, data = signals.q.copy(), model.createData()
    if shift:
        q[:, int(shift["joint"])] += shift["by"]
    states = zip(
        robot.configurations(q),
        robot.velocities(signals.v),
        robot.velocities(signals.a),
        strict=True,
    )
    return np.array([pin.rnea(model, data, *state)[robot.moved] for state in states])


def _turned(robot: Robot, axis: Array, angle: float) -> pin.Model:
    """The robot's base itself turned in the world, gravity as it was."""
    model = robot.model.copy()
    turn = pin.SE3(pin.exp3(axis * angle), np.zeros(3))
    for joint in range(1, model.njoints):
        if model.parents[joint] == 0:
            model.jointPlacements[joint] = turn * model.jointPlacements[joint]
    return model


def test_base_tilt_is_what_turning_the_base_does(robot: Robot) -> None:
    signals, angle = signals_of(robot, 20), 1e-4
    columns = BaseTilt(tuple(range(robot.n))).columns(signals)
    for p, axis in enumerate(np.eye(3)[:2]):
        change = [_torques(robot, _turned(robot, axis, by), signals) for by in (angle, -angle)]
        assert columns[:, :, p] == pytest.approx((change[0] - change[1]) / (2 * angle), abs=1e-5)


def test_base_tilt_on_a_wall_leaves_out_the_axis_of_gravity() -> None:
    robot = ROBOTS["chain"]
    model = robot.model.copy()
    model.gravity.linear = np.array([9.81, 0.0, 0.0])
    columns = BaseTilt(tuple(range(4))).columns(signals_of(replace(robot, model=model), 20))
    assert np.linalg.matrix_rank(columns.reshape(-1, 2)) == 2


def test_encoder_offset_is_inverse_dynamics_at_the_true_position(robot: Robot) -> None:
    signals, by = signals_of(robot, 20), 1e-5
    for j in range(robot.n):
        column = EncoderOffset((j,)).columns(signals)[:, :, 0]
        ahead = _torques(robot, robot.model, signals, joint=j, by=by)
        behind = _torques(robot, robot.model, signals, joint=j, by=-by)
        assert column == pytest.approx((ahead - behind) / (2 * by), abs=1e-5)


def test_payload_is_a_body_added_to_the_last_link(robot: Robot) -> None:
    signals, center = signals_of(robot, 20), np.array([0.02, -0.03, 0.11])
    others = {"cx": 0.02, "cy": -0.03, "cz": 0.11, "radius": 0.07}
    shape, values = Payload.planted(2.5, others)
    model = robot.model.copy()
    ball = pin.Inertia(2.5, center, 0.4 * 2.5 * 0.07**2 * np.eye(3))
    model.inertias[model.njoints - 1] += ball
    added = Payload(tuple(range(robot.n)), shape).torque(signals, values)
    assert added == pytest.approx(_torques(robot, model, signals) - signals.load, abs=1e-9)


def test_payload_reports_its_centre_with_a_deviation() -> None:
    _, values = Payload.planted(2.0, {"cx": 0.1})
    covariance = np.diag([0.04, *np.full(9, 1e-4)])
    found = Payload((0,)).report(values, covariance)
    assert found["cx"].value == pytest.approx(0.1)
    assert found["cz"].value == pytest.approx(0.05)
    draws = np.random.default_rng(0).multivariate_normal(values, covariance / 100, 20000)
    assert found["cx"].std / 10 == pytest.approx(np.std(draws[:, 1] / draws[:, 0]), rel=0.03)
    assert (found["cx"].unit, found["mass"].unit) == ("m", "kg")


def test_contact_is_what_an_external_force_takes_from_the_motors(robot: Robot) -> None:
    signals, force = signals_of(robot, 30), np.array([3.0, -7.0, 11.0])
    model, data = robot.model, robot.model.createData()
    last, expected = model.njoints - 1, np.zeros_like(signals.q)
    q, v = robot.configurations(signals.q), robot.velocities(signals.v)
    a = robot.velocities(signals.a)
    for t in np.flatnonzero((signals.t >= 0.1) & (signals.t <= 0.4)):
        pin.forwardKinematics(model, data, q[t])
        forces = [pin.Force.Zero() for _ in range(model.njoints)]
        forces[last] = pin.Force(data.oMi[last].rotation.T @ force, np.zeros(3))
        with_force = pin.rnea(model, data, q[t], v[t], a[t], forces)[robot.moved]
        expected[t] = with_force - signals.load[t]
    effect = Contact(tuple(range(robot.n)), {"start": 0.1, "end": 0.4})
    assert np.abs(expected).max() > 0.1
    assert effect.torque(signals, force) == pytest.approx(expected, abs=1e-9)


def test_contact_window_is_found_in_noise() -> None:
    robot = ROBOTS["chain"]
    signals = signals_of(robot, 1000)
    there = Contact(tuple(range(4)), {"start": 7.0, "end": 8.3})
    noise = np.random.default_rng(1).normal(size=signals.q.shape) * [5.0, 1.0, 1.0, 0.2]
    residual = there.torque(signals, np.array([9.0, -6.0, 5.0])) + noise
    (found,) = Contact.tuned(robot, there.joints, [signals], [residual])
    assert found["start"] == pytest.approx(7.0, abs=0.1)
    assert found["end"] == pytest.approx(8.3, abs=0.1)


def test_elasticity_recovers_the_stiffness_of_two_inertias() -> None:
    """Motor and link of the last joint with a spring between them, integrated.

    The first joint stands still; only the motor's angle is seen.
    """
    robot = random_robot(21, joints=2, branches=False, prismatic=False)
    model, data, zero = robot.model, robot.model.createData(), np.zeros(2)
    inertia = pin.crba(model, data, zero)[1, 1]
    stiffness, damping, rotor = 4000.0 * inertia, 4.0 * inertia, 0.5 * inertia

    def rates(t: float, x: Array) -> Array:
        motor, link, motor_speed, link_speed = x
        twist = stiffness * (motor - link) + damping * (motor_speed - link_speed)
        wanted, wanted_speed = 0.8 * np.sin(3 * t), 2.4 * np.cos(3 * t)
        drive = inertia * (900.0 * (wanted - motor) + 90.0 * (wanted_speed - motor_speed))
        weight = pin.rnea(model, data, np.array([0.0, link]), zero, zero)[1]
        accelerations = (drive - twist) / rotor, (twist - weight) / inertia
        return np.array([motor_speed, link_speed, *accelerations])

    t = np.arange(0.0, 3.0, 0.002)
    path = solve_ivp(rates, (0, 3), np.zeros(4), t_eval=t, rtol=1e-8, atol=1e-10).y
    keep = t > 1.0  # the spring's own oscillation has died out
    slopes = np.array([rates(at, x) for at, x in zip(t[keep], path.T[keep], strict=True)])
    still = np.zeros(keep.sum())
    q, v = (np.stack([still, path[i, keep]], axis=-1) for i in (0, 2))
    a = np.stack([still, slopes[:, 2]], axis=-1)
    signals = signals_at(robot, t[keep] - 1.0, q, v, a)
    twist = stiffness * (path[0] - path[1]) + damping * (path[2] - path[3])
    inner = slice(5, -5)  # second rates at the ends are one-sided
    column = Elasticity((1,)).columns(signals)[inner, 1, 0]
    residual = (twist[keep] - signals.load[:, 1])[inner]
    compliance = float(column @ residual / (column @ column))
    assert compliance == pytest.approx(1 / stiffness, rel=0.01)
    left = np.linalg.norm(residual - compliance * column) / np.linalg.norm(residual)
    assert left < 0.02
    found = Elasticity((0,)).report(np.array([1e-4]), np.array([[1e-10]]))
    assert (found["stiffness"].value, found["stiffness"].std) == pytest.approx((1e4, 1e3))
