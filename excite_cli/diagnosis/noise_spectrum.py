"""The noise of the torque, from its own spectrum above the motion.

Between 8 and 100 Hz hardly any torque belongs to the motion, and of what does a model predicts the
most: in every band the lesser power counts, of the torque or of what a model leaves of it. That is
taken for noise with the spectrum of an autoregression of first order,

    S(f) = S₀ / (1 + (f/f₀)²),    white for f₀ → ∞,

fitted to the power of a few bands; ∫ S(f) |G(f)|² df is then what the averages G of the fit leave
of it. The corner f₀ is not known well where it lies below the bands. So there are two levels: of
white noise as in 8–20 Hz in most stretches of time (the median; bursts at reversals and starts are
none), and of the noise with the lowest corner that the bands allow (two standard deviations), which
is the most that noise with a memory can be.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import compress

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import butter, fftconvolve, oaconvolve, sosfiltfilt
from scipy.stats import chi2

from excite_cli.identification.averages import average_rows
from excite_cli.identification.prepare import PreparedRun
from excite_cli.identification.processing import Processing
from excite_cli.measurement.dataset import Array, Mask, Run
from excite_cli.workers.base import Tell
from excite_cli.workers.context import each

_BANDS = ((8.0, 14.0), (14.0, 20.0), (20.0, 35.0), (35.0, 60.0), (60.0, 100.0))  # Hz
_WHITE = 2  # of the bands give the level of white noise
_HIGHEST = 0.4  # of the recorded rate
# f₀ of the spectra that are tried [Hz]: a coefficient of 0.98 at 500 Hz has 1.6 Hz.
_CORNERS = np.append(np.geomspace(1.5, 60.0, 40), 1e6)
_MODEL_ERROR = 0.05  # relative, of a band's power, beside its statistical error
_TWO_SD = 4.0  # of χ²
# A second band so much weaker than the first was filtered before it was recorded.
_FILTERED = 0.2
_REVERSAL = 0.15  # s around a reversal, whose friction is in all bands
_AVERAGED = 0.08  # s, of what stands there instead: 1.0 times the noise, of 0.05 s 1.5 times
_FAR, _NEXT_TO_NOTHING = 7.0, 1e-11  # deviations of that average, and the least of its weight
_RESPONSE = 1.0  # s, after which a band's filter has forgotten an impulse
_LEAST_SECONDS = 2.0
_STRETCH, _FEWEST_STRETCHES = 0.5, 6  # s


@dataclass(frozen=True)
class BandNoise:
    """RMS (n,) [N·m] (N) of noise in the averages of the fit; NaN where it is not known.

    `white`: as flat as between 8 and 20 Hz. `coloured`: the most that the bands allow.
    """

    white: Array
    coloured: Array


def band_noise(
    recorded: Sequence[Run],
    prepared: Sequence[PreparedRun],
    predicted: Sequence[Array],
    processing: Processing,
) -> BandNoise:
    """Noise of the torque of `recorded` runs, of which `prepared` are the same in the same order.

    predicted: torque (T, n) of a model at the working rate of each run. Recordings below 50 Hz do
    not show the noise, nor does torque that somebody low-passed. Of several rates all recordings
    are judged in the bands of the lowest one that shows it.
    """
    n = recorded[0].tau.shape[1]
    white, coloured = np.full(n, np.nan), np.full(n, np.nan)
    rates = [_HIGHEST * min(1.0 / run.step, processing.recorded_rate) for run in recorded]
    fast = [rate >= _BANDS[_WHITE - 1][1] for rate in rates]
    if not any(fast):
        return BandNoise(white, coloured)
    bands = [band for band in _BANDS if band[1] <= min(compress(rates, fast))]
    tasks = compress(zip(recorded, prepared, predicted, strict=True), fast)
    runs = list(each(_of_run, (bands, processing.moving_speed), tasks))
    seconds, counted, energies = (
        np.sum([getattr(run, name) for run in runs], axis=0)
        for name in ("seconds", "counted", "energies")
    )
    stretches = zip(*(run.stretches for run in runs), strict=True)
    usual = np.stack([_usual(np.concatenate(own)) for own in stretches])
    known = seconds > _LEAST_SECONDS
    widths = np.array([high - low for low, high in bands])[:, None]
    power = energies.min(axis=0) / np.where(known & (counted > 0.0), counted, np.nan) / widths
    # Of the bands that give the level of white noise: all of them, and most stretches.
    shares = widths[:_WHITE] / widths[:_WHITE].sum()
    flat = np.fmin(*((shares * x[:_WHITE]).sum(axis=0) for x in (power, usual / widths[:_WHITE])))
    known &= np.nan_to_num(power[1]) > _FILTERED * np.nan_to_num(power[0])
    for j in np.flatnonzero(known & (power > 0).all(axis=0)):
        gain = _gain(prepared, processing, int(j))
        level, corner = _lowest_corner(power[:, j], 2 * widths[:, 0] * seconds[j], bands)
        white[j] = np.sqrt(gain * _left(float(flat[j]), _CORNERS[-1], processing))
        coloured[j] = max(white[j], np.sqrt(gain * _left(level, corner, processing)))
    return BandNoise(white, coloured)


@dataclass(frozen=True)
class _Bands:
    """What a run adds: `seconds` (n,) of sliding, of every band `counted` (B, n), `energies` of the
    torque and of what is left (2, B, n), and powers of `stretches` of the first."""

    seconds: Array
    counted: Array
    energies: Array
    stretches: list[Array]


def _of_run(
    shared: tuple[Sequence[tuple[float, float]], float],
    task: tuple[Run, PreparedRun, Array],
    tell: Tell,
) -> _Bands:
    bands, moving_speed = shared
    run, fit, torque = task
    v = np.stack([np.interp(run.t, fit.t, column) for column in fit.v.T], axis=1)
    of_base = np.arange(v.shape[1]) < run.base_rows
    good = run.usable() & np.isfinite(run.tau) & (of_base | ~_near_reversal(v, run.step))
    sliding = good & (of_base | (np.abs(v) > moving_speed))
    # Between samples of the working rate; at the borders, that of the nearest.
    predicted = CubicSpline(fit.t, torque, axis=0)(np.clip(run.t, fit.t[0], fit.t[-1]))
    left = run.tau - predicted
    series = _bridged((run.tau, left), good, run.step)
    counted, energies, stretches = [], [], []
    for k, band in enumerate(bands):
        kept = np.where(sliding, _kept(good, run.step, band), 0.0)
        counted.append(kept.sum(axis=0) * run.step)
        squares = [np.square(_passed(x, run.step, band)) for x in series]
        energies.append([np.where(sliding, x, 0.0).sum(axis=0) * run.step for x in squares])
        if k < _WHITE:
            stretches.append(_stretches(np.minimum(*squares), kept, run.step))
    return _Bands(
        sliding.sum(axis=0) * run.step,
        np.array(counted),
        np.array(energies).transpose(1, 0, 2),
        stretches,
    )


def _near_reversal(v: Array, step: float) -> Mask:
    """Samples (T, n) near a change of sign of v (T, n), or near the ends."""
    crossing = np.zeros(v.shape)
    crossing[1:] = np.signbit(v[1:]) != np.signbit(v[:-1])
    crossing[[0, -1]] = 1.0
    window = np.ones(2 * round(_REVERSAL / step) + 1)
    return np.stack([np.convolve(column, window, "same") for column in crossing.T], axis=1) > 0.5


def _bridged(series: Sequence[Array], good: Mask, step: float) -> list[Array]:
    """Series (T, n) with the smooth average of what is around where it is not good.

    A jump there would ring in every band, and a line from one noisy sample to another adds noise.
    """
    width = _AVERAGED / step
    half = round(_FAR * width)
    window = np.exp(-0.5 * np.square(np.arange(-half, half + 1) / width))
    window /= window.sum()

    def around(x: Array) -> Array:
        return np.stack([oaconvolve(column, window, "same") for column in x.T], axis=1)

    count = around(good.astype(float))
    near = count > _NEXT_TO_NOTHING
    return [
        np.where(good, x, np.where(near, around(np.where(good, x, 0.0)), 0.0) / (count + ~near))
        for x in series
    ]


def _kept(good: Mask, step: float, band: tuple[float, float]) -> Array:
    """Share (T, n) of the power of white noise that passes the band, with averages over the rest.

    Σ h² over what is good, h the filter's response to an impulse.
    """
    impulse = np.zeros((2 * round(_RESPONSE / step) + 1, 1))
    impulse[len(impulse) // 2] = 1.0
    squares = np.square(_passed(impulse, step, band))
    share = fftconvolve(good.astype(float), squares / squares.sum(), "same", axes=0)
    return np.clip(share, 0.0, 1.0)


def _stretches(square: Array, kept: Array, step: float) -> Array:
    """Mean power (S, n) of stretches of `_STRETCH` of which most is `kept`, or NaN."""
    length = max(1, round(_STRETCH / step))
    edges = np.arange(0, max(len(square) - length + 1, 1), length)
    count = np.add.reduceat(kept, edges, axis=0)
    power = np.add.reduceat(np.where(kept > 0.0, square, 0.0), edges, axis=0)
    return np.asarray(np.where(count > 0.5 * length, power / np.maximum(count, 1e-12), np.nan))


def _usual(power: Array) -> Array:
    """The median (n,) of stretches (S, n) of noise, as the mean that it has with this median."""
    freedom = 2.0 * (_BANDS[0][1] - _BANDS[0][0]) * _STRETCH
    known = np.isfinite(power).sum(axis=0) >= _FEWEST_STRETCHES
    median = np.nanmedian(np.where(known, power, 0.0), axis=0)
    return np.where(known, median * freedom / chi2.median(freedom), np.nan)


def _passed(x: Array, step: float, band: tuple[float, float]) -> Array:
    sections = butter(4, band, "bandpass", fs=1.0 / step, output="sos")
    return np.asarray(sosfiltfilt(sections, x, axis=0, padlen=min(len(x) - 2, 100)))


def _lowest_corner(
    power: Array, freedom: Array, bands: Sequence[tuple[float, float]]
) -> tuple[float, float]:
    """S₀ and f₀ of the lowest corner that explains the power of the bands."""
    weights = 1.0 / (2.0 / freedom + _MODEL_ERROR**2)
    low, high = np.array(bands).T
    corners = _CORNERS[:, None]
    shapes = corners * (np.arctan(high / corners) - np.arctan(low / corners)) / (high - low)
    levels = np.log(power) - np.log(shapes)  # (corners, bands)
    means = np.average(levels, axis=1, weights=weights)
    misfits = np.square(levels - means[:, None]) @ weights
    first = int(np.argmax(misfits <= misfits.min() + _TWO_SD))
    return float(np.exp(means[first])), float(_CORNERS[first])


def _left(level: float, corner: float, processing: Processing) -> float:
    """∫ S |G|² df: what the averages leave; without any, all up to half the recorded rate."""
    cutoff = processing.parallel_cutoff
    if cutoff is None:
        f = np.linspace(0.0, processing.recorded_rate / 2, 2000)
        passed = np.ones_like(f)
    else:
        f = np.linspace(0.0, 4.0 * cutoff, 400)
        passed = np.exp(-np.log(2.0) * (f / cutoff) ** 2)
    return float(np.trapezoid(level * passed / (1.0 + (f / corner) ** 2), f))


def _gain(prepared: Sequence[PreparedRun], processing: Processing, joint: int) -> float:
    """Σ w² of the averages of the fit over that of whole ones: samples left out mean more noise."""
    ratios = []
    for run in prepared:
        middle, step = np.array([len(run.t) // 2]), float(run.t[1] - run.t[0])
        whole = average_rows(len(run.t), middle, step, processing.parallel_cutoff)
        rows = run.fit_averages[joint][run.usable[:, joint]]
        squares = np.asarray(rows.multiply(rows).sum(axis=1)).ravel()
        ratios.append(squares / float(whole.multiply(whole).sum()))
    every = np.concatenate(ratios)
    return max(1.0, float(every.mean())) if len(every) else 1.0
