"""From a raw run to smooth, differentiated motion, and the averages all columns go through."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_opening
from scipy.signal import butter, sosfiltfilt
from scipy.sparse import csr_matrix

from excite_cli.errors import FileError
from excite_cli.identification.processing import GAUSSIAN, GAUSSIAN_REACH, Processing
from excite_cli.measurement.dataset import Array, Run

_STANDSTILL = 0.25  # s
_FEWEST = 8  # decimated samples a run needs to say anything


@dataclass(frozen=True)
class PreparedRun:
    """One run (or block of it) ready for regression.

    `t` (T,) from the run's start, `q, v, a, tau_raw` (T, n) at the working rate with borders cut;
    `averages` (M, T) gives filtered and decimated values, at `step`, of any column: A x;
    `tau` (M, n) = A tau_raw; `valid` (M, n) samples untouched by invalid ones; `moving` (M, n)
    where the joint itself moves; `usable` (M, n) valid samples in which it does not stick: while a
    joint stands, dry friction holds whatever it must, and its torque says nothing.
    """

    name: str
    t: Array
    q: Array
    v: Array
    a: Array
    tau_raw: Array
    averages: csr_matrix
    tau: Array
    valid: NDArray[np.bool_]
    usable: NDArray[np.bool_]
    moving: NDArray[np.bool_]
    step: float

    def averaged(self, columns: Array) -> Array:
        """A applied along the first axis of (T, …)."""
        flat = columns.reshape(len(columns), int(np.prod(columns.shape[1:])))
        return np.asarray(self.averages @ flat).reshape(self.averages.shape[0], *columns.shape[1:])


def prepare(run: Run, processing: Processing) -> PreparedRun:
    """Filter, differentiate, cut borders, and average.

    Raises
    ------
    FileError
        The run is too short for the filters.
    """
    fs, q = 1.0 / run.step, run.q
    if processing.position_cutoff is not None:
        q = _smooth(q, processing.position_cutoff, fs, run.name)
    if processing.velocity == "measured" and run.dq is not None:
        v = run.dq
        if processing.position_cutoff is not None:
            v = _smooth(v, processing.position_cutoff, fs, run.name)
    else:
        v = np.gradient(q, run.step, axis=0)
    a = np.gradient(v, run.step, axis=0)
    border = int(np.ceil(processing.border * fs))
    stride = processing.working_stride
    inside = slice(border, len(run.t) - border)
    keep = slice(border, len(run.t) - border, stride)
    t = run.t[keep]
    averages, centers = _averages(len(t), run.step * stride, processing)
    if averages.shape[0] < _FEWEST:
        raise FileError(
            f"run '{run.name}' is too short: {run.duration:.3g} s leave {averages.shape[0]} "
            f"averaged samples at {processing.rate:.3g} Hz after its borders are cut; "
            f"{_FEWEST} are needed. Record longer, or raise measurement.filter.rate."
        )
    # The torque is averaged at the full rate: picking samples first would fold its noise down.
    of_torque = _kernel_rows(
        len(run.t[inside]), centers * stride, run.step, processing.parallel_cutoff
    )
    broken = (~run.usable()[inside]).astype(float)
    valid = np.asarray((of_torque != 0).astype(float) @ broken) == 0
    speed = np.abs(np.asarray(averages @ v[keep]))
    step = float((centers[1] - centers[0]) * run.step * stride)
    return PreparedRun(
        name=run.name,
        t=t,
        q=q[keep],
        v=v[keep],
        a=a[keep],
        tau_raw=run.tau[keep],
        averages=averages,
        tau=np.asarray(of_torque @ run.tau[inside]),
        valid=valid,
        usable=valid & ~_sticking(speed <= processing.moving_speed, step),
        moving=speed > processing.moving_speed,
        step=step,
    )


def _sticking(still: NDArray[np.bool_], step: float) -> NDArray[np.bool_]:
    """Samples (M, n) within a standstill of some length; passing through zero is none."""
    least = max(3, round(_STANDSTILL / step))
    return np.asarray(binary_opening(still, np.ones((least, 1)), border_value=0))


def _smooth(x: Array, cutoff: float, fs: float, name: str) -> Array:
    sections = butter(4, cutoff, fs=fs, output="sos")
    pad = min(int(3 * fs / cutoff), len(x) - 2)
    if pad < 10:
        raise FileError(f"run '{name}' has only {len(x)} samples: too short for any filter.")
    return np.asarray(sosfiltfilt(sections, x, axis=0, padlen=pad))


def _averages(
    samples: int, h: float, processing: Processing
) -> tuple[csr_matrix, NDArray[np.intp]]:
    """Averages around equidistant instants whose support lies within the run, and their centres."""
    stride = max(1, round(1.0 / (h * processing.rate)))
    reach = _reach(h, processing.parallel_cutoff)
    centers = np.arange(reach, samples - reach, stride)
    return _kernel_rows(samples, centers, h, processing.parallel_cutoff), centers


def _reach(h: float, cutoff: float | None) -> int:
    """Half width of the average in samples of length h."""
    return 0 if cutoff is None else max(1, int(np.ceil(GAUSSIAN_REACH * GAUSSIAN / cutoff / h)))


def _kernel_rows(
    samples: int, centers: NDArray[np.intp], h: float, cutoff: float | None
) -> csr_matrix:
    reach = _reach(h, cutoff)
    offsets = np.arange(-reach, reach + 1)
    width = GAUSSIAN / cutoff / h if cutoff else 1.0
    kernel = np.exp(-0.5 * (offsets / width) ** 2)
    kernel /= kernel.sum()
    columns = (centers[:, None] + offsets).ravel()
    inside = (columns >= 0) & (columns < samples)
    rows = np.repeat(np.arange(len(centers)), len(kernel))
    values = np.tile(kernel, len(centers))
    shape = (len(centers), samples)
    return csr_matrix((values[inside], (rows[inside], columns[inside])), shape)
