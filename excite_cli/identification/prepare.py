"""From a raw run to smooth, differentiated motion, and the averages all columns go through."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d
from scipy.sparse import csr_matrix

from excite_cli.errors import FileError
from excite_cli.identification.averages import (
    apply,
    average_rows,
    filled,
    interpolation,
    reach,
    rounding_of,
    without,
)
from excite_cli.identification.declared_states import LeftOut
from excite_cli.identification.processing import Processing
from excite_cli.measurement.dataset import Array, Finding, Run, TorqueLaw
from excite_cli.measurement.run_identity import RunId
from excite_cli.out_of_core import Spool
from excite_cli.workers.base import Tell
from excite_cli.workers.context import each

# Around a reversal a joint sticks: what its friction then is, only the torque itself knows.
_STICKING = 0.02  # s
_SMEARED = 0.5  # periods of the cut-off by which the filter smears a reversal
_NOISE = 0.01  # rad (m), RMS, beyond what any encoder adds
# Of a run's rate, for the cut-off of its positions: the filter begins on three periods of it, ten
# samples at least.
_HIGHEST_GIVEN = 0.3
_FASTEST = 1e7  # Hz: beyond, filters of some Hz cannot be computed
_FEWEST = 8  # decimated samples a run needs to say anything


@dataclass(frozen=True)
class PreparedRun:
    """One run (or block of it) ready for regression.

    `t` (T,) from the start of the recording `run` (at `start` [s] on the campaign's clock), `q, v,
    a, tau_raw` (T, n) and `covariates` (T,) at the working rate with borders cut; `averages` (M, T)
    gives filtered and decimated values, at `step`, of any column: A x; `moving` (M, n) where the
    joint itself moves.

    What torque is judged by leaves out invalid samples of its joint: `tau` (M, n) are averages of
    the others, `valid` (M, n) where enough is left, `valid_averages` those of each joint.

    For fits every joint has averages of its own, which leave out invalid samples and those in
    which it stands or reverses; `tau_fit` (M, n) are those of the torque, `usable` (M, n) where
    enough is left. `rounding`: what is uncertain in them where torques are recorded in steps, per
    joint (`rounding_of`); `unsure` (u, M, n): how `tau_fit` changes by one standard deviation of
    each figure that torques are computed with. `before` (L, n): positions at the working rate until
    `t` begins. The first `base_rows` joints are a base's.
    """

    run: RunId
    t: Array
    q: Array
    v: Array
    a: Array
    tau_raw: Array
    averages: csr_matrix
    tau: Array
    valid: NDArray[np.bool_]
    valid_averages: tuple[csr_matrix, ...]
    moving: NDArray[np.bool_]
    fit_averages: tuple[csr_matrix, ...]
    tau_fit: Array
    usable: NDArray[np.bool_]
    step: float
    start: float = 0.0
    covariates: Mapping[str, Array] = field(default_factory=dict)
    rounding: tuple[csr_matrix | None, ...] = ()
    unsure: Array | None = None
    before: Array | None = None
    base_rows: int = 0

    def averaged(self, columns: Array) -> Array:
        """A applied along the first axis of (T, …)."""
        return apply(self.averages, columns)

    def averaged_torque(self, torque: Array) -> Array:
        """Averages (M, n) of torques (T, n) over the very samples that `tau` is made of."""
        columns = zip(self.valid_averages, torque.T, strict=True)
        return np.stack([each @ column for each, column in columns], axis=1)

    def averaged_for_fit(self, columns: Array, rows: Sequence[int] | None = None) -> Array:
        """Averages of (T, r, …), each row with those of its joint (default: joint k for row k)."""
        joints = range(columns.shape[1]) if rows is None else rows
        parts = [apply(self.fit_averages[j], columns[:, k]) for k, j in enumerate(joints)]
        return np.stack(parts, axis=1)


def prepare(run: Run, processing: Processing, left_out: LeftOut = LeftOut()) -> PreparedRun:
    """Filter, differentiate, cut borders, and average; fits use nothing that is `left_out`.

    Raises
    ------
    FileError
        The run is too short for the filters, or recorded too slowly for their cut-off, or faster
        than any robot is.
    """
    fs = 1.0 / run.step
    if fs > _FASTEST:
        raise FileError(
            f"run '{run.label}': samples come at {fs:.3g} Hz, which no robot's log does. Check "
            "measurement.time."
        )
    q, unsure = smoothed(run, processing), list[Array]()
    if (law := run.law) is not None:
        run = law.of_smooth(run, q)
        unsure = law.unsure(replace(run, q=q))
    border = int(np.ceil(processing.border * fs))
    stride = processing.working_stride
    inside = slice(border, len(run.t) - border)
    keep = slice(border, len(run.t) - border, stride)
    t = run.t[keep]
    h, cutoff = run.step * stride, processing.parallel_cutoff
    half = reach(h, cutoff)  # the averages lie within the run
    centers = np.arange(half, len(t) - half, max(1, round(1.0 / (h * processing.rate))))
    if len(centers) < _FEWEST:
        raise FileError(
            f"run '{run.label}' is too short: {run.duration:.3g} s leave {len(centers)} "
            f"averaged samples at {processing.rate:.3g} Hz after its borders are cut; "
            f"{_FEWEST} are needed. Record longer, raise measurement.filter.rate, or check "
            f"measurement.time: a sample lasts {run.step:.3g} s."
        )
    averages = average_rows(len(t), centers, h, cutoff)
    # The torque is averaged at the full rate: picking samples first would fold its noise down.
    of_torque = average_rows(len(run.t[inside]), centers * stride, run.step, cutoff)
    recorded = run.usable()[inside]
    v, a, sliding = _motion(run, q, processing, left_out.coupled, keep)
    speed = np.abs(np.asarray(averages @ v))
    counted = recorded & sliding[inside]
    past = q[:border]
    if run.before is not None and len(run.before):
        earlier = _smooth(run.before, processing.position_cutoff, fs, run.label)
        past = np.concatenate([earlier, past])
    counted &= left_out.on_the_way(q[inside], past) & left_out.below_cuts(run.tau[inside])
    # The very same weights for the columns: left out at the working rate, other stretches of time
    # would be, and the torque would lag by milliseconds.
    to_full_rate = interpolation(len(t), stride, len(counted))
    tau, joints = run.tau[inside], range(run.q.shape[1])
    # Averages at the full rate are as large as all else together: one joint's at a time.
    unsure = [change[inside] for change in unsure]
    fit = [
        _averaged(without(of_torque, counted[:, j]), to_full_rate, run, tau, j, unsure)
        for j in joints
    ]
    every = np.ones(len(centers), dtype=bool)
    valid = [
        _JointAverages(averages, np.asarray(of_torque @ tau[:, j]), every)
        if recorded[:, j].all()
        else _averaged(without(of_torque, recorded[:, j]), to_full_rate, None, tau, j)
        for j in joints
    ]
    return PreparedRun(
        run=run.id,
        t=t,
        q=q[keep],
        v=v,
        a=a,
        tau_raw=run.tau[keep],
        averages=averages,
        tau=np.stack([each.tau for each in valid], axis=1),
        valid=np.stack([each.filled for each in valid], axis=1),
        valid_averages=tuple(each.averages for each in valid),
        moving=(speed > processing.moving_speed) | (np.arange(speed.shape[1]) < run.base_rows),
        fit_averages=tuple(each.averages for each in fit),
        tau_fit=np.stack([each.tau for each in fit], axis=1),
        usable=np.stack([each.filled for each in fit], axis=1),
        step=float((centers[1] - centers[0]) * h),
        start=run.start,
        base_rows=run.base_rows,
        covariates={name: values[keep] for name, values in run.covariates.items()},
        before=past[len(past) % stride :: stride],
        rounding=() if run.torque_step is None else tuple(each.rounding for each in fit),
        unsure=_unsure(law, fit),
    )


def prepare_all(
    runs: Sequence[Run], processing: Processing, left_out: LeftOut = LeftOut()
) -> list[PreparedRun]:
    """As `prepare`, all of them, what is large of many on disk."""
    spool, found = Spool(), []
    for run in each(_prepared, (processing, left_out), runs):
        found.append(_kept(run, spool))
    return found


def _prepared(shared: tuple[Processing, LeftOut], run: Run, tell: Tell) -> PreparedRun:
    return prepare(run, *shared)


def _kept(run: PreparedRun, spool: Spool) -> PreparedRun:
    """The averages of joints are often the same, and are kept once."""
    seen: dict[int, csr_matrix] = {}

    def kept(value: Any) -> Any:
        if isinstance(value, csr_matrix):
            if id(value) not in seen:
                seen[id(value)] = spool.keep_rows(value)
            return seen[id(value)]
        if isinstance(value, np.ndarray):
            return spool.keep(value)
        return tuple(map(kept, value)) if isinstance(value, tuple) else value

    own = {each.name: kept(getattr(run, each.name)) for each in fields(run)}
    covariates = {name: spool.keep(values) for name, values in run.covariates.items()}
    return replace(run, **{**own, "covariates": covariates})


@dataclass(frozen=True)
class _JointAverages:
    """One joint's `averages` (M, T) at the working rate, of its torque (M,), and which are any.

    `unsure` (u, M): of changes of the torque.
    """

    averages: csr_matrix
    tau: Array
    filled: NDArray[np.bool_]
    rounding: csr_matrix | None = None
    unsure: Array | None = None


def _averaged(
    full: csr_matrix,
    to_full_rate: csr_matrix,
    run: Run | None,
    tau: Array,
    j: int,
    changes: Sequence[Array] = (),
) -> _JointAverages:
    """Of averages at the full rate; with `run`, what the steps of its torque leave uncertain.

    `changes` (T, n) of the torque likewise.
    """
    own = (full @ to_full_rate).tocsr()
    rounding = None
    if run is not None and run.torque_step is not None and run.torque_step[j]:
        rounding = rounding_of(full, tau[:, j], float(run.torque_step[j]))
    unsure = np.stack([full @ change[:, j] for change in changes]) if changes else None
    there = filled(full) & filled(own)
    return _JointAverages(own, np.asarray(full @ tau[:, j]), there, rounding, unsure)


def _unsure(law: TorqueLaw | None, joints: Sequence[_JointAverages]) -> Array | None:
    """Changes of the averages of all joints, (u, M, n), by what the law is unsure of."""
    shifts = [joint.unsure for joint in joints if joint.unsure is not None]
    if law is None or not shifts:
        return None
    averaged = np.stack([joint.tau for joint in joints], axis=1)
    return np.concatenate([np.stack(shifts, axis=2), law.by_gains(averaged)])


def smoothed(run: Run, processing: Processing) -> Array:
    """Smoothed positions (T, n), one joint after the other: filters take room.

    Raises
    ------
    FileError
        They jump as no robot does.
    """
    fs, cutoff = 1.0 / run.step, processing.position_cutoff
    if cutoff is None:
        return run.q
    q = np.empty_like(run.q)
    for j in range(q.shape[1]):
        q[:, j] = _smooth(run.q[:, j], cutoff, fs, run.label)
    noise = np.std(run.q - q, axis=0)
    wild = (noise > _NOISE) & (noise > 0.5 * np.std(run.q, axis=0))
    if wild.any():  # no robot moves so
        raise FileError(
            f"run '{run.label}': positions jump by {noise.max():.3g} rad (m) from sample to sample "
            f"(of joint {', '.join(str(j + 1) for j in np.flatnonzero(wild))} of the config, "
            f"counted from 1); most of their change lies beyond {cutoff:.3g} Hz. Are these the "
            "positions (measurement.channels), in the right unit (measurement.angle, time)?"
        )
    return q


def _motion(
    run: Run,
    q: Array,
    processing: Processing,
    coupled: Sequence[tuple[int, int, float]],
    keep: slice,
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Speeds and accelerations at the samples to `keep`, and where joints slide (T, n)."""
    n = q.shape[1]

    def speed(j: int) -> Array:
        if processing.velocity != "measured" or run.dq is None:
            return np.asarray(np.gradient(q[:, j], run.step))
        return _smooth(run.dq[:, j], processing.position_cutoff, 1.0 / run.step, run.label)

    sliding = np.empty(q.shape, dtype=bool)
    v, a = (np.empty((len(q[keep]), n)) for _ in range(2))
    for j in range(n):
        own = speed(j)
        v[:, j], a[:, j] = own[keep], np.gradient(own, run.step)[keep]
        sliding[:, j] = _sliding(own, run.step, processing)
    for j, k, s in coupled:
        both = _sliding(speed(j) + s * speed(k), run.step, processing)
        sliding[:, [j, k]] &= both[:, None]
    sliding[:, : run.base_rows] = True
    return v, a, sliding


def require_motion(
    runs: Sequence[PreparedRun],
    processing: Processing,
    joint_names: Sequence[str],
    without_torque: Sequence[str] = (),
) -> None:
    """Raise FileError unless some joint moves, and some torque changes, in what is fitted.

    No torque is asked of joints `without_torque`.

    Where a joint stands or reverses, its torque is up to its friction and counts in no fit.
    """
    if not any(run.usable.any() for run in runs):
        raise FileError(
            f"no joint moves faster than {processing.moving_speed:g} rad/s (m/s) with a torque "
            "that may be used, outside of the held-out part: nothing can be fitted. Record motion, "
            "or lower diagnosis.moving_speed."
        )
    known = np.any([run.valid.any(axis=0) for run in runs], axis=0)
    missing = [
        name
        for name, some in zip(joint_names, known, strict=True)
        if not some and name not in without_torque
    ]
    if missing:
        names = ", ".join(missing)
        raise FileError(
            f"torque of {names}: no sample may be used outside of the held-out part, all are "
            "masked. Do without (measurement.without_torque), or hold out another run."
        )
    if not any(np.ptp(run.tau_raw, axis=0).any() for run in runs):
        raise FileError(
            "all torques are constant: there is nothing to fit. Is this the right channel "
            "(measurement.channels: {tau: …})?"
        )


def standing_still(runs: Sequence[PreparedRun], joint_names: Sequence[str]) -> list[Finding]:
    """What is told of joints that move in none of the runs; nothing where all move."""
    moving = np.any([run.moving.any(axis=0) for run in runs], axis=0)
    still = tuple(name for name, moves in zip(joint_names, moving, strict=True) if not moves)
    if not still:
        return []
    text = (
        f"{', '.join(still)}: {'stands' if len(still) == 1 else 'stand'} still in all of the data "
        "that are fitted, so that inertias are kept near the URDF's where only that motion shows "
        "them. Record it, or leave the joint out of robot.joints."
    )
    return [Finding("still", "warning", text, "", still)]


def _sliding(v: Array, h: float, processing: Processing) -> NDArray[np.bool_]:
    """Samples (T,) in which a joint moves and is not about to reverse, nor has just done so."""
    margin = _STICKING
    if processing.position_cutoff is not None:
        margin = max(margin, _SMEARED / processing.position_cutoff)
    crossing = np.zeros(v.shape, dtype=np.uint8)
    crossing[1:] = np.signbit(v[1:]) != np.signbit(v[:-1])
    half = round(margin / h)
    near = maximum_filter1d(crossing, 2 * half + 1) > 0
    return ~near & (np.abs(v) > processing.moving_speed)


def _smooth(x: Array, cutoff: float | None, fs: float, name: str) -> Array:
    if cutoff is None:
        return x
    if cutoff > _HIGHEST_GIVEN * fs:  # set by hand for another rate
        raise FileError(
            f"run '{name}' was recorded at {fs:.4g} Hz: too slow for the cut-off of the positions, "
            f"{cutoff:.3g} Hz. Record all runs at one rate, or lower measurement.filter.position."
        )
    from scipy.signal import butter, sosfiltfilt  # takes a second to import

    sections = butter(4, cutoff, fs=fs, output="sos")
    pad = min(int(3 * fs / cutoff), len(x) - 2)
    if pad < 10:
        raise FileError(f"run '{name}' has only {len(x)} samples: too short for any filter.")
    return np.asarray(sosfiltfilt(sections, x, axis=0, padlen=pad))
