"""Torque over time, measured and predicted, kept with a result so that it can be shown later.

The torque is the filtered one, which holds nothing above the filter's cut-off: of long runs every
k-th sample is kept, the same ones of every quantity. Numbers are rounded to single precision.
"""

from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np

from excite_cli.fields import shape
from excite_cli.identification.factors import Mask
from excite_cli.identification.prepare import PreparedRun
from excite_cli.robot.model import Array, Robot

_Sampled = Annotated[Array, shape("m", "n")]

MOST_SAMPLES = 1500  # per part of a run


@dataclass(frozen=True)
class TorqueTrace:
    """One run, or a part of it; all but `t` (m,) are (m, n).

    `t` from the start of the run [s]; `q, v, a`; `load` rigid-body torque of the model; `measured`
    torque, NaN where it must not be used; `counted` where a fit may use it (the joint neither
    stands nor reverses); `predicted` torque of the model, `before` that of the model before effects
    were added, if any were looked for. `held_out`: took no part in the fit.
    """

    run: str
    held_out: bool
    t: Annotated[Array, shape("m", finite=True)]
    q: _Sampled
    v: _Sampled
    a: _Sampled
    load: _Sampled
    measured: _Sampled
    counted: Annotated[Mask, shape("m", "n")]
    predicted: _Sampled
    before: _Sampled | None = None


def torque_trace(
    run: PreparedRun,
    load: Array,
    predicted: Array,
    before: Array | None = None,
    held_out: bool = False,
    whole: bool = False,
) -> TorqueTrace:
    """The trace of a prepared run; `load`, `predicted`, `before` (T, n) at the working rate.

    `thinned`, unless all of it is wanted.
    """
    stacked = run.averaged(np.concatenate([run.t[:, None], run.q, run.v, run.a], axis=1))
    motion = np.split(stacked[:, 1:], 3, axis=1)
    trace = TorqueTrace(
        run=run.run.key,
        held_out=held_out,
        t=stacked[:, 0],
        q=motion[0],
        v=motion[1],
        a=motion[2],
        load=run.averaged_torque(load),
        measured=np.where(run.valid, run.tau, np.nan),
        counted=run.usable & run.valid,
        predicted=run.averaged_torque(predicted),
        before=None if before is None else run.averaged_torque(before),
    )
    return trace if whole else thinned(trace)


def thinned(trace: TorqueTrace) -> TorqueTrace:
    """At most `MOST_SAMPLES` samples, evenly taken, in single precision."""
    every = slice(None, None, max(1, -(-len(trace.t) // MOST_SAMPLES)))
    names = ("t", "q", "v", "a", "load", "measured", "predicted")
    kept: dict[str, Any] = {name: single(getattr(trace, name)[every]) for name in names}
    before = None if trace.before is None else single(trace.before[every])
    return replace(trace, **kept, counted=trace.counted[every], before=before)


def single(x: Array) -> Array:
    """Rounded to single precision, as it is stored."""
    return np.asarray(x, dtype=np.float32).astype(float)


def torque_units(robot: Robot) -> tuple[str, ...]:
    """`N·m` or `N` of every moved joint."""
    return tuple("N" if sliding else "N·m" for sliding in robot.sliding)
