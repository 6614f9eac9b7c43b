"""Effects of single joints and pairs, against formulas written another way."""

import numpy as np
import pytest

from excite_cli.effects.asymmetric_friction import AsymmetricFriction
from excite_cli.effects.base import Signals
from excite_cli.effects.cable_force import CableForce
from excite_cli.effects.catalogue import catalogue
from excite_cli.effects.coupled_friction import CoupledFriction
from excite_cli.effects.friction_drift import FrictionDrift
from excite_cli.effects.load_dependent_friction import LoadDependentFriction
from excite_cli.effects.nonlinear_viscous_friction import NonlinearViscousFriction
from excite_cli.effects.spring import Spring
from excite_cli.effects.stribeck_friction import StribeckFriction
from excite_cli.effects.torque_delay import TorqueDelay
from excite_cli.effects.torque_saturation import TorqueSaturation
from excite_cli.robot.model import Array, Robot
from tests.effects.motions import signals_of
from tests.robot.random_robots import random_robot


@pytest.fixture(scope="module")
def robot() -> Robot:
    return random_robot(5, joints=3, branches=False, prismatic=False)


@pytest.fixture(scope="module")
def signals(robot: Robot) -> Signals:
    return signals_of(robot, 400)


def _left(columns: Array, wanted: Array) -> float:
    """Share of `wanted` (T, k) that is not in the span of `columns` (T, p)."""
    fit = columns @ np.linalg.lstsq(columns, wanted, rcond=None)[0]
    return float(np.linalg.norm(wanted - fit) / np.linalg.norm(wanted))


def test_asymmetric_friction_differs_between_directions(signals: Signals) -> None:
    tau = AsymmetricFriction((1,)).torque(signals, np.array([5.0, 2.0]))[:, 1]
    fast = np.abs(signals.v[:, 1]) > 0.01
    assert tau[fast] == pytest.approx(np.where(signals.v[fast, 1] > 0, 5.0, -2.0))


def test_asymmetric_friction_is_coulomb_friction_and_offset(signals: Signals) -> None:
    kinds = catalogue()
    parts = [kinds[name]((1,)).columns(signals) for name in ("coulomb_friction", "torque_offset")]
    both = np.concatenate(parts, axis=2)[:, 0]
    assert _left(both, AsymmetricFriction((1,)).columns(signals)[:, 0]) < 1e-12


@pytest.mark.parametrize("power", [0.5, 2.0, 3.0])
def test_nonlinear_viscous_friction_is_a_signed_power(power: float, signals: Signals) -> None:
    v = signals.v[:, 0]
    column = NonlinearViscousFriction((0,), {"power": power}).columns(signals)[:, 0, 0]
    assert column == pytest.approx(np.sign(v) * np.abs(v) ** power, rel=1e-3, abs=2e-2)


def test_stribeck_friction_is_gone_at_three_times_its_speed(signals: Signals) -> None:
    speeds = np.array([0.005, 0.01, -0.01, 0.3, -0.5])
    slow = Signals(**{**vars(signals), "v": np.tile(speeds[:, None], 3)})
    column = StribeckFriction((0,), {"stribeck_speed": 0.1}).columns(slow)[:, 0, 0]
    assert column == pytest.approx([1.0, 1.0, -1.0, 0.0, 0.0], abs=0.01)


def test_stribeck_speeds_follow_the_speeds_seen(robot: Robot, signals: Signals) -> None:
    fastest = np.abs(signals.v[:, 2]).max()
    speeds = [shape["stribeck_speed"] for shape in StribeckFriction.grid(robot, (2,), [signals])]
    assert speeds == pytest.approx(fastest * np.geomspace(0.01, 0.3, 5))
    slow = Signals(**{**vars(signals), "v": signals.v * 1e-3})
    assert [s["stribeck_speed"] for s in StribeckFriction.grid(robot, (2,), [slow])] == [0.005]


def test_load_dependent_friction_takes_power_in_proportion_to_the_load(signals: Signals) -> None:
    tau = LoadDependentFriction((1,)).torque(signals, np.array([0.07]))
    fast = np.abs(signals.v[:, 1]) > 0.01
    power = (tau * signals.v)[fast].sum(axis=1)
    assert power == pytest.approx(0.07 * np.abs(signals.load * signals.v)[fast, 1])


def test_friction_drift_is_friction_that_grows_from_zero(signals: Signals) -> None:
    tau = FrictionDrift((0,)).torque(signals, np.array([-0.2, 0.3]))[:, 0]
    v, fast = signals.v[:, 0], np.abs(signals.v[:, 0]) > 0.01
    expected = signals.t * (-0.2 * np.sign(v) + 0.3 * v)
    assert tau[fast] == pytest.approx(expected[fast])


def test_coupled_friction_is_that_of_the_tx40(signals: Signals) -> None:
    """τ5 += fv6 v6 + fs6 sgn(v5 + v6), τ6 += fv6 v5 + fs6 sgn(v5 + v6)."""
    tau = CoupledFriction((1, 2), {"direction": 1.0}).torque(signals, np.array([0.8, 1.5]))
    v5, v6 = signals.v[:, 1], signals.v[:, 2]
    fast = np.abs(v5 + v6) > 0.01
    sign = np.sign(v5 + v6)
    assert tau[fast, 1] == pytest.approx((0.8 * v6 + 1.5 * sign)[fast])
    assert tau[fast, 2] == pytest.approx((0.8 * v5 + 1.5 * sign)[fast])
    assert not tau[:, 0].any()


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_coupled_friction_with_own_shares_takes_the_power_of_the_shaft(
    direction: float, signals: Signals
) -> None:
    effect = CoupledFriction((0, 1), {"direction": direction})
    v = signals.v[:, :2]
    tau = effect.torque(signals, np.array([0.8, 1.5]))[:, :2] + 0.8 * v
    shaft = v[:, 0] + direction * v[:, 1]
    fast = np.abs(shaft) > 0.01
    expected = 0.8 * shaft**2 + 1.5 * np.abs(shaft)
    assert (tau * v).sum(axis=1)[fast] == pytest.approx(expected[fast])


def test_cable_force_is_the_gradient_of_its_potential(signals: Signals) -> None:
    c = np.array([1.3, -0.7, 2.1])

    def potential(x: Array, y: Array) -> Array:
        return c[0] * x * y + c[1] * x**2 * y + c[2] * x * y**2

    x, y, h = signals.q[:, 0], signals.q[:, 1], 1e-6
    tau = CableForce((0, 1)).torque(signals, c)
    assert tau[:, 0] == pytest.approx((potential(x + h, y) - potential(x - h, y)) / (2 * h))
    assert tau[:, 1] == pytest.approx((potential(x, y + h) - potential(x, y - h)) / (2 * h))


def test_pairs_are_neighbours_in_the_tree() -> None:
    tree = random_robot(31, joints=6)
    model = tree.model
    expected = {(int(model.parents[k]) - 1, k - 1) for k in range(2, 7) if model.parents[k] > 0}
    assert set(CableForce.places(tree)) == expected
    assert expected != {(k, k + 1) for k in range(5)}


def test_spring_rests_where_it_was_planted(signals: Signals) -> None:
    shape, values = Spring.planted(40.0, {"rest_position": 0.3})
    at_rest = Signals(**{**vars(signals), "q": np.full_like(signals.q, 0.3)})
    assert Spring((2,), shape).torque(at_rest, values) == pytest.approx(0.0)
    found = Spring((2,)).report(values, np.diag([4.0, 1.0]))
    assert found["rest_position"].value == pytest.approx(0.3)
    # σ² = (c/k²)² σ_k² + σ_c²/k²
    expected = np.hypot(12 / 1600 * 2.0, 1 / 40)
    assert found["rest_position"].std == pytest.approx(expected)
    assert Spring((2,)).mjcf(values) == pytest.approx({"stiffness": 40.0, "springref": 0.3})
    assert Spring((2,)).mjcf(-values) == {}


def test_torque_delay_is_a_shift_in_time(robot: Robot) -> None:
    signals, shift = signals_of(robot, 2000, step=0.002), 5
    late = np.roll(signals.torque, shift, axis=0)
    effect = TorqueDelay((0, 1, 2))
    change = effect.torque(signals, np.array([shift * 0.002]))
    inner = slice(10, -10)
    missed = np.linalg.norm((late - signals.torque - change)[inner])
    assert missed < 0.05 * np.linalg.norm((late - signals.torque)[inner])
    assert TorqueDelay.places(robot) == [(0, 1, 2), (0,), (1,), (2,)]
    assert TorqueDelay((1,)).rows(3) == (1,)


def test_torque_saturation_is_a_clipped_torque(robot: Robot, signals: Signals) -> None:
    grid = TorqueSaturation.grid(robot, (1,), [signals])
    above = []
    for shape in grid:
        clipped = signals.torque.copy()
        level = shape["level"]
        clipped[:, 1] = np.clip(clipped[:, 1], -level, level)
        tau = TorqueSaturation((1,), shape).torque(signals, np.array([1.0]))
        assert signals.torque + tau == pytest.approx(clipped)
        above.append((np.abs(signals.torque[:, 1]) > level).mean())
    assert above == pytest.approx([0.3, 0.2, 0.1, 0.05, 0.02], abs=0.01)
