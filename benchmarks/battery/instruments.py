"""What instruments make of a simulated campaign: noise, stale packets, lost samples, stamps.

The robot is simulated without noise; here it is added, so that the noise of every sample is known.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.robot.model import Array

_STALE_LENGTH = 3  # samples that a stale packet repeats at most


@dataclass(frozen=True)
class Instruments:
    """`noise`: share of the torque's RMS; `correlation` of AR(1) from sample to sample.

    `stale`: share of samples that repeat the ones before in all channels; `dropped`: share that is
    lost. `epochs`: seconds from 1970 at which the runs start, or none.
    """

    seed: int
    noise: float
    correlation: float = 0.0
    stale: float = 0.0
    dropped: float = 0.0
    epochs: tuple[float, ...] = ()


@dataclass(frozen=True)
class Recorded:
    """A campaign as its file holds it; `sound` without faults of packets; noise (T, n) by run."""

    dataset: Dataset
    sound: Dataset
    noise: dict[str, Array]


def recorded(simulated: Dataset, instruments: Instruments) -> Recorded:
    """The data with noise and faults."""
    faulty, sound, noise = [], [], {}
    for k, run in enumerate(simulated.runs):
        rng = np.random.default_rng([instruments.seed, 7, k])
        added = noise_of(run, instruments.noise, instruments.correlation, rng)
        noise[run.name] = added
        epoch = instruments.epochs[k] if instruments.epochs else run.epoch
        columns = {name: values for name, values in run.extra.items() if values.ndim == 1}
        good = replace(run, tau=run.tau + added, extra=columns, epoch=epoch)
        sound.append(good)
        faulty.append(_lost(_stale(good, instruments.stale, rng), instruments.dropped, rng))
    return Recorded(
        replace(simulated, runs=tuple(faulty)), replace(simulated, runs=tuple(sound)), noise
    )


def noise_of(run: Run, share: float, correlation: float, rng: np.random.Generator) -> Array:
    """Noise (T, n) of `share` of the torque's RMS in that run."""
    white = rng.normal(size=run.tau.shape)
    if correlation:
        white[1:] *= np.sqrt(1.0 - correlation**2)
        white = lfilter([1.0], [1.0, -correlation], white, axis=0)
    rms = np.sqrt(np.mean(run.tau**2, axis=0))
    return np.asarray(share * rms * white)


def _stale(run: Run, share: float, rng: np.random.Generator) -> Run:
    """Some packets come again: q, v and tau of the sample before, for one to three samples."""
    if not share:
        return run
    count = len(run.t)
    source = np.arange(count)
    starts = rng.choice(np.arange(1, count - _STALE_LENGTH), int(share * count / 2), replace=False)
    for start in starts:
        source[start : start + rng.integers(1, _STALE_LENGTH + 1)] = source[start - 1]
    return _taken(run, source)


def _lost(run: Run, share: float, rng: np.random.Generator) -> Run:
    if not share:
        return run
    kept = np.flatnonzero(rng.uniform(size=len(run.t)) >= share)
    return replace(_taken(run, kept), t=run.t[kept])


def _taken(run: Run, rows: NDArray[np.intp]) -> Run:
    dq = None if run.dq is None else run.dq[rows]
    extra = {name: values[rows] for name, values in run.extra.items()}
    return replace(run, q=run.q[rows], tau=run.tau[rows], dq=dq, extra=extra)
