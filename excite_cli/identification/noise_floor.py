"""The noise floor of the torque: what changes from one period of a repeated motion to the next.

A model of the motion gives the same torque whenever the motion repeats. With y_k(φ) the filtered
torque at phase φ of period k of C, the deviation from the mean over the periods has the variance
of what does not repeat,

    σ² = Σ (y_k − ȳ)² / Σ (1 − 1/C),

noise of the torque, but also drift within a run, and the torque of what the controller did
differently. Effects that repeat, declared or not, leave it as it is.

Torque passes the averages that errors pass. The period is no whole number of samples: averages
around instants between samples are interpolated from those around the four next samples; what that
does to the gain of white noise, g = Σ w² relative to an average around a sample, is divided out.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, vstack

from excite_cli.identification.averages import (
    apply,
    average_rows,
    cubic_weights,
    reach,
    without,
)
from excite_cli.identification.processing import Processing
from excite_cli.measurement.dataset import Array, Finding, Mask, Run
from excite_cli.workers.base import Tell
from excite_cli.workers.context import each

# The period of a repeated motion to a fraction of a sample, from positions with gaps.
#
# Samples one period apart are alike. d(L) = mean |q(t+L) − q(t)|² over the samples that are known
# at both ends has its first deep minimum near the period P, to whole samples. To first order q(t +
# L) − q(t) = v(t) (L − kP) for a lag L close to k periods: least squares over many k give P.

# Positions one period apart differ by less than this share of their range.
_ALIKE = 0.02
# A lag counts if at least this share of the known samples has a partner.
_LEAST_SHARE = 1 / 8
_STEPS = 4
_MULTIPLES = 8  # periods that are looked at in a step, farther away from step to step
_SLOPE = 200  # parts of a period over which a speed is taken


def exact_period(q: Array, known: NDArray[np.bool_]) -> float | None:
    """Samples per period of q (T, n), if two whole periods are there, else None.

    known: (T,) which samples may be looked at; the others may hold anything. A run with gaps may
    have ended with one.
    """
    if known.sum() < 16:
        return None
    spread = q[known].std(axis=0)
    moved = spread > 1e-6
    if not moved.any():
        return None
    x = (q[:, moved] - q[known][:, moved].mean(axis=0)) / spread[moved]
    x = np.where(known[:, None], x, 0.0)
    apart = _apart(x, known)
    far = np.flatnonzero(np.isfinite(apart) & (apart > 0.5))
    if not len(far):
        return None
    first = int(far[0])
    good = np.flatnonzero(apart[first:] < _ALIKE**2)
    if not len(good):
        return None
    start = first + int(good[0])
    rising = np.flatnonzero(np.diff(apart[start:]) > 0)
    whole = start + (int(rising[0]) if len(rising) else 0)
    return _refined(x, known, float(whole))


def _apart(x: Array, known: NDArray[np.bool_]) -> Array:
    """Mean squared difference per joint of samples L apart, L up to half; inf if too few are."""
    size, weight = len(x), known.astype(float)
    own = np.fft.rfft(x, 2 * size, axis=0)
    mask = np.fft.rfft(weight, 2 * size)
    squares = np.fft.rfft(np.square(x).sum(axis=1), 2 * size)
    # Σ w_t |x_{t+L}|² + w_{t+L} |x_t|² − 2 x_t·x_{t+L}, even in L.
    spectrum = 2.0 * (squares.conj() * mask).real - 2.0 * np.square(np.abs(own)).sum(axis=1)
    longest_gap = int(np.diff(np.flatnonzero(known)).max()) - 1
    lags = slice(0, (size + longest_gap) // 2 + 1)
    total = np.fft.irfft(spectrum)[lags]
    pairs = np.fft.irfft(np.square(np.abs(mask)))[lags]
    enough = pairs > max(_LEAST_SHARE * weight.sum(), 1.0)
    return np.where(enough, total / np.maximum(pairs, 1.0) / x.shape[1], np.inf)


def _multiples(most: int, step: int) -> list[int]:
    """How many periods apart samples are compared: a few cases, up to all that a step dares.

    A lag is off by k times the error of the period; so it is known to that share before.
    """
    farthest = min(most, _MULTIPLES * 4**step)
    return sorted({round(k) for k in np.linspace(1, farthest, min(farthest, _MULTIPLES))})


def _refined(x: Array, known: NDArray[np.bool_], period: float) -> float:
    """The period that fits best at all its multiples."""
    half = max(1, round(period / _SLOPE))
    v, sure = np.zeros_like(x), np.zeros(len(x), bool)
    v[half:-half] = (x[2 * half :] - x[: -2 * half]) / (2 * half)
    sure[half:-half] = known[2 * half :] & known[half:-half] & known[: -2 * half]
    v[~sure] = 0.0
    for step in range(_STEPS):
        above, below = 0.0, 0.0
        for k in _multiples(int((len(x) - 1) / period), step):
            lag = round(k * period)
            slope = v[:-lag] * known[lag:, None]
            energy = float(np.vdot(slope, slope))
            if energy > 0.0:
                late = float(np.vdot(slope, x[lag:] - x[:-lag])) / energy
                above += energy * k * (lag - late)
                below += energy * k * k
        if below == 0.0:
            break
        period = above / below
    return period


_LONGEST = 600.0  # s of a run that are put together
_AT_ONCE = 4096  # averages around instants between samples: four times as many on the way
_FEWEST = 8  # phases at which a joint must have been seen twice
_LOST = 0.1  # share of an average's weight that invalid samples may take
# Misalignment of this share of the floor must be reported.
_UNEVEN = 0.5


@dataclass(frozen=True)
class NoiseFloor:
    """`rms` (n,) [N·m] (N) of what changes from period to period; NaN where too little is known.

    `misalignment` (n,) [N·m]: what of it may be due to periods that begin too early or too late,
    |dτ/dt| δt, with δt from the positions.
    """

    rms: Array
    misalignment: Array

    def named(self, joint_names: Sequence[str]) -> dict[str, float]:
        """`rms` by joint, where it is known."""
        pairs = zip(joint_names, self.rms, strict=True)
        return {name: float(value) for name, value in pairs if np.isfinite(value)}

    def noticed(self, joint_names: Sequence[str]) -> tuple[Finding, ...]:
        """A note if periods that begin unevenly in time may make up much of the floor."""
        shares = np.nan_to_num(self.misalignment / np.where(self.rms > 0, self.rms, np.inf))
        uneven = tuple(
            name for name, share in zip(joint_names, shares, strict=True) if share > _UNEVEN
        )
        if not uneven:
            return ()
        text = (
            f"the noise floor of {', '.join(uneven)} may be too high: repeated periods begin early "
            f"or late, which makes up to {min(shares.max(), 1.0):.0%} of it. Repeat the motion "
            "without a break, on one clock."
        )
        return (Finding("uneven_periods", "note", text, joints=uneven),)


@dataclass(frozen=True)
class _Whole:
    """A run put together from its parts: q, tau (T, n); `known` (T,), `valid` (T, n)."""

    q: Array
    tau: Array
    known: Mask
    valid: Mask
    step: float


def noise_floor(parts: Sequence[Run], processing: Processing) -> NoiseFloor | None:
    """Floor of the torque, filtered as `processing` says, over all runs with repeated periods.

    parts: runs, and blocks of runs in their order.

    Squares are added over the runs. None if no run holds two whole periods.
    """
    sums = np.zeros((4, parts[0].tau.shape[1]))
    for own in each(_sums_of, processing, _put_together(parts)):
        sums += own
    squares, freedom, shifted, phases = sums
    enough = phases >= _FEWEST
    if not enough.any():
        return None
    rms, misalignment = (
        np.sqrt(np.where(enough, total / np.where(enough, freedom, 1.0), np.nan))
        for total in (squares, shifted)
    )
    return NoiseFloor(rms, misalignment)


def _sums_of(processing: Processing, group: Sequence[Run], tell: Tell) -> Array:
    """What the parts of a run add; nothing where it holds no two periods."""
    run = _whole(group)
    period = exact_period(run.q, run.known)
    return np.zeros((4, run.tau.shape[1])) if period is None else _sums(run, period, processing)


def _put_together(parts: Sequence[Run]) -> Iterator[list[Run]]:
    """The parts of runs, which have gaps where their held-out blocks are; of long ones, pieces."""
    group: list[Run] = []
    for part in parts:
        joins = group and part.part.block and group[-1].id == part.id
        if group and not (joins and part.t[-1] - group[0].t[0] <= _LONGEST):
            yield group
            group = []
        group.append(part)
    yield group


def _whole(group: Sequence[Run]) -> _Whole:
    step, start = group[0].step, group[0].t[0]
    firsts = [round(float(part.t[0] - start) / step) for part in group]
    size = firsts[-1] + len(group[-1].t)
    shape = (size, group[0].tau.shape[1])
    q, tau, valid = np.zeros(shape), np.zeros(shape), np.zeros(shape, bool)
    known = np.zeros(size, bool)
    for first, part in zip(firsts, group, strict=True):
        at = slice(first, first + len(part.t))
        q[at], known[at] = part.q, True
        valid[at] = part.usable() & np.isfinite(part.tau)
        tau[at] = np.where(valid[at], part.tau, 0.0)
    return _Whole(q, tau, known, valid, step)


def _sums(run: _Whole, period: float, processing: Processing) -> Array:
    """Σ (y_k − ȳ)², Σ g (1 − 1/C), Σ of squared misalignment, and phases seen twice: (4, n)."""
    size, cutoff = len(run.q), processing.parallel_cutoff
    stride = max(1, round(1.0 / (run.step * processing.rate)))
    margin = reach(run.step, cutoff) + 2
    count = int(max(size - 2 * margin, 0) / period) + 1
    phases = np.arange(0.0, period, stride)
    if count < 2 or len(phases) < _FEWEST:
        return np.zeros((4, run.q.shape[1]))
    instants = margin + phases + period * np.arange(count)[:, None]
    inside = instants < size - margin
    rows = _averages_around(instants.ravel(), size, run.step, cutoff)
    nominal = average_rows(size, np.array([margin]), run.step, cutoff)
    gain = _squared(rows).reshape(*inside.shape, 1) / _squared(nominal)

    def seen(known: Mask, lost: float = 0.0) -> Mask:
        share = np.asarray(abs(rows) @ (~known).astype(float))
        return inside[:, :, None] & (share.reshape(*inside.shape, -1) <= lost)

    complete, good = seen(run.known[:, None]), seen(run.valid, _LOST)
    pairs = zip(run.valid.T, run.tau.T, strict=True)
    torque = np.stack([without(rows, valid) @ tau for valid, tau in pairs], axis=1)
    torque = torque.reshape(*inside.shape, -1)
    good &= complete
    times = good.sum(axis=0)
    twice = times > 1
    good &= twice
    mean = _mean(torque, good)
    squares = np.square(np.where(good, torque - mean, 0.0)).sum(axis=(0, 1))
    freedom = (good * gain * (1.0 - 1.0 / np.maximum(times, 1))).sum(axis=(0, 1))
    position = apply(rows, run.q).reshape(*inside.shape, -1)
    late = _late(position, complete, stride)
    slope = np.nan_to_num(np.gradient(mean, stride, axis=0))
    steep = np.square(slope).sum(axis=0) / np.maximum(twice.sum(axis=0), 1)
    return np.stack([squares, freedom, freedom * late**2 * steep, twice.sum(axis=0)])


def _squared(rows: csr_matrix) -> Array:
    """Σ w² of every row: the gain of white noise."""
    return np.asarray(rows.multiply(rows).sum(axis=1))


def _averages_around(
    instants: Array, samples: int, step: float, cutoff: float | None
) -> csr_matrix:
    """Averages (M, samples) around `instants` (M,), in samples, by cubic polynomials."""
    if len(instants) > _AT_ONCE:
        cuts = range(0, len(instants), _AT_ONCE)
        parts = [instants[cut : cut + _AT_ONCE] for cut in cuts]
        return vstack([_averages_around(part, samples, step, cutoff) for part in parts], "csr")
    base = np.floor(instants).astype(int)
    weights = cubic_weights(instants - base + 1)
    around = average_rows(samples, (base[:, None] + np.arange(-1, 3)).ravel(), step, cutoff)
    count = len(instants)
    places = (np.repeat(np.arange(count), 4), np.arange(4 * count))
    return csr_matrix(csr_matrix((weights.ravel(), places), (count, 4 * count)) @ around)


def _mean(x: Array, good: Mask) -> Array:
    """Over the periods (K, M, n) -> (M, n); NaN where there is none."""
    times = good.sum(axis=0)
    total = np.where(good, x, 0.0).sum(axis=0)
    return np.where(times > 0, total / np.maximum(times, 1), np.nan)


def _late(position: Array, good: Mask, stride: int) -> float:
    """RMS time in samples by which periods (K, M, n) run ahead of their mean or behind it."""
    good = good & (good.sum(axis=0) > 1)
    mean = _mean(position, good)
    speed = np.nan_to_num(np.gradient(mean, stride, axis=0)) * good
    ahead = (np.nan_to_num(position - mean) * speed).sum(axis=(1, 2))
    energy = np.square(speed).sum(axis=(1, 2))
    shifts = ahead[energy > 0] / energy[energy > 0]
    count = len(shifts)
    return float(np.sqrt(np.square(shifts).sum() / (count - 1))) if count > 1 else 0.0
