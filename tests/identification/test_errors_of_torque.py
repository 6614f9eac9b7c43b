import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from excite_cli.errors import FileError
from excite_cli.identification.errors_of_torque import Errors, torque_errors

NAMES = ("a", "b")


def errors(tau: np.ndarray, predicted: np.ndarray, **given: np.ndarray) -> Errors:
    usable = given.get("usable", np.ones(tau.shape, bool))
    moving = given.get("moving", np.ones(tau.shape, bool))
    raw = given.get("raw", tau)
    half = len(tau) // 2
    parts = [slice(0, half), slice(half, None)]
    runs: Any = [
        SimpleNamespace(
            tau=tau[part],
            tau_raw=raw[part],
            valid=usable[part],
            moving=moving[part],
            step=0.1,
            averaged_torque=lambda torque: torque,
        )
        for part in parts
    ]
    return torque_errors(NAMES, runs, [predicted[part] for part in parts])


def test_figures_by_hand_and_masks_that_decide_what_counts() -> None:
    tau = np.column_stack([np.full(40, 4.0), np.tile([3.0, -3.0], 20)])
    predicted = tau + np.column_stack([np.full(40, 0.4), np.tile([0.0, 0.6], 20)])
    found = errors(tau, predicted, raw=tau - 1.0)
    assert found.relative["a"] == pytest.approx(0.1)
    assert found.relative["b"] == pytest.approx(0.2 / math.sqrt(2))
    assert found.mean_relative == pytest.approx((0.1 + 0.2 / math.sqrt(2)) / 2)
    assert found.rms["a"] == pytest.approx(0.4)
    assert found.rms_raw["a"] == pytest.approx(1.4)
    assert found.interval == pytest.approx((found.mean_relative, found.mean_relative))
    # Masks decide what counts.
    rng = np.random.default_rng(0)
    tau = rng.normal(size=(60, 2))
    predicted = tau * 0.9
    usable = rng.random(tau.shape) > 0.3
    tau[~usable] = np.nan
    moving = np.zeros(tau.shape, bool)
    moving[10:30, 0] = True
    predicted[10:30, 0] = tau[10:30, 0] * 0.5
    found = errors(tau, predicted, usable=usable, moving=moving)
    assert found.relative["b"] == pytest.approx(0.1)
    assert found.relative_moving["a"] == pytest.approx(0.5)
    assert math.isnan(found.relative_moving["b"])
    assert found.mean_relative_moving == pytest.approx(0.5)


def test_the_interval_has_the_right_width() -> None:
    """Against the spread of the figure over fresh recordings."""
    rng = np.random.default_rng(1)
    means, widths = [], []
    for _ in range(60):
        tau = np.sin(np.arange(600) * 0.05)[:, None] * [2.0, 5.0]
        noise = np.repeat(rng.normal(size=(60, 2)), 10, axis=0)  # each value lasts a second
        found = errors(tau, tau + 0.3 * noise)
        means.append(found.mean_relative)
        widths.append(found.interval[1] - found.interval[0])
    assert np.mean(widths) == pytest.approx(2 * 1.96 * np.std(means), rel=0.3)


def test_errors_rest_on_enough_samples_and_say_on_how_many() -> None:
    """Of a joint with a handful nothing is said, and with no other joint all is refused."""
    tau = np.random.default_rng(0).normal(size=(60, 2))
    usable = np.ones(tau.shape, bool)
    usable[:51, 0] = False
    found = errors(tau, 0.9 * tau, usable=usable)
    assert found.samples == {"a": 9, "b": 60}
    assert math.isnan(found.relative["a"])
    assert math.isnan(found.rms["a"])
    assert found.mean_relative == found.mean_relative_moving == pytest.approx(0.1)
    usable[:51, 1] = False
    with pytest.raises(FileError, match=r"leave 9 filtered samples at most .* 10 are needed"):
        errors(tau, 0.9 * tau, usable=usable)
