"""Noise of an inertial unit must not make sizes too small, nor take anything off a clean signal."""

import numpy as np
import pytest

from excite_cli.base_link.state import denoised
from tests.base_link.stander import Array

STEP = 0.002
NOISE = 0.02


def motion(rng: np.random.Generator, seconds: float = 30.0) -> Array:
    """Accelerations (T, 3) of a few frequencies below 1.5 Hz, of the size of the noise."""
    t = np.arange(0.0, seconds, STEP)
    waves = [np.sin(2 * np.pi * f * t[:, None] + rng.uniform(0, 6, 3)) for f in (0.3, 0.7, 1.3)]
    return np.asarray(0.01 * sum(waves) + rng.uniform(-1, 1, 3))


def slopes(y: Array, x: Array) -> Array:
    y, x = y - y.mean(axis=0), x - x.mean(axis=0)
    return np.asarray((x * y).sum(axis=0) / np.square(x).sum(axis=0))


@pytest.mark.parametrize("seed", range(5))
def test_sizes_fitted_to_the_estimate_are_not_too_small(seed: int) -> None:
    rng = np.random.default_rng(seed)
    truth = motion(rng)
    seen = truth + NOISE * rng.normal(size=truth.shape)
    found = denoised(seen, STEP)
    assert (slopes(truth, seen) < 0.7).all()  # what noise does to a size
    # Noise stays within half a hertz of what moves: 2/250 of it, 2 % of the signal's energy.
    assert slopes(truth, found) == pytest.approx(np.ones(3), abs=0.04)
    assert found.mean(axis=0) == pytest.approx(seen.mean(axis=0))


def test_a_clean_signal_stays_as_it_is() -> None:
    truth = motion(np.random.default_rng(3))
    assert np.abs(denoised(truth, STEP) - truth).max() < 1e-4


def test_nothing_but_noise_becomes_little() -> None:
    noise = NOISE * np.random.default_rng(4).normal(size=(15000, 6))
    assert denoised(noise, STEP).std() < 0.1 * NOISE


def test_a_short_recording_is_taken() -> None:
    few = np.random.default_rng(5).normal(size=(20, 6))
    assert np.isfinite(denoised(few, STEP)).all()
