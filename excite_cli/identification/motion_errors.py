"""How wrong differentiated positions are: what coarse encoders add, and what a slow rate takes.

Positions in counts of s are wrong by s/√12, spread over all frequencies up to half the rate f_s; of
that the filter of positions lets pass what lies below its cut-off f_c, so speeds and accelerations
are wrong by

    σ_v² = s²/12 · 2/f_s · (2π)² f_c³/3,        σ_a² = s²/12 · 2/f_s · (2π)⁴ f_c⁵/5.

Of motion at a frequency f, that filter (run forwards and backwards) and central differences over h
keep H(f) = sinc(2 f h)/(1 + (f/f_c)⁸) in the speed; the acceleration is differentiated twice, and
keeps H(f) sinc(2 f h). What is lost follows from the spectrum of the positions.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from excite_cli.identification.processing import ABOVE_FLOOR, HIGHEST_BY_RATE, Processing, spectra
from excite_cli.measurement.dataset import Array, Finding, Mask, Run
from excite_cli.measurement.resolution import lattice_step
from excite_cli.workers.base import Tell
from excite_cli.workers.context import each

# Relative errors of speed and acceleration that are told. What is lost is lost in the same way all
# the time, and inertias and friction are off by as much; what counts add is noise, and makes
# inertias too small by its square.
_LOST, _COUNTED = (0.015, 0.04), (0.05, 0.15)
_FASTEST = 10.0  # Hz, of motion
# A rate that loses little: 25 times the highest frequency of the motion, which a slow rate hides.
_ENOUGH, _TWICE = 25.0, 2.0


@dataclass(frozen=True)
class MotionErrors:
    """Shares of the RMS of every joint's speed and acceleration (2, n): `counted`, `lost`."""

    counts: Array
    counted: Array
    lost: Array


def motion_errors(runs: Sequence[Run], processing: Processing) -> MotionErrors:
    """By the encoders' counts, and by the rate; `counts` (n,) in rad (m), 0 where unknown."""
    fs = processing.recorded_rate
    cutoff = processing.position_cutoff or fs / 2
    n = runs[0].q.shape[1]
    counts = np.array(list(each(_counts, [run.q for run in runs], range(n))))
    frequency, power = spectra(runs, fs)
    motion = _of_motion(frequency, power, fs)
    f = frequency[:, None]
    kept = np.sinc(2 * f / fs) / (1 + (f / cutoff) ** 8)
    speed, push = ((2 * np.pi * f) ** (2 * k) * motion for k in (1, 2))
    total = np.array([speed.sum(axis=0), push.sum(axis=0)])
    gone = np.array([
        (speed * (1 - kept) ** 2).sum(axis=0),
        (push * (1 - kept * np.sinc(2 * f / fs)) ** 2).sum(axis=0),
    ])  # fmt: skip
    noise = counts**2 / 12 * 2 / fs
    added = np.array([
        noise * (2 * np.pi) ** 2 * cutoff**3 / 3,
        noise * (2 * np.pi) ** 4 * cutoff**5 / 5,
    ])  # fmt: skip
    width = frequency[1] - frequency[0]
    return MotionErrors(counts, _root(added, total * width), _root(gone, total))


def _counts(positions: Sequence[Array], joint: int, tell: Tell) -> float:
    return lattice_step(np.concatenate([q[:, joint] for q in positions]))


def _of_motion(frequency: Array, power: Array, fs: float) -> Array:
    """The spectrum (F, n) up to where it meets its floor; the rest is noise."""
    floor = np.median(power[frequency > 0.3 * fs], axis=0)
    met = np.logical_or.accumulate(power < ABOVE_FLOOR * floor, axis=0)
    met[0] = False
    return np.where(met | (frequency[:, None] > _FASTEST), 0.0, power)


def _root(part: Array, whole: Array) -> Array:
    return np.sqrt(np.divide(part, whole, out=np.zeros_like(part), where=whole > 0))


def check_motion(
    runs: Sequence[Run], processing: Processing, names: Sequence[str]
) -> tuple[Finding, ...]:
    """Warnings where positions are too coarse, or too rare, for what is made of them."""
    errors, fs = motion_errors(runs, processing), processing.recorded_rate
    cutoff = processing.position_cutoff or fs / 2
    coarse = _too_much(errors.counted, _COUNTED)
    # Only where a higher rate would let the filter of positions pass more.
    limited = processing.position_cutoff is None or cutoff > 0.99 * HIGHEST_BY_RATE * fs
    slow = _too_much(errors.lost, _LOST) & limited
    found = []
    if coarse.any():
        joints = tuple(np.array(names)[coarse].tolist())
        steps = ", ".join(dict.fromkeys(f"{each:.2g}" for each in errors.counts[coarse]))
        speeds, accelerations = map(_shares, errors.counted[:, coarse])
        text = (
            f"positions of {', '.join(joints)} come in steps of {steps} rad (m): speeds are wrong "
            f"by {speeds}, accelerations by {accelerations}, which makes inertias too small and "
            "puts friction off where joints are slow. Record finer positions (of the motors, with "
            "measurement.position: motor), or set measurement.filter.position [Hz] lower than "
            f"{cutoff:.3g}"
        )
        found.append(Finding("coarse_positions", "warning", text, "", joints))
    if slow.any():
        joints = tuple(np.array(names)[slow].tolist())
        enough = max(_ENOUGH * processing.bandwidth, _TWICE * fs)
        speeds, accelerations = map(_shares, errors.lost[:, slow])
        text = (
            f"at {fs:.3g} Hz, with positions cut off at {cutoff:.3g} Hz, speeds of "
            f"{', '.join(joints)} lose {speeds} and accelerations {accelerations}: inertias and "
            f"friction come out wrong by as much. Record at {enough:.2g} Hz or more, move more "
            "slowly, or set measurement.filter.position [Hz] yourself"
        )
        found.append(Finding("slow_rate", "warning", text, "", joints))
    return tuple(found)


def _too_much(errors: Array, least: tuple[float, float]) -> Mask:
    return np.asarray((errors > np.array(least)[:, None]).any(axis=0))


def _shares(errors: Array) -> str:
    low, high = errors.min(), errors.max()
    return f"{100 * high:.2g} %" if high < 1.1 * low else f"{100 * low:.2g} to {100 * high:.2g} %"
