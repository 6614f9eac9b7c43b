"""Effects of single joints and pairs, against formulas written another way."""

import numpy as np
import pytest

from excite_cli.effects.asymmetric_friction import AsymmetricFriction
from excite_cli.effects.base import Signals
from excite_cli.effects.cable_force import CableForce
from excite_cli.effects.coupled_friction import CoupledFriction
from excite_cli.effects.friction_drift import FrictionDrift
from excite_cli.effects.load_dependent_friction import LoadDependentFriction
from excite_cli.effects.nonlinear_viscous_friction import NonlinearViscousFriction
from excite_cli.effects.spring import Spring
from excite_cli.effects.stribeck_friction import StribeckFriction
from excite_cli.effects.torque_delay import TorqueDelay
from excite_cli.effects.torque_saturation import TorqueSaturation
from excite_cli.robot.model import Array
from tests.effects.motions import signals_of
from tests.robot.random_robots import random_robot

ROBOT = random_robot(5, joints=3, branches=False, prismatic=False)
SIGNALS = signals_of(ROBOT, 400)


def test_friction_that_depends_on_load_or_time() -> None:
    tau = LoadDependentFriction((1,)).torque(SIGNALS, np.array([0.07]))
    fast = np.abs(SIGNALS.v[:, 1]) > 0.01
    power = (tau * SIGNALS.v)[fast].sum(axis=1)
    assert power == pytest.approx(0.07 * np.abs(SIGNALS.load * SIGNALS.v)[fast, 1])
    # Friction drift is friction that grows from zero.
    tau = FrictionDrift((0,)).torque(SIGNALS, np.array([-0.2, 0.3]))[:, 0]
    v, fast = SIGNALS.v[:, 0], np.abs(SIGNALS.v[:, 0]) > 0.01
    expected = SIGNALS.t * (-0.2 * np.sign(v) + 0.3 * v)
    assert tau[fast] == pytest.approx(expected[fast])
    # Asymmetric friction differs between directions.
    tau = AsymmetricFriction((1,)).torque(SIGNALS, np.array([5.0, 2.0]))[:, 1]
    fast = np.abs(SIGNALS.v[:, 1]) > 0.01
    assert tau[fast] == pytest.approx(np.where(SIGNALS.v[fast, 1] > 0, 5.0, -2.0))


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
    # Stribeck speeds follow the speeds seen.
    fastest = np.abs(SIGNALS.v[:, 2]).max()
    speeds = [shape["stribeck_speed"] for shape in StribeckFriction.grid(ROBOT, (2,), [SIGNALS])]
    assert speeds == pytest.approx(fastest * np.geomspace(0.01, 0.3, 5))
    slow = Signals(**{**vars(SIGNALS), "v": SIGNALS.v * 1e-3})
    assert [s["stribeck_speed"] for s in StribeckFriction.grid(ROBOT, (2,), [slow])] == [0.005]


def test_coupled_friction_is_that_of_the_tx40() -> None:
    """τ5 += fv6 v6 + fs6 sgn(v5 + v6), τ6 += fv6 v5 + fs6 sgn(v5 + v6)."""
    tau = CoupledFriction((1, 2), {"direction": 1.0}).torque(SIGNALS, np.array([0.8, 1.5]))
    v5, v6 = SIGNALS.v[:, 1], SIGNALS.v[:, 2]
    fast = np.abs(v5 + v6) > 0.01
    sign = np.sign(v5 + v6)
    assert tau[fast, 1] == pytest.approx((0.8 * v6 + 1.5 * sign)[fast])
    assert tau[fast, 2] == pytest.approx((0.8 * v5 + 1.5 * sign)[fast])
    assert not tau[:, 0].any()


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
