"""The evidence for an effect: the torque that everything else leaves, and the effect's own.

For effect e with columns C_e and fitted values θ_e, and r what the whole model leaves of the
training torque, the partial residual is p = r + C_e θ_e. If the effect is there, p follows C_e θ_e
over the quantity that the effect is a function of; if it is not, p is noise about zero.
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.diagnosis.traces import EffectTrace
from excite_cli.diagnosis.tracing import Traced
from excite_cli.effects.base import Effect
from excite_cli.identification.torque_trace import single
from excite_cli.robot.model import Array

_MOST_SAMPLES = 3000
_MOST_ROWS = 3
_WORTH_A_LOOK = 0.05  # of what the effect explains, in units of the noise


def effect_traces(
    traced: Traced, parameters: Array, joint_names: Sequence[str]
) -> tuple[EffectTrace, ...]:
    """The traces of all effects that were found, with fitted `parameters` of the whole model."""
    left = traced.data.residuals(traced.candidates, traced.chosen, parameters)
    start = len(parameters) - sum(traced.candidates[i].width for i in traced.chosen)
    own = _own_torque(traced, parameters, start)
    return tuple(_trace(traced, i, own[i], left, joint_names) for i in traced.chosen)


def _own_torque(traced: Traced, parameters: Array, start: int) -> dict[int, list[Array]]:
    """Torque (M, rows) of every effect and part: its columns times its own parameters."""
    own, at = {}, start
    for i in traced.chosen:
        values = parameters[at : at + traced.candidates[i].width]
        own[i] = [block @ values for block in traced.candidates[i].columns]
        at += len(values)
    return own


def _trace(
    traced: Traced, i: int, torque: Sequence[Array], left: Sequence[Array], names: Sequence[str]
) -> EffectTrace:
    candidate = traced.candidates[i]
    effect = candidate.effect
    parts = [k for k, s in enumerate(traced.signals) if effect.active(s.run)]
    rows = _strongest_rows(traced, i, torque, parts)
    joints = [candidate.rows[row] for row in rows]
    runs = traced.data.runs
    usable = [runs[k].usable[:, joints] for k in parts]
    own = [torque[k][:, rows] for k in parts]
    times = [runs[k].averaged(runs[k].t) for k in parts]
    part = [np.full(len(t), float(k)) for k, t in zip(parts, times, strict=True)]
    quantity, unit, period, x = _abscissae(traced, effect, parts, joints)
    seen = np.concatenate(usable)
    kept = np.flatnonzero(seen.any(axis=1))
    kept = kept[:: max(1, -(-len(kept) // _MOST_SAMPLES))]

    def picked(series: Sequence[Array]) -> Array:
        return single(np.concatenate(series)[kept])

    def masked(series: Array) -> Array:
        return np.where(seen[kept], series, np.nan)

    over = picked(x or own)
    if period is not None:
        over = single(np.mod(over, period))
    partial = [left[k][:, joints] + mine for k, mine in zip(parts, own, strict=True)]
    return EffectTrace(
        kind=effect.kind,
        joints=tuple(names[j] for j in effect.joints),
        runs=effect.runs,
        rows=tuple(names[j] for j in joints),
        quantity=quantity,
        unit=unit,
        period=period,
        part=picked(part),
        t=picked(times),
        x=masked(over),
        own=masked(picked(own)),
        partial=masked(picked(partial)),
        covariate=effect.covariate,
    )


def _abscissae(
    traced: Traced, effect: Effect, parts: Sequence[int], joints: Sequence[int]
) -> tuple[str, str, float | None, list[Array]]:
    """Name, unit, period and values (M, rows) of each part; no values for the torque itself."""
    found = [effect.abscissa(traced.signals[k]) for k in parts]
    if not found or any(each is None for each in found):
        return "", "", None, []
    first = found[0]
    assert first is not None
    values = [
        traced.data.runs[k].averaged_for_fit(
            np.repeat(each.values[:, None], len(joints), axis=1), joints
        )
        for k, each in zip(parts, found, strict=True)
        if each is not None
    ]
    return first.name, first.unit, first.period, values


def _strongest_rows(
    traced: Traced, i: int, torque: Sequence[Array], parts: Sequence[int]
) -> list[int]:
    """Rows of candidate i with most of its torque in units of the noise, the strongest first."""
    candidate = traced.candidates[i]
    energy = np.zeros(len(candidate.rows))
    for k in parts:
        usable = traced.data.runs[k].usable[:, list(candidate.rows)]
        own = np.where(usable, torque[k], 0.0)
        energy += np.sum(own**2, axis=0)
    energy /= np.square(traced.levels[list(candidate.rows)])
    order = np.argsort(-energy, kind="stable")[:_MOST_ROWS]
    worth = [int(row) for row in order if energy[row] >= _WORTH_A_LOOK * energy.sum()]
    return worth or [int(order[0])]
