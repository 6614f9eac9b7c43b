"""Noise from the torque's spectrum above the motion, white and with a memory."""

import numpy as np
import pytest
from scipy.signal import butter, lfilter, sosfiltfilt

from excite_cli.diagnosis.noise_spectrum import BandNoise, band_noise
from excite_cli.identification.prepare import PreparedRun, prepare
from excite_cli.identification.processing import Processing
from excite_cli.measurement.dataset import Run
from excite_cli.robot.model import Array

SECONDS = 20.0


def processing(rate: float) -> Processing:
    return Processing(
        rate, 8.0, 4.8, 19.2, max(1, int(rate // 48)), 0.2, "differentiated", 0.02, 0.8
    )


def recorded(noise: Array, rate: float) -> Run:
    """Two joints that sweep slowly beside noise (T,) of the first; the other's is a tenth."""
    t = np.arange(len(noise)) / rate
    q = np.stack([np.sin(0.7 * t), np.cos(0.5 * t)], axis=1)
    return Run("run", t, q, 5.0 * q + np.stack([noise, 0.1 * noise], axis=1))


def measured(noise: Array, rate: float = 500.0) -> tuple[BandNoise, Array]:
    """What is found, and the RMS (n,) of the noise in the averages of the fit."""
    p, run = processing(rate), recorded(noise, rate)
    fit: PreparedRun = prepare(run, p)
    alone = prepare(Run("run", run.t, run.q, run.tau - 5.0 * run.q), p)
    rms = [np.sqrt(np.mean(alone.tau_fit[fit.usable[:, j], j] ** 2)) for j in range(2)]
    return band_noise([run], [fit], [5.0 * fit.q], p), np.array(rms)


def coloured(memory: float, seed: int, rate: float = 500.0) -> Array:
    e = np.random.default_rng([seed, 4]).normal(size=int(SECONDS * rate))
    return np.asarray(lfilter([1.0], [1.0, -memory], e))


def test_white_noise_is_measured_and_structure_is_none() -> None:
    found, rms = measured(coloured(0.0, 1))
    np.testing.assert_allclose(found.white, rms, rtol=0.2)
    np.testing.assert_allclose(found.coloured, rms, rtol=0.2)
    # Structure below the band is no noise.
    wave = 3.0 * np.sin(9.0 * np.arange(SECONDS * 500) / 500.0)
    found, rms = measured(coloured(0.0, 2) + wave)
    assert np.all(rms > 5.0 * found.coloured)


@pytest.mark.parametrize("memory", [0.8, 0.93, 0.97])
def test_noise_with_a_memory_is_not_taken_for_more_than_noise(memory: float) -> None:
    for seed in range(2):
        found, rms = measured(coloured(memory, seed))
        assert np.all(rms < 1.5 * found.coloured)
        assert np.all(found.white <= found.coloured)
        assert np.all(found.coloured < 6.0 * found.white)
    assert np.all(rms > 1.2 * found.white)


def test_some_torques_say_nothing_of_their_noise() -> None:
    sections = butter(6, 9.0, fs=500.0, output="sos")
    found, _ = measured(sosfiltfilt(sections, coloured(0.0, 3)))
    assert np.isnan(found.white).all()
    assert np.isnan(found.coloured).all()
    # Slow recordings say nothing of their noise.
    found, _ = measured(coloured(0.0, 3, 40.0), 40.0)
    assert np.isnan(found.white).all()


def test_jumps_at_frequent_reversals_are_no_noise() -> None:
    rate, jump = 500.0, 10.0
    t = np.arange(0.0, 8.0, 1.0 / rate)
    q = np.stack([0.3 * np.sin(2.0 * np.pi * 1.1 * t)], axis=1)
    noise = np.random.default_rng(5).normal(size=(len(t), 1))
    dry = jump * np.sign(np.cos(2.0 * np.pi * 1.1 * t))[:, None]
    p, run = processing(rate), Run("run", t, q, noise + dry)
    fit = prepare(run, p)
    found = band_noise([run], [fit], [0.0 * fit.q], p)
    alone = prepare(Run("run", t, q, noise), p)
    rms = np.sqrt(np.mean(alone.tau_fit[fit.usable[:, 0], 0] ** 2))
    assert found.white[0] == pytest.approx(rms, rel=0.3)


def test_recordings_of_several_rates_are_judged_in_the_bands_that_they_share() -> None:
    """Of one at 100 Hz bands above 40 Hz are no bands; one at 40 Hz shows no noise at all."""
    p, runs, fits = processing(250.0), [], []
    for rate in (250.0, 100.0, 40.0):
        run = recorded(np.sqrt(rate / 250.0) * coloured(0.0, 3, rate), rate)  # of one density
        runs.append(run)
        fits.append(prepare(run, p))
    found = band_noise(runs, fits, [5.0 * fit.q for fit in fits], p)
    alone = band_noise(runs[:1], fits[:1], [5.0 * fits[0].q], p)
    np.testing.assert_allclose(found.white, alone.white, rtol=0.2)
    slow = band_noise(runs[2:], fits[2:], [5.0 * fits[2].q], p)
    assert np.isnan(slow.white).all()
