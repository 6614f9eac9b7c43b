"""The evidence for an effect: the torque that everything else leaves, and the effect's own.

For effect e with columns C_e and fitted values θ_e, and r what the whole model leaves of the
training torque, the partial residual is p = r + C_e θ_e. If the effect is there, p follows C_e θ_e
over the quantity that the effect is a function of; if it is not, p is noise about zero.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.search_result import SearchResult
from excite_cli.diagnosis.traces import EffectTrace
from excite_cli.effects.base import Effect
from excite_cli.identification.regression import places_of
from excite_cli.identification.torque_trace import single
from excite_cli.robot.model import Array

_MOST_SAMPLES = 3000
_MOST_ROWS = 3
_WORTH_A_LOOK = 0.05  # of what the effect explains, in units of the noise


def effect_traces(traced: SearchResult, parameters: Array) -> tuple[EffectTrace, ...]:
    """The traces of all effects that were found, with fitted `parameters` of the whole model."""
    left = traced.data.residuals(traced.candidates, traced.chosen, parameters)
    places = places_of(traced.effects, len(parameters))
    return tuple(
        _trace(traced, traced.candidates[i], parameters[own], left)
        for i, own in zip(traced.chosen, places, strict=True)
    )


def _trace(
    traced: SearchResult, candidate: Candidate, values: Array, left: Sequence[Array]
) -> EffectTrace:
    effect, names = candidate.effect, traced.model.robot.joint_names
    parts = [k for k, s in enumerate(traced.signals) if effect.active(s.run)]
    torque = {k: candidate.columns[k] @ values for k in parts}
    rows = _strongest_rows(traced, candidate, torque)
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
    traced: SearchResult, effect: Effect, parts: Sequence[int], joints: Sequence[int]
) -> tuple[str, str, float | None, list[Array]]:
    """Name, unit, period and values (M, rows) of each part; no values for the torque itself."""
    first, values = None, []
    for k in parts:
        first = effect.abscissa(traced.signals[k])
        if first is None:
            return "", "", None, []
        repeated = np.repeat(first.values[:, None], len(joints), axis=1)
        values.append(traced.data.runs[k].averaged_for_fit(repeated, joints))
    return (first.name, first.unit, first.period, values) if first else ("", "", None, [])


def _strongest_rows(
    traced: SearchResult, candidate: Candidate, torque: Mapping[int, Array]
) -> list[int]:
    """Its rows with most of its `torque` per part, in units of the noise, the strongest first."""
    joints = list(candidate.rows)
    energy = np.zeros(len(joints))
    for k, own in torque.items():
        energy += np.square(np.where(traced.data.runs[k].usable[:, joints], own, 0.0)).sum(axis=0)
    energy /= np.square(traced.levels[joints])
    order = np.argsort(-energy, kind="stable")[:_MOST_ROWS]
    worth = [int(row) for row in order if energy[row] >= _WORTH_A_LOOK * energy.sum()]
    return worth or [int(order[0])]
