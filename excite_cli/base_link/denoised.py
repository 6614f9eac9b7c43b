"""Readings of an inertial unit without what is only its noise.

A unit's noise enters every column of the base's rows: 0.02 m/s² is the weight of a humanoid times
0.002. Columns with noise make sizes too small (errors in variables), and a base that hardly moves
seems to have forces of its own: a slow campaign of a standing humanoid was given gains of −5 ± 1 %
on its base's rows that nobody had put in. The expectation of a signal s with spectrum S, seen with
white noise of spectrum N, is Wiener's estimate: every frequency times S / (S + N). Columns made of
an expectation keep sizes unbiased (regression calibration; Carroll et al., Measurement Error in
Nonlinear Models, chapter 4).
"""

import numpy as np
from scipy.fft import dct, idct

from excite_cli.measurement.dataset import Array

_SEGMENT = 4.0  # s of the spectra that are averaged
_FLOOR_FROM = 0.3  # of the rate: nothing of a standing robot's motion is there
_BEYOND = 4.0  # standard deviations of a spectrum


def denoised(x: Array, step: float) -> Array:
    """Wiener's estimate (T, k) of the signals in `x` (T, k), sampled every `step` s.

    The noise's spectrum is the median of that beyond 0.3 of the rate, taken for white. Where a unit
    filters its own readings nothing is left there, and nothing is taken off. Means stay.
    """
    from scipy.signal import welch  # takes a second to import

    mean = x.mean(axis=0)
    length = min(len(x), max(16, round(_SEGMENT / step)))
    frequency, power = welch(x - mean, 1.0 / step, nperseg=length, axis=0)
    floor = np.median(power[frequency > _FLOOR_FROM / step], axis=0)
    power[0] = power[1]  # the means are off
    # A mean of K segments' spectra scatters by 1/√K: what is within that of the floor is noise.
    heard = power > floor * (1.0 + _BEYOND / np.sqrt(2 * len(x) // length - 1))
    gain = np.where(heard, 1.0 - floor / np.maximum(power, 1e-300), 0.0)
    # Of a series that goes on mirrored, so that its ends do not jump.
    terms = dct(x - mean, axis=0, norm="ortho")
    at = np.arange(len(x)) / (2.0 * len(x) * step)
    shares = np.stack([np.interp(at, frequency, each) for each in gain.T], axis=1)
    return np.asarray(mean + idct(shares * terms, axis=0, norm="ortho"))
