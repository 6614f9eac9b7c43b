"""Ripple is found over the angle, and its periodogram is a least-squares fit."""

import numpy as np
import pytest

from excite_cli.effects.base import Signals
from excite_cli.effects.ripple import Ripple, periodogram
from tests.effects.motions import signals_of
from tests.robot.random_robots import random_robot

ROBOT = random_robot(5, joints=3, branches=False, prismatic=False)
RUNS = [signals_of(ROBOT, 4000, step=0.004, seed=seed) for seed in (0, 1)]


def test_energy_is_that_of_least_squares() -> None:
    q = RUNS[0].q[:, 1]
    residual = np.random.default_rng(0).normal(size=len(q)) + np.sin(11 * q + 0.4)
    periods, energy = periodogram(q, residual, 5.0, 17.0, 0.3)
    assert len(periods) == 41
    centred = residual - residual.mean()
    for n, found in zip(periods[::8], energy[::8], strict=True):
        columns = np.stack([np.cos(n * q), np.sin(n * q)], axis=-1)
        left = np.linalg.lstsq(columns, centred, rcond=None)[1][0]
        assert found == pytest.approx(centred @ centred - left, rel=1e-8, abs=1e-6)


@pytest.mark.parametrize("planted", [20.0, 36.3, 160.0])
def test_ripple_is_found_below_noise_and_beside_slow_errors(planted: float) -> None:
    effect = Ripple((2,), {"periods": planted})
    residuals = []
    for seed, signals in enumerate(RUNS):
        noise = np.random.default_rng(seed).normal(size=signals.q.shape)
        slow = 2.0 * np.sin(1.3 * signals.q) + 0.5 * signals.v
        residuals.append(effect.torque(signals, np.array([0.3, -0.4])) + noise + slow)
    found = [shape["periods"] for shape in Ripple.tuned(ROBOT, (2,), RUNS, residuals)]
    assert len(found) <= 4
    # What the data tell apart is a cycle over the travelled range.
    travelled = np.ptp(np.concatenate([signals.q[:, 2] for signals in RUNS]))
    assert min(abs(n - planted) for n in found) < 0.1 * 2 * np.pi / travelled


@pytest.mark.parametrize("cycles", [1.1, 1.5, 2.4])
def test_a_slow_ripple_is_found_beside_gravity_and_friction(cycles: float) -> None:
    """A cubic in the angle, which leaves fast ones alone, would take it away."""
    travelled = np.ptp(np.concatenate([signals.q[:, 2] for signals in RUNS]))
    periods = 2 * np.pi * cycles / travelled
    effect = Ripple((2,), {"periods": periods})
    residuals = [
        effect.torque(signals, np.array([1.0, -0.7]))
        + 0.5 * np.cos(signals.q)
        + 0.4 * np.sign(signals.v)
        + 0.1 * np.random.default_rng(seed).normal(size=signals.q.shape)
        for seed, signals in enumerate(RUNS)
    ]
    found = [shape["periods"] for shape in Ripple.tuned(ROBOT, (2,), RUNS, residuals)]
    assert min(abs(n - periods) for n in found) < 0.1 * 2 * np.pi / travelled


def test_search_is_bounded_by_range_and_sampling() -> None:
    j, signals = 1, RUNS[0]
    periods = [shape["periods"] for shape in Ripple.grid(ROBOT, (j,), [signals])]
    assert min(periods) * np.ptp(signals.q[:, j]) == pytest.approx(2 * np.pi)
    speed = np.abs(signals.v[:, j])
    per_sample = max(periods) * np.median(speed[speed > 0.1 * speed.max()]) * 0.004 / (2 * np.pi)
    assert 0.2 < per_sample <= 0.25
    assert Ripple.tests_of_grid(ROBOT, (j,), [signals]) == len(periods)
    still = Signals(**{**vars(signals), "q": signals.q * 0, "v": signals.v * 0})
    assert Ripple.tuned(ROBOT, (j,), [still], [signals.q]) == []
    # Amplitude and phase are those of one cosine.
    effect, signals = Ripple((0,), {"periods": 12.0}), RUNS[0]
    values, covariance = np.array([0.6, 0.8]), np.diag([0.01, 0.01])
    found = effect.report(values, covariance)
    again = found["amplitude"].value * np.cos(12 * signals.q[:, 0] - found["phase"].value)
    assert effect.torque(signals, values)[:, 0] == pytest.approx(again)
    assert found["amplitude"].std == pytest.approx(0.1)
    assert found["phase"].std == pytest.approx(0.1)
    assert found["periods"].value == 12.0
