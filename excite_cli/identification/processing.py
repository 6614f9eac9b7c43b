"""Filters, chosen from the data: cut-offs of positions and torque, rates, borders.

Positions lose their noise in a zero-phase Butterworth filter whose cut-off lies where the spectrum
of the positions meets its floor. Torque and every regressor column then pass through the same
Gaussian averages at the same instants (parallel filtering): whatever that filter does, the linear
model still holds exactly.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from excite_cli.config.data_spec import FilterSpec
from excite_cli.errors import ConfigError
from excite_cli.measurement.dataset import Array, Run
from excite_cli.workers.base import Tell
from excite_cli.workers.context import each

# The signal has met its floor where the spectrum is below this multiple of it.
ABOVE_FLOOR = 20.0
_HIGHEST_POSITION, _LOWEST_POSITION = 40.0, 8.0  # Hz
HIGHEST_BY_RATE = 0.2  # of the recorded rate, for the cut-off of positions
_SHARE_OF_SPEED = 0.99
_POSITION_BY_BANDWIDTH = 5.0
# Where a drive's law gives the torque, friction is read off the bends that it makes in the motion
# at reversals, and what positions lose must lie beyond what is averaged. Coulomb friction of a
# simulated UR10 was 2 to 4 % too large with 0.95 to 1.5 times the averages' cut-off, 1 to 1.5 %
# with twice. With torque sensors that would only add noise: a joint's residual was missed by it.
_POSITION_BY_PARALLEL = 2.0
_PARALLEL_BY_BANDWIDTH, _HIGHEST_PARALLEL, _LOWEST_PARALLEL = 6.0, 12.0, 4.0
# Standard deviation of a Gaussian average in time, times its -3 dB frequency.
GAUSSIAN = float(np.sqrt(np.log(2.0)) / (2.0 * np.pi))
GAUSSIAN_REACH = 3.5  # half width of the average in standard deviations
DEFAULT_MOVING = 0.02  # rad/s
_SAME_RATE = 0.02  # share by which clocks differ
_ENOUGH = 12  # averages that a part of a run should give


@dataclass(frozen=True)
class Processing:
    """Every choice made between the file and the regression; frequencies in Hz, times in s."""

    recorded_rate: float
    position_cutoff: float | None
    parallel_cutoff: float | None
    rate: float
    working_stride: int
    border: float
    velocity: str
    moving_speed: float
    bandwidth: float
    reasons: tuple[str, ...] = ()

    @property
    def shortest(self) -> float:
        """How long a part of a run must be to say anything [s]."""
        reach = GAUSSIAN_REACH * GAUSSIAN / self.parallel_cutoff if self.parallel_cutoff else 0.0
        return 2.0 * (self.border + reach) + _ENOUGH / self.rate

    def as_data(self) -> dict[str, object]:
        """Plain values for files and JSON."""
        return asdict(self)


def processing_of(data: Mapping[str, Any]) -> Processing | None:
    """From the values of a file; None in files of earlier versions, which do not tell them all."""
    names = [field.name for field in fields(Processing) if field.name != "reasons"]
    if not all(name in data for name in names):
        return None
    stride = int(data["working_stride"])
    return Processing(**{**{name: data[name] for name in names}, "working_stride": stride})


def choose_processing(
    runs: Sequence[Run], spec: FilterSpec, moving_speed: float | None = None
) -> Processing:
    """Choose what `spec` leaves to the data, from `runs` (the training part alone).

    Raises
    ------
    ConfigError
        A cut-off lies beyond half the recorded rate, or measured speeds are requested and absent.
    """
    fs = float(np.median([1.0 / run.step for run in runs]))
    frequency, power = spectra(runs, fs)
    bandwidth = _bandwidth(frequency, power)
    slowest = min(1.0 / run.step for run in runs)  # of every run the same is left
    highest = fs if _of_rate(slowest, fs) else slowest
    usual, of_parallel = _parallel_cutoff(bandwidth, highest)
    parallel: float | None = usual
    if spec.parallel != "auto":
        parallel, of_parallel = _given_cutoff("parallel", spec.parallel, highest), ""
    if spec.position == "auto":
        by_law = any(run.law is not None for run in runs)
        least = _POSITION_BY_PARALLEL * usual if by_law else _POSITION_BY_BANDWIDTH * bandwidth
        position, of_position = _position_cutoff(frequency, power, fs, least, highest)
    else:
        position, of_position = _given_cutoff("position", spec.position, fs), ""
    reasons = [reason for reason in (of_position, of_parallel) if reason]
    rate = float(spec.rate) if spec.rate != "auto" else (4.0 * parallel if parallel else fs)
    rate = min(rate, fs)
    stride = 1
    if parallel:
        wanted = max(10.0 * parallel, 2.5 * (position or fs / 2.5))
        stride = max(1, int(fs // wanted))
    border = (1.2 / position if position else 0.0) + 2.0 / fs
    if spec.border is not None:
        border = spec.border
    if spec.velocity == "measured" and any(run.dq is None for run in runs):
        raise ConfigError(
            "measurement.filter.velocity: 'measured' needs recorded speeds (dq) in every run. "
            "Record them, or write 'differentiated'."
        )
    velocity = "measured" if spec.velocity == "measured" else "differentiated"
    return Processing(
        fs, position, parallel, rate, stride, float(border), velocity,
        moving_speed or DEFAULT_MOVING, bandwidth, tuple(reasons),
    )  # fmt: skip


def spectra(runs: Sequence[Run], fs: float) -> tuple[Array, Array]:
    """Mean spectrum of the positions (F, n) over the runs, on one grid of frequencies."""
    length = min(min(len(run.t) for run in runs), max(64, int(5.0 * fs)))
    total, weight = np.zeros(1), 0.0
    grid: Array = np.asarray(np.fft.rfftfreq(length, 1.0 / fs))
    tasks = [(run.q, 1.0 / run.step) for run in runs]
    for run, power in zip(runs, each(_spectrum, (fs, length, grid), tasks), strict=True):
        total, weight = total + power * len(run.t), weight + len(run.t)
    return grid, total / weight


def _of_rate(rate: float, fs: float) -> bool:
    """Whether a run is of the rate that most runs have, but for its clock."""
    return abs(rate - fs) < _SAME_RATE * fs


def _spectrum(shared: tuple[float, int, Array], task: tuple[Array, float], tell: Tell) -> Array:
    """Power (F, n) on the grid; beyond half of its own rate, what it has there."""
    from scipy.signal import welch  # takes a second to import

    (fs, length, grid), (q, rate) = shared, task
    if _of_rate(rate, fs):
        return np.asarray(welch(q, fs, nperseg=length, axis=0, detrend="linear")[1])
    own = min(max(round(length * rate / fs), 16), len(q))
    frequency, power = welch(q, rate, nperseg=own, axis=0, detrend="linear")
    return np.stack([np.interp(grid, frequency, column) for column in power.T], axis=1)


def _bandwidth(frequency: Array, power: Array) -> float:
    """Frequency below which nearly all energy of the speed lies, the fastest joint's [Hz]."""
    speed = power * frequency[:, None] ** 2
    speed[frequency > 10.0] = 0.0  # noise of the encoders grows with frequency
    share = np.cumsum(speed, axis=0) / np.maximum(speed.sum(axis=0), 1e-300)
    moved = power.sum(axis=0) > 1e-6 * power.sum(axis=0).max()
    return float(max(frequency[np.argmax(share[:, moved] >= _SHARE_OF_SPEED, axis=0)].max(), 0.3))


def _position_cutoff(
    frequency: Array, power: Array, fs: float, least: float, slowest: float
) -> tuple[float | None, str]:
    """Where the spectrum of the positions meets its floor, within bounds; and why."""
    floor = np.median(power[frequency > 0.3 * fs], axis=0)
    above = power > ABOVE_FLOOR * floor
    last = [frequency[np.flatnonzero(~column)[0]] if not column.all() else fs for column in above.T]
    found = float(np.median(last))
    lowest = max(_LOWEST_POSITION, least)
    highest = min(_HIGHEST_POSITION, HIGHEST_BY_RATE * slowest)
    chosen = float(min(max(found, lowest), highest))
    return chosen, (
        f"positions cut off at {chosen:.3g} Hz: their spectrum meets its floor at {found:.3g} Hz "
        f"(kept within {lowest:.3g} and {highest:.3g} Hz)"
    )


def _parallel_cutoff(bandwidth: float, slowest: float) -> tuple[float, str]:
    wanted = max(_PARALLEL_BY_BANDWIDTH * bandwidth, _LOWEST_PARALLEL)
    chosen = float(min(wanted, _HIGHEST_PARALLEL, slowest / 5.0))
    return chosen, (
        f"torque and columns averaged to {chosen:.3g} Hz: "
        f"{_PARALLEL_BY_BANDWIDTH:g} times the bandwidth of the speeds ({bandwidth:.3g} Hz)"
    )


def _given_cutoff(key: str, given: float | str, fs: float) -> float | None:
    if given == "none":
        return None
    if float(given) >= fs / 2:
        raise ConfigError(
            f"measurement.filter.{key}: {float(given):g} Hz is beyond half the recorded rate "
            f"({fs:g} Hz). Give a lower cut-off, or 'none'."
        )
    return float(given)
