"""Do 95 % intervals hold the truth in 95 % of cases, with noise that remembers?"""

import numpy as np
import pytest
from scipy.signal import lfilter

from excite_cli.identification.covariance import RunRows, noise_of
from excite_cli.identification.factors import run_factors, solve, stacked
from excite_cli.identification.least_squares import LinearFit, fit_rows

JOINTS, COLUMNS, SAMPLES = 3, 6, 1000


def slow_rows(rng: np.random.Generator, x: np.ndarray, memory: float) -> RunRows:
    t = np.arange(SAMPLES) * 0.02
    frequency = rng.uniform(0.05, 0.5, (JOINTS, COLUMNS))
    phase = rng.uniform(0, 6.28, (JOINTS, COLUMNS))
    columns = np.sin(2 * np.pi * frequency * t[:, None, None] + phase)
    mixing = np.array([[1.0, 0.0, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 3.0]])
    white = rng.normal(size=(SAMPLES, JOINTS)) @ mixing.T
    tau = columns @ x + lfilter([1.0], [1.0, -memory], white, axis=0)
    usable = rng.random(tau.shape) > 0.002
    return RunRows(columns, tau, usable)


def naive(runs: list[RunRows], fit: LinearFit) -> np.ndarray:
    factors = [run_factors(run.columns, run.tau, run.usable) for run in runs]
    return np.sqrt(np.diag(solve(stacked(factors, fit.noise)).inverse))


@pytest.mark.long
@pytest.mark.parametrize("method", ["ols", "wls", "irls"])
def test_intervals_cover_the_truth_when_noise_remembers(method: str) -> None:
    rng = np.random.default_rng(5)
    inside, inside_naive = [], []
    for _ in range(60):
        x = rng.normal(size=COLUMNS)
        runs = [slow_rows(rng, x, 0.9) for _ in range(2)]
        fit = fit_rows(runs, method)
        wrong = np.abs(fit.x - x)
        inside.append(wrong < 1.96 * np.sqrt(np.diag(fit.covariance)))
        inside_naive.append(wrong < 1.96 * naive(runs, fit))
    assert 0.91 <= np.mean(inside) <= 0.99
    assert np.mean(inside_naive) < 0.6


def test_how_many_samples_count() -> None:
    """As many as there are without a memory, fewer with one."""
    rng = np.random.default_rng(6)
    runs = [slow_rows(rng, np.ones(COLUMNS), 0.0) for _ in range(2)]
    fit = fit_rows(runs)
    assert fit.samples == pytest.approx(fit.count.sum(), rel=0.35)
    # Samples that remember count less.
    rng = np.random.default_rng(7)
    runs = [slow_rows(rng, np.ones(COLUMNS), 0.9) for _ in range(2)]
    fit = fit_rows(runs)
    # (1 - a)/(1 + a) = 1/19 of them, for columns slower than the noise
    assert fit.count.sum() / 40 < fit.samples < fit.count.sum() / 5
    # No sample counts twice. Noise that changes its sign from sample to sample hardly shows in slow
    # columns.
    rng = np.random.default_rng(5)
    fit = fit_rows([slow_rows(rng, np.ones(COLUMNS), -0.9) for _ in range(3)])
    white = fit_rows([slow_rows(rng, np.ones(COLUMNS), 0.0) for _ in range(3)])
    assert fit.samples == fit.count.sum()
    assert np.diag(fit.covariance).max() < np.diag(white.covariance).min()


def test_the_noise_of_a_known_process_is_found() -> None:
    rng = np.random.default_rng(1)
    white = rng.normal(size=(20000, 2)) @ np.array([[1.0, 0.5], [0.0, 1.0]])
    series = np.column_stack(
        [
            lfilter([1.0], [1.0, -1.2, 0.5], white[:, 0]),
            lfilter([1.0], [1.0], white[:, 1]),
        ]
    )
    usable = np.ones(series.shape, bool)
    usable[5000:5100] = False
    series[5000:5100] = 1e6
    noise = noise_of(series, usable)
    assert noise.polynomials[0][:3] == pytest.approx([1.0, -1.2, 0.5], abs=0.05)
    assert np.abs(noise.polynomials[1][1:]).max(initial=0.0) < 0.05
    expected = np.array([[1.0, 0.5], [0.5, 1.25]])
    assert noise.innovation == pytest.approx(expected, abs=0.07)


def test_a_random_walk_and_a_hum_are_in_the_deviations() -> None:
    walk = np.cumsum(np.random.default_rng(2).normal(size=(800, 1)), axis=0)
    rows = RunRows(np.ones((800, 1, 1)), walk, np.ones((800, 1), bool))
    fit = fit_rows([rows])
    assert np.isfinite(fit.covariance).all()
    assert fit.samples < 40
    # A hum is in the deviations. By the autoregression alone 82 % of intervals hold the truth, as
    # if all began in silence.
    rng = np.random.default_rng(8)
    fits = [fit_rows([hummed(rng), hummed(rng)]) for _ in range(200)]
    inside = [np.abs(fit.x) < 1.96 * np.sqrt(np.diag(fit.covariance)) for fit in fits]
    assert 0.92 <= np.mean(inside) <= 0.99


def hummed(rng: np.random.Generator) -> RunRows:
    """Friction of one joint: speed and its sign, ten seconds, beside a tone of 0.5 to 4 Hz."""
    t = np.arange(200) * 0.05
    speed = sum(
        rng.normal() / k * np.sin(2 * np.pi * k * t / 10 + rng.uniform(0, 6.28))
        for k in range(1, 6)
    )
    tone = np.sqrt(2) * np.sin(2 * np.pi * rng.uniform(0.5, 4.0) * t + rng.uniform(0, 6.28))
    tau = tone + 0.1 * rng.normal(size=len(t))
    columns = np.stack([speed, np.sign(speed)], axis=1)[:, None]
    return RunRows(columns, tau[:, None], (np.abs(speed) > 0.05)[:, None])


def test_long_runs_are_taken_in_stretches(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(9)
    runs = [slow_rows(rng, np.ones(COLUMNS), 0.9) for _ in range(2)]
    whole = np.sqrt(np.diag(fit_rows(runs).covariance))
    monkeypatch.setattr("excite_cli.identification.covariance._STRETCH", 400)
    assert np.sqrt(np.diag(fit_rows(runs).covariance)) == pytest.approx(whole, rel=0.15)
