"""Autoregressions fitted to series of known spectrum."""

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import chi2

from excite_cli.diagnosis import noise_model
from excite_cli.diagnosis.noise_model import HIGHEST_ORDER, NoiseModel, fit_noise
from excite_cli.robot.model import Array
from tests.diagnosis.explicit_data import covariance_in_time

TAPS = np.array([1.2, -0.5])
SIGMA = 0.3


def series(seed: int, samples: int = 4000, taps: Array = TAPS, sigma: float = SIGMA) -> Array:
    """One joint, (samples, 1), after its start has been forgotten."""
    white = np.random.default_rng(seed).normal(size=samples + 500) * sigma
    return lfilter([1.0], np.concatenate([[1.0], -taps]), white)[500:, None]


def all_usable(runs: list[Array]) -> list[np.ndarray]:
    return [np.ones(run.shape, bool) for run in runs]


def spectrum(taps: Array, sigma: float, frequency: Array) -> Array:
    """Of an autoregression, per sample; `frequency` in cycles per sample."""
    delays = np.exp(-2j * np.pi * np.outer(frequency, np.arange(1, len(taps) + 1)))
    return sigma**2 / np.abs(1 - delays @ taps) ** 2


def ljung_box(x: Array, lags: int = 20) -> float:
    """p-value of no correlation."""
    n = len(x)
    r = np.array([x[k:] @ x[:-k] for k in range(1, lags + 1)]) / (x @ x)
    return float(chi2.sf(n * (n + 2) * np.sum(r**2 / (n - np.arange(1, lags + 1))), lags))


def test_white_noise_needs_no_coefficients_of_size() -> None:
    runs = [np.random.default_rng(k).normal(size=(2000, 2)) * [1.0, 5.0] for k in range(3)]
    found = fit_noise(runs, all_usable(runs))
    assert all(np.abs(c).max(initial=0.0) < 0.08 for c in found.coefficients)
    # A little too large, by the nugget: tests err on the careful side.
    assert found.sigma / [1.0, 5.0] == pytest.approx(np.sqrt(1.03), rel=0.03)


def test_the_nugget_is_white_noise_added() -> None:
    """The spectrum is that of the series with 3 % of its variance in white noise."""
    runs = [series(seed) for seed in range(6)]
    found = fit_noise(runs, all_usable(runs))
    frequency = np.linspace(0.02, 0.48, 24)
    variance = np.mean([run.var() for run in runs])
    expected = spectrum(TAPS, SIGMA, frequency) + 0.03 * variance
    modelled = spectrum(found.coefficients[0], found.sigma[0], frequency)
    assert modelled == pytest.approx(expected, rel=0.2)


def test_slow_noise_is_no_less_than_white_noise_and_no_band_is_trusted_without_end() -> None:
    """Torque that somebody low-passed holds nothing at high frequency."""
    kernel = np.hanning(41) / np.hanning(41).sum()
    runs = [np.convolve(np.random.default_rng(k).normal(size=4000), kernel, "same")[:, None]
            for k in range(3)]  # fmt: skip
    found = fit_noise(runs, all_usable(runs))
    modelled = spectrum(found.coefficients[0], found.sigma[0], np.linspace(0.1, 0.5, 50))
    assert modelled.min() > 0.01 * np.var(runs[0])
    # Slow noise is no less than white noise. Next to nothing of differentiated white noise is slow;
    # a model takes slow noise up, too.
    runs = [np.diff(series(seed, taps=np.zeros(0)), axis=0) for seed in range(3)]
    found = fit_noise(runs, all_usable(runs))
    assert found.coefficients[0].sum() == pytest.approx(0.0, abs=1e-6)
    assert found.sigma[0] <= runs[0].std() * 1.02
    kept = fit_noise([series(1)], all_usable([series(1)]))
    assert kept.coefficients[0].sum() > 0.5  # as it is


def test_samples_that_are_not_usable_are_not_seen() -> None:
    runs = [series(seed, 1500) for seed in range(2)]
    usable = all_usable(runs)
    for mask in usable:
        mask[100:130] = mask[[400, 777]] = False
    wild = [np.where(mask, run, 1e9) for run, mask in zip(runs, usable, strict=True)]
    plain, found = fit_noise(runs, usable), fit_noise(wild, usable)
    assert np.array_equal(plain.coefficients[0], found.coefficients[0])
    assert plain.sigma == found.sigma
    full = fit_noise(runs, all_usable(runs))
    assert found.sigma == pytest.approx(full.sigma, rel=0.05)
    # Short series are taken as white from usable samples alone.
    runs = [series(seed, 40) for seed in range(2)]
    usable = [np.arange(40)[:, None] % 4 > 1 for _ in runs]  # no window is whole
    wild = [np.where(mask, run, 1e9) for run, mask in zip(runs, usable, strict=True)]
    found = fit_noise(wild, usable)
    kept = np.concatenate([run[mask] for run, mask in zip(runs, usable, strict=True)])
    assert found.sigma[0] == pytest.approx(np.sqrt(np.mean(kept**2)))
    assert len(found.coefficients[0]) == 0
    none = fit_noise(runs, [np.zeros(run.shape, bool) for run in runs])
    assert np.isfinite(none.sigma).all()
    assert none.sigma[0] > 0
    assert none.whitened(runs[0][:, 0], 0, np.zeros(40, bool)).shape == (0,)


def test_drifting_noise_gives_a_stable_model() -> None:
    walk = [np.cumsum(np.random.default_rng(k).normal(size=(800, 1)), axis=0) for k in range(2)]
    growing = [np.exp(np.arange(400)[:, None] / 30.0)]
    for runs in (walk, growing):
        found = fit_noise(runs, all_usable(runs))
        roots = np.roots(np.concatenate([[1.0], -found.coefficients[0]]))
        assert np.abs(roots).max(initial=0.0) < 1.0


LONG = np.array([0.5, 0.1, -0.2])


@pytest.mark.parametrize("taps", [TAPS, LONG, np.array([0.97]), np.zeros(0)])
def test_without_gaps_whitening_is_that_of_the_covariance_in_time(taps: Array) -> None:
    """The inverse of its Cholesky factor, of the first rows too."""
    model = NoiseModel((np.zeros(1), taps), np.array([1.0, SIGMA]))
    x = np.random.default_rng(4).normal(size=(40, 3))
    factor = np.linalg.cholesky(covariance_in_time(taps, SIGMA, 40))
    white = model.whitened(x, 1, np.ones(40, bool))
    assert white == pytest.approx(np.linalg.solve(factor, x), rel=1e-6, abs=1e-9)


def test_rows_after_gaps_are_predicted_from_what_is_left() -> None:
    """Of the p rows before each, those that are usable, by conditional expectation."""
    model = NoiseModel((LONG,), np.array([SIGMA]))
    rng = np.random.default_rng(1)
    usable = rng.random(120) > 0.3
    x = rng.normal(size=120)
    whole = covariance_in_time(LONG, SIGMA, 120)
    expected = []
    for t in np.flatnonzero(usable):
        past = [s for s in range(max(0, t - 3), t) if usable[s]]
        by = np.linalg.solve(whole[np.ix_(past, past)], whole[past, t])
        left = whole[t, t] - by @ whole[past, t]
        expected.append((x[t] - by @ x[past]) / np.sqrt(left))
    assert model.whitened(x, 0, usable) == pytest.approx(np.array(expected), rel=1e-6)
    wild = np.where(usable, x, np.nan)
    assert np.array_equal(model.whitened(wild, 0, usable), model.whitened(x, 0, usable))


@pytest.mark.parametrize("larger", [1.0, 3.0])
def test_more_noise_after_gaps_is_measured(larger: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Transients at reversals: innovations as large there as elsewhere, or three times that."""
    careful = noise_model._AFTER_GAPS
    monkeypatch.setattr(noise_model, "_AFTER_GAPS", 1.0)
    usable = np.ones((6000, 1), bool)
    usable[::25] = usable[1::25] = False
    shocks = SIGMA * np.random.default_rng(5).normal(size=6000)
    shocks[2::25] *= larger
    shocks[3::25] *= larger
    runs = [lfilter([1.0], np.concatenate([[1.0], -TAPS]), shocks)[:, None]]
    found = fit_noise(runs, [usable])
    assert found.after_gaps is not None
    if larger > 1.0:
        assert 1.8 < found.after_gaps[0] < larger
    else:
        assert found.after_gaps[0] < 1.1
    white = found.whitened(runs[0][:, 0], 0, usable[:, 0])
    monkeypatch.setattr(noise_model, "_AFTER_GAPS", careful)
    assert fit_noise(runs, [usable]).after_gaps == pytest.approx(
        [max(careful, found.after_gaps[0])]
    )
    assert white[found.follow_gaps(usable[:, 0])].std() == pytest.approx(1.0, abs=0.15)


def test_levels_are_those_of_each_joint() -> None:
    """A second-order process in closed form, a first-order one and independent samples."""
    model = NoiseModel((TAPS, np.array([0.8]), np.zeros(0)), np.array([SIGMA, 2.0, 5.0]))
    c1, c2 = TAPS
    variance = (1 - c2) / ((1 + c2) * ((1 - c2) ** 2 - c1**2))
    assert model.levels() == pytest.approx([SIGMA * np.sqrt(variance), 2.0 / 0.6, 5.0], rel=1e-6)


def test_an_autoregression_is_found_and_whitened(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(noise_model, "_NUGGET", 0.0)
    runs = [series(seed) for seed in range(5)]
    found = fit_noise(runs[:3], all_usable(runs[:3]))
    taps = np.zeros(HIGHEST_ORDER)
    taps[: len(found.coefficients[0])] = found.coefficients[0]
    assert taps[:2] == pytest.approx(TAPS, abs=0.04)
    assert np.abs(taps[2:]).max() < 0.04
    assert found.sigma[0] == pytest.approx(SIGMA, rel=0.02)
    for fresh in runs[3:]:  # not those it was fitted to
        assert ljung_box(fresh[:, 0]) < 1e-12
        white = found.whitened(fresh[:, 0], 0, np.ones(len(fresh), bool))
        assert ljung_box(white) > 1e-3
        assert white.std() == pytest.approx(1.0, abs=0.04)
