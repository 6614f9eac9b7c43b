"""Thresholds of a detector: false alarms as asked for, scaled by speed, refusals."""

import numpy as np
import pytest

from excite_cli.errors import ConfigError
from excite_cli.scoring.thresholds import Residual, low_pass, thresholds_of

STEP = 0.004


def sound(rng: np.random.Generator, seconds: float) -> Residual:
    t = STEP * np.arange(round(seconds / STEP))
    v = np.stack([np.sin(t), np.cos(0.7 * t)], axis=1)
    load = np.stack([10.0 * np.cos(0.3 * t), np.ones_like(t)], axis=1)
    scale = np.sqrt(0.2**2 + (0.5 * v) ** 2 + (0.03 * load) ** 2)
    return Residual(scale * rng.normal(size=v.shape), v, load, STEP)


def test_false_alarms_are_about_as_many_as_asked_for() -> None:
    rng = np.random.default_rng(1)
    made = thresholds_of(("a", "b"), [sound(rng, 60.0) for _ in range(5)], false_alarms=60.0)
    runs = [sound(rng, 600.0) for _ in range(6)]
    alarms = 0
    for run in runs:
        beyond = np.flatnonzero((made.beyond(run) > 1.0).any(axis=1))
        alarms += int((np.diff(beyond, prepend=-10_000) > 1.0 / STEP).sum())
    assert 15 <= alarms <= 200  # 60 an hour are asked for, in one hour


def test_thresholds_follow_speed_and_load() -> None:
    made = thresholds_of(("a", "b"), [sound(np.random.default_rng(2), 300.0)])
    slow, fast = (made.at(np.array([[v, v]]), np.zeros((1, 2)))[0, 0] for v in (0.2, 1.0))
    expected = np.hypot(0.2, 0.5) / np.hypot(0.2, 0.1)
    assert fast / slow == pytest.approx(expected, rel=0.1)
    heavy = made.at(np.zeros((1, 2)) + 0.2, np.array([[10.0, 10.0]]))[0, 0]
    assert heavy > slow
    assert made.as_data()["joints"]["a"]["level"] == made.level[0]  # type: ignore[index]


def test_the_low_pass_is_causal_and_keeps_constants() -> None:
    x = np.ones((100, 1))
    assert low_pass(x, STEP, 0.02) == pytest.approx(x)
    x[50:] = 2.0
    y = low_pass(x, STEP, 0.02)[:, 0]
    assert y[49] == pytest.approx(1.0)
    assert y[50 + 5] == pytest.approx(2.0 - np.exp(-6 * STEP / 0.02))


def test_too_little_data_and_senseless_rates_are_refused() -> None:
    rng = np.random.default_rng(3)
    with pytest.raises(ConfigError, match=r"10 s of usable data .* are too few"):
        thresholds_of(("a", "b"), [sound(rng, 10.0)])
    with pytest.raises(ConfigError, match="must be positive"):
        thresholds_of(("a", "b"), [sound(rng, 60.0)], false_alarms=0.0)
