"""Effects of single joints and pairs, against formulas written another way."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Signals
from excite_cli.effects.base_tilt import BaseTilt
from excite_cli.effects.cable_force import CableForce
from excite_cli.effects.catalogue import kind_named
from excite_cli.effects.coupled_friction import CoupledFriction
from excite_cli.effects.nonlinear_viscous_friction import NonlinearViscousFriction
from excite_cli.effects.payload import Payload
from excite_cli.effects.spring import Spring
from excite_cli.effects.stribeck_friction import StribeckFriction
from excite_cli.effects.torque_delay import TorqueDelay
from excite_cli.effects.torque_saturation import TorqueSaturation
from excite_cli.identification.regression import carried_by, with_effects
from excite_cli.robot.model import Array
from tests.effects.motions import signals_of
from tests.robot.random_robots import random_robot

ROBOT = random_robot(5, joints=3, branches=False, prismatic=False)
SIGNALS = signals_of(ROBOT, 400)
V, T = SIGNALS.v, SIGNALS.t
LOSS = np.where(SIGNALS.load * V > 0, 0.15, 0.05)
SIGN = np.sign(V[:, 1] + V[:, 2])


@pytest.mark.parametrize(
    ("kind", "joints", "values", "expected"),
    [
        ("asymmetric_friction", (1,), (5.0, 2.0), [np.where(V[:, 1] > 0, 5.0, -2.0)]),
        ("load_dependent_friction", (1,), (0.07,), [0.07 * (abs(SIGNALS.load) * np.sign(V)).T[1]]),
        ("gear_loss", (1,), (0.15, 0.05), [(LOSS * abs(SIGNALS.load) * np.sign(V)).T[1]]),
        ("friction_drift", (0,), (-0.2, 0.3), [T * (-0.2 * np.sign(V) + 0.3 * V).T[0]]),
        # Of the TX40: τ5 += fv6 v6 + fs6 sgn(v5 + v6), τ6 += fv6 v5 + fs6 sgn(v5 + v6).
        ("coupled_friction", (1, 2), (0.8, 1.5), [0.8 * V.T[j] + 1.5 * SIGN for j in (2, 1)]),
    ],
)
def test_formulas(
    kind: str, joints: tuple[int, ...], values: tuple[float, ...], expected: list[Array]
) -> None:
    shape = {"direction": 1.0} if kind == "coupled_friction" else {}
    tau = kind_named(kind)(joints, shape).torque(SIGNALS, np.array(values))
    fast = np.abs(V[:, joints].sum(axis=1)) > 0.01
    for joint, torque in zip(joints, expected, strict=True):
        assert tau[fast, joint] == pytest.approx(torque[fast])
    assert not np.delete(tau, joints, axis=1).any()


@pytest.mark.parametrize("power", [0.5, 2.0, 3.0])
def test_nonlinear_viscous_friction_is_a_signed_power(power: float) -> None:
    v = SIGNALS.v[:, 0]
    column = NonlinearViscousFriction((0,), {"power": power}).columns(SIGNALS)[:, 0, 0]
    assert column == pytest.approx(np.sign(v) * np.abs(v) ** power, rel=1e-3, abs=2e-2)


def test_stribeck_friction_is_gone_at_three_times_its_speed() -> None:
    speeds = np.array([0.005, 0.01, -0.01, 0.3, -0.5])
    slow = Signals(**{**vars(SIGNALS), "v": np.tile(speeds[:, None], 3)})
    column = StribeckFriction((0,), {"stribeck_speed": 0.1}).columns(slow)[:, 0, 0]
    assert column == pytest.approx([1.0, 1.0, -1.0, 0.0, 0.0], abs=0.01)
    # One that grows with the load is so much of that.
    slow = replace(slow, load=SIGNALS.load[: len(speeds)])
    by_load = StribeckFriction((0,), {"stribeck_speed": 0.1, "load_power": 1.0}).columns(slow)
    assert by_load[:, 0, 0] == pytest.approx(np.abs(slow.load[:, 0]) * column)
    # Stribeck speeds follow the speeds seen.
    fastest = np.abs(SIGNALS.v[:, 2]).max()
    speeds = [shape["stribeck_speed"] for shape in StribeckFriction.grid(ROBOT, (2,), [SIGNALS])]
    assert speeds == pytest.approx(fastest * np.geomspace(0.01, 0.3, 5))
    slow = Signals(**{**vars(SIGNALS), "v": SIGNALS.v * 1e-3})
    assert [s["stribeck_speed"] for s in StribeckFriction.grid(ROBOT, (2,), [slow])] == [0.005]


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_coupled_friction_with_own_shares_takes_the_power_of_the_shaft(direction: float) -> None:
    effect = CoupledFriction((0, 1), {"direction": direction})
    v = SIGNALS.v[:, :2]
    tau = effect.torque(SIGNALS, np.array([0.8, 1.5]))[:, :2] + 0.8 * v
    shaft = v[:, 0] + direction * v[:, 1]
    fast = np.abs(shaft) > 0.01
    expected = 0.8 * shaft**2 + 1.5 * np.abs(shaft)
    assert (tau * v).sum(axis=1)[fast] == pytest.approx(expected[fast])


def test_cable_force_is_the_gradient_of_its_potential() -> None:
    c = np.array([1.3, -0.7, 2.1])

    def potential(x: Array, y: Array) -> Array:
        return c[0] * x * y + c[1] * x**2 * y + c[2] * x * y**2

    x, y, h = SIGNALS.q[:, 0], SIGNALS.q[:, 1], 1e-6
    tau = CableForce((0, 1)).torque(SIGNALS, c)
    assert tau[:, 0] == pytest.approx((potential(x + h, y) - potential(x - h, y)) / (2 * h))
    assert tau[:, 1] == pytest.approx((potential(x, y + h) - potential(x, y - h)) / (2 * h))
    # Pairs are neighbours in the tree.
    tree = random_robot(31, joints=6)
    model = tree.model
    expected = {(int(model.parents[k]) - 1, k - 1) for k in range(2, 7) if model.parents[k] > 0}
    assert set(CableForce.places(tree)) == expected
    assert expected != {(k, k + 1) for k in range(5)}


def test_spring_rests_where_it_was_planted() -> None:
    shape, values = Spring.planted(40.0, {"rest_position": 0.3})
    at_rest = Signals(**{**vars(SIGNALS), "q": np.full_like(SIGNALS.q, 0.3)})
    assert Spring((2,), shape).torque(at_rest, values) == pytest.approx(0.0)
    found = Spring((2,)).report(values, np.diag([4.0, 1.0]))
    assert found["rest_position"].value == pytest.approx(0.3)
    # σ² = (c/k²)² σ_k² + σ_c²/k²
    expected = np.hypot(12 / 1600 * 2.0, 1 / 40)
    assert found["rest_position"].std == pytest.approx(expected)
    assert Spring((2,)).mjcf(values) == pytest.approx({"stiffness": 40.0, "springref": 0.3})
    assert Spring((2,)).mjcf(-values) == {}


def test_torque_delay_is_a_shift_in_time() -> None:
    signals, shift = signals_of(ROBOT, 2000, step=0.002), 5
    late = np.roll(signals.torque, shift, axis=0)
    effect = TorqueDelay((0, 1, 2))
    change = effect.torque(signals, np.array([shift * 0.002]))
    inner = slice(10, -10)
    missed = np.linalg.norm((late - signals.torque - change)[inner])
    assert missed < 0.05 * np.linalg.norm((late - signals.torque)[inner])
    assert TorqueDelay.places(ROBOT) == [(0, 1, 2), (0,), (1,), (2,)]
    assert TorqueDelay((1,)).rows(3) == (1,)


def test_a_delay_leaves_jumps_where_they_are() -> None:
    """Where a joint turns back, and where it stands and its speed flickers about zero."""
    torque = SIGNALS.torque + 5.0 * np.sign(SIGNALS.v)
    v = SIGNALS.v.copy()
    v[50:60, 0] = 1e-6 * (-1.0) ** np.arange(10)
    seen = Signals(**{**vars(SIGNALS), "v": v, "torque": torque})
    columns = TorqueDelay((0, 1, 2)).columns(seen)[:, :, 0]
    back = np.signbit(v)
    turns = np.flatnonzero(back[1:, 1] != back[:-1, 1])
    assert len(turns) > 0
    smooth = -SIGNALS.rate(SIGNALS.torque)
    assert columns[:, 1] == pytest.approx(smooth[:, 1], abs=0.05 * np.abs(smooth[:, 1]).max())
    assert np.abs(columns[50:60, 0]).max() < 1.1 * np.abs(smooth[48:62, 0]).max()
    away = np.setdiff1d(np.arange(len(v)), [*turns, *(turns + 1)])
    assert columns[away, 1] == pytest.approx(smooth[away, 1])


def test_a_base_that_leans_draws_on_what_is_carried() -> None:
    """As it draws on the same bodies if they are the robot's own."""
    effects = (BaseTilt((0, 1, 2)), Payload((2,)))
    values = np.array([0.05, -0.02, 1.5, 0.1, 0.0, 0.2, 0.02, 0.0, 0.02, 0.0, 0.0, 0.02])
    seen = with_effects(SIGNALS, effects, values)
    phi = SIGNALS.body.phi + carried_by(effects, values, ROBOT, SIGNALS.run)
    own = RigidBody(ROBOT, phi, SIGNALS.q, SIGNALS.v, SIGNALS.a)
    alone = BaseTilt((0, 1, 2)).columns(Signals(**{**vars(SIGNALS), "body": own}))
    assert BaseTilt((0, 1, 2)).columns(seen) == pytest.approx(alone)
    assert seen.torque == pytest.approx(own.load + alone @ values[:2])
    assert np.abs(alone - BaseTilt((0, 1, 2)).columns(SIGNALS)).max() > 1.0
    assert seen.cut(slice(0, 5)).whole_body.q.shape == (5, 3)


def test_torque_saturation_is_a_clipped_torque() -> None:
    grid = TorqueSaturation.grid(ROBOT, (1,), [SIGNALS])
    above = []
    for shape in grid:
        clipped = SIGNALS.torque.copy()
        level = shape["level"]
        clipped[:, 1] = np.clip(clipped[:, 1], -level, level)
        tau = TorqueSaturation((1,), shape).torque(SIGNALS, np.array([1.0]))
        assert SIGNALS.torque + tau == pytest.approx(clipped)
        above.append((np.abs(SIGNALS.torque[:, 1]) > level).mean())
    assert above == pytest.approx([0.3, 0.2, 0.1, 0.05, 0.02], abs=0.01)
