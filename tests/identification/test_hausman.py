from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from excite_cli.identification.covariance import RunRows
from excite_cli.identification.hausman import hausman_test, instrument_dataset
from excite_cli.measurement.dataset import Dataset, Run

SAMPLES, JOINTS, COLUMNS = 800, 2, 4


def p_value(seed: int, feedback: float) -> float:
    """p with noise of the torque fed back into the first column."""
    rng = np.random.default_rng(seed)
    t = np.arange(SAMPLES) * 0.02
    frequency = rng.uniform(0.1, 0.5, (JOINTS, COLUMNS))
    clean = np.sin(2 * np.pi * frequency * t[:, None, None] + rng.uniform(0, 6, (JOINTS, COLUMNS)))
    torque_noise = lfilter([1.0], [1.0, -0.8], rng.normal(size=(SAMPLES, JOINTS)), axis=0)
    columns = clean + 0.05 * rng.normal(size=clean.shape)
    columns[:, :, 0] += feedback * torque_noise
    tau = columns @ np.ones(COLUMNS) + torque_noise
    rows = RunRows(columns, tau, np.ones(tau.shape, bool))
    return hausman_test([rows], [clean], "reference", np.ones(JOINTS)).p_value


def test_feedback_of_the_noise_is_found_and_open_loop_is_no_alarm() -> None:
    p = [p_value(seed, 0.0) for seed in range(80)]
    assert np.mean(np.array(p) < 0.05) < 0.15
    assert np.mean(np.array(p) < 0.5) == pytest.approx(0.5, abs=0.2)
    # Feedback of the noise is found.
    assert max(p_value(seed, 0.2) for seed in range(10)) < 0.01


def wave(samples: int, period: float) -> np.ndarray:
    phase = 2 * np.pi * np.arange(samples) / period
    return np.column_stack([np.sin(phase), np.cos(2 * phase) + 0.3 * np.sin(3 * phase)])


def test_instruments_come_from_the_reference_else_from_periods_else_not_at_all() -> None:
    t = np.arange(1000) * 0.01
    run = Run("r", t, wave(1000, 2500.0), np.zeros((1000, 2)))
    bare = Dataset(("a", "b"), (run,))
    none, source, reason = instrument_dataset(bare)
    assert none is None
    assert source == "none"
    assert "q_ref" in reason
    early = replace(run, extra={"q_ref": wave(1010, 2500.0)[10:]})  # 0.1 s ahead of the robot
    found, source, _ = instrument_dataset(replace(bare, runs=(early,)))
    assert source == "reference"
    assert found is not None
    assert np.abs(found.runs[0].q - run.q)[20:-20].max() < 1e-3
    assert np.abs(early.extra["q_ref"] - run.q).max() > 0.01
    periodic = replace(run, q=wave(1000, 250.0))
    assert instrument_dataset(replace(bare, runs=(periodic,)))[1] == "periods"
    # Other periods leave out the own noise.
    noise = 1e-3 * np.random.default_rng(1).normal(size=(960, 2))
    run = Run("r", np.arange(960) * 0.01, wave(960, 240.0) + noise, np.zeros((960, 2)))
    found, source, _ = instrument_dataset(Dataset(("a", "b"), (run,)))
    assert source == "periods"
    assert found is not None
    other = found.runs[0].q - wave(960, 240.0)
    assert abs(np.corrcoef(other[:, 0], noise[:, 0])[0, 1]) < 0.1
    assert other.std() == pytest.approx(1e-3 / np.sqrt(3), rel=0.1)
