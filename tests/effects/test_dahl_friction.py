"""Friction with memory against its differential equation, and where its memory begins and ends."""

import numpy as np
import pytest

from excite_cli.effects.base import Effect, Signals
from excite_cli.effects.catalogue import kind_named
from excite_cli.effects.dahl_friction import DahlFriction, _Bristle
from excite_cli.excitation.gradient_check import fourth_order_differences, relative_error
from excite_cli.robot.model import Array
from tests.effects.motions import signals_at
from tests.robot.random_robots import random_robot

D = 0.05
ROBOT = random_robot(4, joints=1, branches=False, prismatic=False)


def along(t: Array, q: Array, v: Array) -> Signals:
    return signals_at(ROBOT, t, q[:, None], v[:, None], np.zeros((len(t), 1)))


def swinging(step: float, seconds: float = 6.0) -> Signals:
    """Two sines, with reversals at different angles; the joint moves from the beginning."""
    t = step * np.arange(round(seconds / step))
    q = 0.4 * np.sin(1.9 * t) + 0.1 * np.sin(5.3 * t)
    return along(t, q, 0.76 * np.cos(1.9 * t) + 0.53 * np.cos(5.3 * t))


def lugre(q: Array, v: Array, step: float, damping: float) -> Array:
    """σ₀ y + σ₁ ẏ with ẏ = v − σ₀ |v| y, σ₀ = 1/D and σ₁ = `damping`, in steps that are small."""
    found, bent = [], D
    for speed in v:
        rate = speed - abs(speed) * bent / D
        found.append(bent / D + damping * rate)
        bent += step * rate
    return np.array(found)


def state(signals: Signals, distance: float = D) -> Array:
    """z: what it makes of Coulomb friction."""
    effect = DahlFriction((0,), {"distance": distance})
    coulomb = kind_named("coulomb_friction")((0,))
    return np.asarray((effect.columns(signals) + coulomb.columns(signals))[:, 0, 0])


def by_steps(q: Array, first: float) -> Array:
    """dz = (s − z) |dq| / d in explicit steps that are small."""
    z = [first]
    for change in np.diff(q):
        z.append(z[-1] + (np.sign(change) - z[-1]) * abs(change) / D)
    return np.array(z)


@pytest.mark.parametrize(("every", "error"), [(1, 1.5e-3), (200, 2e-3), (400, 1.5e-2)])
def test_it_follows_the_differential_equation_however_coarse_the_samples(
    every: int, error: float
) -> None:
    """At 0.1, 20 and 40 ms; turning points lie between the samples."""
    fine = swinging(1e-4)
    expected = by_steps(fine.q[:, 0], 1.0)
    found = state(swinging(1e-4 * every))
    assert np.abs(found - expected[::every][: len(found)]).max() < error


def test_with_a_damping_it_is_the_friction_of_lugre() -> None:
    fine = swinging(1e-4)
    expected = lugre(fine.q[:, 0], fine.v[:, 0], 1e-4, 1.5)
    coarse = swinging(0.02)
    effect = DahlFriction((0,), {"distance": D, "damping": 1.5})
    coulomb = kind_named("coulomb_friction")((0,)).columns(coarse)
    found = (effect.columns(coarse) + coulomb)[:, 0, 0]
    assert np.abs(found - expected[::200][: len(found)]).max() < 6e-3
    assert np.abs(state(coarse) - expected[::200][: len(found)]).max() > 0.3
    reported = effect.report(np.array([4.0]), np.array([[0.01]]))["bristle_damping"]
    assert (reported.value, reported.std) == pytest.approx((6.0, 0.15))
    assert "bristle_damping" not in DahlFriction((0,), {"distance": D}).report(
        np.array([4.0]), np.array([[0.01]])
    )


def test_after_a_reversal_it_builds_up_over_the_distance() -> None:
    t = 0.01 * np.arange(301)
    q = np.where(t < 1.5, t, 3.0 - t)
    z = state(along(t, q, np.where(t < 1.5, 1.0, -1.0)))
    assert z[t < 1.5] == pytest.approx(1.0, abs=1e-9)
    way = 1.5 - q[t > 1.55]
    assert z[t > 1.55] == pytest.approx(2.0 * np.exp(-way / D) - 1.0, abs=1e-6)
    # A record that begins at rest begins relaxed.
    t = 0.01 * np.arange(201)
    q = 0.5 * t**2
    z = state(along(t, q, t))
    assert z == pytest.approx(1.0 - np.exp(-q / D), abs=2e-3)
    # Noise around a standstill hardly wears the memory off. Ten seconds with a speed of 1 mrad/s
    # (RMS): the friction of the last move is still there.
    t = 0.01 * np.arange(1201)
    noise = 1.5e-5 * np.sin(2 * np.pi * 15.0 * t) * (t > 1.0)
    q = 0.3 * np.minimum(t, 1.0) + noise
    z = state(along(t, q, np.gradient(q, t)), 0.01)
    assert z[t > 1.05].min() > 0.9


def test_distances_follow_the_travelled_range() -> None:
    signals = swinging(0.02)
    travelled = np.ptp(signals.q)
    grid = [shape["distance"] for shape in DahlFriction.grid(ROBOT, (0,), [signals])]
    assert grid == pytest.approx(
        np.clip(travelled * np.geomspace(1e-3, 0.25, 7), 5e-4, 0.5), rel=1e-6
    )
    still = Signals(**{**vars(signals), "q": 0.0 * signals.q})
    assert [s["distance"] for s in DahlFriction.grid(ROBOT, (0,), [still])] == [5e-4]


@pytest.mark.parametrize("damping", [0.0, 0.3])
def test_what_builds_up_over_more_than_half_a_radian_is_a_spring(damping: float) -> None:
    """1.26 rad of it stood for the weight of a link, beside friction of thrice its size."""
    still = swinging(0.02)
    signals = Signals(**{**vars(still), "a": np.full_like(still.q, 3.0)})
    for distance in (0.01, 0.3, 0.5):
        near = DahlFriction((0,), {"distance": distance, "damping": damping}).shapes_near([signals])
        assert near
        assert max(each["distance"] for each in near) <= 0.5
    assert max(each["distance"] for each in near) == pytest.approx(0.5)


@pytest.mark.parametrize("damping", [0.0, 2.0])
def test_pull_back_goes_through_turning_points(damping: float) -> None:
    """With the narrow sign of measured data, on steps that are long against it."""
    signals = swinging(0.1)
    effect = DahlFriction((0,), {"distance": D, "damping": damping})
    weights = np.random.default_rng(2).normal(size=(len(signals.t), 1, 1))

    def value(x: Array) -> float:
        return float((weights * effect.columns(signals_at(ROBOT, signals.t, *x))).sum())

    back = effect.pull_back(signals, weights)
    assert back.q is not None
    assert back.v is not None
    at = np.array([signals.q, signals.v, signals.a])
    reference = fourth_order_differences(value, at, 1e-6)
    assert (np.diff(np.sign(signals.v[:, 0])) != 0).sum() > 5
    assert relative_error(np.stack([back.q, back.v, 0 * back.q]), reference) < 1e-6


def test_the_simulated_bristle_is_the_column() -> None:
    signals = swinging(1e-3)
    bristle = _Bristle(3.0, D)
    bristle.begin(signals.q[0, 0], signals.v[0, 0])
    torque = [bristle.torque(q, v) for q, v in zip(signals.q[:, 0], signals.v[:, 0], strict=True)]
    assert np.array(torque) == pytest.approx(3.0 * state(signals), abs=6e-3)
    damped = _Bristle(3.0, D, 2.0)
    damped.begin(signals.q[0, 0], signals.v[0, 0])
    torque = [damped.torque(q, v) for q, v in zip(signals.q[:, 0], signals.v[:, 0], strict=True)]
    effect = DahlFriction((0,), {"distance": D, "damping": 2.0})
    coulomb = kind_named("coulomb_friction")((0,)).columns(signals)
    expected = 3.0 * (effect.columns(signals) + coulomb)[:, 0, 0]
    assert np.array(torque) == pytest.approx(expected, abs=0.02)


def test_what_was_before_a_record_counts_until_it_is_forgotten() -> None:
    effect: Effect = DahlFriction((2,), {"distance": D})
    assert effect.forgets_over() == ((2, pytest.approx(4 * D)),)
    stiffness = effect.report(np.array([3.0]), np.array([[0.04]]))["stiffness"]
    assert (stiffness.value, stiffness.std) == pytest.approx((60.0, 4.0))


def test_it_is_drawn_over_the_way_since_the_last_reversal() -> None:
    t = 0.01 * np.arange(301)
    q = np.where(t < 1.5, 0.2 * t, 0.6 - 0.2 * t)
    drawn = DahlFriction((0,), {"distance": D}).abscissa(along(t, q, np.gradient(q, t)))
    assert drawn is not None
    assert drawn.unit == "rad"
    back = t > 1.5
    assert drawn.values[back] == pytest.approx(np.maximum(q[back] - 0.3, -6 * D))
    assert drawn.values[~back] == pytest.approx(np.minimum(q[~back], 6 * D))
