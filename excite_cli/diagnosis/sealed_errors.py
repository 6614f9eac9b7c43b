"""Errors on sealed data of the model with any of the effects that were found.

The error of a joint where it moves is e(S) = RMS(τ − τ_S) / RMS(τ) of the model with the effects S,
fitted anew to the training data. It is quadratic in the fitted parameters, so it needs no samples:
Gram matrices of the sealed columns (at the final model) and torque. What these do not hold at the
ends, columns that look at the model's own torque, joins in equal steps; so e(∅) and e(all) are the
errors that are reported, to rounding.

Where the URDF's inertias are kept within their uncertainty, the way begins at the URDF untouched,
and their fit is one of those who join: they take up much of what an effect holds.
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.diagnosis.before_after import Played
from excite_cli.diagnosis.declared_model import Model
from excite_cli.diagnosis.tracing import Traced
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.identification.averages import apply
from excite_cli.identification.errors_of_torque import FEWEST
from excite_cli.identification.identified_model import IdentifiedModel, Prediction
from excite_cli.identification.regression import effect_columns, seen_of, with_effects
from excite_cli.robot.model import Array

INERTIAS = -1  # their fit, among those who join


def sealed_errors(
    played: Played,
    model: Model,
    traced: Traced,
    after: IdentifiedModel,
    first: Sequence[Prediction],
    last: Sequence[Prediction],
    from_urdf: bool,
) -> "SealedErrors":
    """Errors on the sealed runs `played`.

    `first` are the predictions at the beginning of the way, `last` those of the model `after`.
    Where the first are the untouched URDF's (`from_urdf`), `INERTIAS` joins.
    """
    fit = _Fit(model, traced, from_urdf)
    return SealedErrors(fit, _grams(played, model, fit, after, first, last))


class _Fit:
    """Fits of models with any of those `who` join, to the training data."""

    def __init__(self, model: Model, traced: Traced, from_urdf: bool) -> None:
        self._traced = traced
        self._held = model.by_urdf if from_urdf else np.zeros(0)
        chosen = sorted(traced.chosen)
        self.who = (*([INERTIAS] if from_urdf else []), *chosen)
        self.effects = (*model.declared, *(traced.candidates[i].effect for i in chosen))
        fixed = traced.data.declared[0].shape[2]
        ends = fixed + np.cumsum([0, *(traced.candidates[i].width for i in chosen)])
        self._at = {i: np.arange(*ends[k : k + 2]) for k, i in enumerate(chosen)}
        self._fixed, self._count = fixed, int(ends[-1])

    def parameters(self, joined: tuple[int, ...]) -> Array:
        """All parameters (k,); zero of effects that did not join, the URDF's of kept inertias.

        Of the first and the last of all as they are told; of those between, roughly.
        """
        roughly = joined not in ((), self.who)
        chosen = tuple(i for i in joined if i != INERTIAS)
        at = [np.arange(self._fixed), *(self._at[i] for i in chosen)]
        found = np.zeros(self._count)
        held = np.zeros(0) if INERTIAS in joined else self._held
        found[np.concatenate(at).astype(np.intp)] = self._traced.fitted(chosen, held, roughly)
        return found


def _error(gram: Array | None, weights: Array) -> float:
    if gram is None:
        return float("nan")
    return float(np.sqrt(max(float(weights @ gram @ weights), 0.0) / gram[-1, -1]))


class SealedErrors:
    """Errors of models with any of those `who` join: chosen candidates, and `INERTIAS` if kept.

    Of every joint a Gram matrix, or none. Its columns: those of all parameters, candidates in
    ascending order; what the fit lacks of the reported prediction, first and last; the torque.
    """

    def __init__(self, fit: _Fit, grams: Sequence[Array | None]) -> None:
        self._fit, self._grams = fit, grams
        self.who, self.joints = fit.who, len(grams)
        self._known: dict[tuple[int, ...], Array] = {}

    def of(self, joined: tuple[int, ...]) -> Array:
        """Relative errors (n,) where joints move, of the model with some, in ascending order."""
        if joined not in self._known:
            share = len(joined) / max(len(self._fit.who), 1)
            weights = np.array([*-self._fit.parameters(joined), share - 1.0, -share, 1.0])
            self._known[joined] = np.array([_error(gram, weights) for gram in self._grams])
        return self._known[joined]


def _grams(
    played: Played,
    model: Model,
    fit: _Fit,
    after: IdentifiedModel,
    first: Sequence[Prediction],
    last: Sequence[Prediction],
) -> list[Array | None]:
    """Per joint, of the sealed samples in motion; None where there are too few."""
    n = model.robot.n
    solved = [fit.parameters(each) for each in ((), fit.who)]
    sums: list[Array | None] = [None] * n
    counts = np.zeros(n, dtype=int)
    for run, *told in zip(played.runs, first, last, strict=True):
        body = RigidBody(model.robot, after.phi, run.q, run.v, run.a)
        signals = with_effects(seen_of(run, body), after.effects, after.values)
        inertial = body.regressor[:, :, model.base.selection]
        own = effect_columns(fit.effects, signals)
        torques = [run.averaged_torque(each.torque) for each in told]
        for j in range(n):
            kept = run.valid[:, j] & run.moving[:, j]
            of_inertias = apply(run.valid_averages[j], inertial[:, j])[kept]
            columns = np.hstack([of_inertias, apply(run.valid_averages[j], own[:, j])[kept]])
            lacks = [
                torque[kept, j] - columns @ x for torque, x in zip(torques, solved, strict=True)
            ]
            rows = np.column_stack([columns, *lacks, run.tau[kept, j]])
            own_sum, counts[j] = sums[j], counts[j] + len(rows)
            sums[j] = rows.T @ rows if own_sum is None else own_sum + rows.T @ rows
    return [
        gram if gram is not None and count >= FEWEST and gram[-1, -1] > 0.0 else None
        for gram, count in zip(sums, counts, strict=True)
    ]
