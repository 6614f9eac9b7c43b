"""Errors on held-out data of the model with any of the effects that were found, and their parts.

The error of a joint where it moves is e(S) = RMS(τ − τ_S) / RMS(τ) of the model with the effects S,
fitted anew to the training data. It is quadratic in the fitted parameters, so it needs no samples:
Gram matrices of the held-out columns (at the final model) and torque. What these do not hold at the
ends, columns that look at the model's own torque, joins in equal steps; so e(∅) and e(all) are the
errors that are reported, to rounding.

Where the URDF's inertias are kept within their uncertainty, the way begins at the URDF untouched,
and their fit is one of those who join: they take up much of what an effect holds.

Joining the model in one order, each effect takes off e(S) − e(S ∪ i); what it takes off depends on
who came before. So its part is the mean over many orders (Shapley 1953), drawn with a fixed seed,
in which what an effect refines joins before it. In every order the steps add up to e(∅) − e(all),
and so do the parts.

The models on the way have the weights of the last one. So they need no fit of their own: with the
columns of N x = h in the order of joining and N = L Lᵀ, the model of the first s of them is
L_sᵀ x_s = (L⁻¹ h)_s, where L_s is the first (s, s) of L.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from excite_cli.diagnosis.schur import RIDGE
from excite_cli.diagnosis.search_result import SearchResult
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.identification.averages import apply
from excite_cli.identification.errors_of_torque import FEWEST, Errors
from excite_cli.identification.identified_model import (
    IdentifiedModel,
    Prediction,
    as_described,
    errors_on,
)
from excite_cli.identification.prepare import PreparedRun
from excite_cli.identification.regression import (
    effect_columns,
    places_of,
    seen_of,
    width_of,
    with_effects,
)
from excite_cli.identification.torque_trace import TorqueTrace, torque_trace
from excite_cli.robot.model import Array, Robot
from excite_cli.workers.base import Tell
from excite_cli.workers.context import each

# The declared model and that with the effects that were found, on runs: errors and traces.


@dataclass(frozen=True)
class HeldOutRuns:
    """Runs that models are tried on."""

    robot: Robot
    runs: Sequence[PreparedRun]

    def predictions(self, fitted: IdentifiedModel) -> list[Prediction]:
        """What a model says of every run."""
        return list(each(_predicted, (self.robot, fitted), self.runs))

    @property
    def by_urdf(self) -> Sequence[Prediction]:
        """What the URDF says as given, with the friction of its <dynamics>; none without masses."""
        described = as_described(self.robot)
        return () if described is None else self.predictions(described)

    def errors(self, predictions: Sequence[Prediction]) -> Errors:
        """Errors of predictions for all runs."""
        return errors_on(self.robot, self.runs, predictions)

    def traces(
        self, before: Sequence[Prediction], after: Sequence[Prediction], held_out: bool
    ) -> tuple[TorqueTrace, ...]:
        """Torque over time, measured and by both predictions."""
        return tuple(
            torque_trace(run, new.load, new.torque, old.torque, held_out)
            for run, old, new in zip(self.runs, before, after, strict=True)
        )


def _predicted(shared: tuple[Robot, IdentifiedModel], run: PreparedRun, tell: Tell) -> Prediction:
    robot, fitted = shared
    return fitted.predicted(robot, run)


def both_models(traced: SearchResult, parameters: Array) -> tuple[IdentifiedModel, IdentifiedModel]:
    """The declared model fitted to the training data, and the one with `parameters`."""
    found = _fitted(traced, traced.chosen, parameters)
    return refitted(traced, ()) if traced.chosen else found, found


def refitted(traced: SearchResult, chosen: Sequence[int]) -> IdentifiedModel:
    """The model with these of the candidates, fitted to the training data."""
    return _fitted(traced, chosen, traced.fitted(chosen))


def _fitted(traced: SearchResult, chosen: Sequence[int], parameters: Array) -> IdentifiedModel:
    model = traced.model
    effects = (*model.declared, *(traced.candidates[i].effect for i in chosen))
    values = parameters[len(parameters) - width_of(effects) :]
    return IdentifiedModel(model.full_inertias(parameters), effects, values)


INERTIAS = -1  # their fit, among those who join
_SEED = 20251123
# Parts of a Go2's 47 effects then differ by 0.2 % of a joint's torque from seed to seed (standard
# deviation), without reverse orders by 3.2 %.
_ORDERS = 100


def held_out_errors(
    played: HeldOutRuns,
    traced: SearchResult,
    after: IdentifiedModel,
    first: Sequence[Prediction],
    last: Sequence[Prediction],
    from_urdf: bool,
) -> "HeldOutErrors":
    """Errors on the held-out runs `played`.

    `first` are the predictions at the beginning of the way, `last` those of the model `after`.
    Where the first are the untouched URDF's (`from_urdf`), `INERTIAS` joins.
    """
    fit = _Fit(traced, from_urdf)
    return HeldOutErrors(fit, _grams(played, fit, after, first, last))


class _Fit:
    """Fits of models with any of those `who` join, to the training data."""

    def __init__(self, traced: SearchResult, from_urdf: bool) -> None:
        model, chosen = traced.model, sorted(traced.chosen)
        found = [traced.candidates[i].effect for i in chosen]
        self.traced = traced
        self.who = (*([INERTIAS] if from_urdf else []), *chosen)
        self.effects = (*model.declared, *found)
        self._held = model.by_urdf if from_urdf else np.zeros(0)
        fixed = traced.data.declared[0].shape[2]
        self._count = fixed + width_of(found)
        places = places_of(found, self._count)
        self._at = {INERTIAS: slice(0, len(self._held)), **dict(zip(chosen, places, strict=True))}
        self._always = slice(len(self._held), fixed)

    def first(self) -> Array:
        """All parameters (k,) before anybody joins: the URDF's of kept inertias, no effects."""
        values = self.traced.fitted((), self._held)
        return np.append(values, np.zeros(self._count - len(values)))

    def last(self) -> Array:
        """All parameters (k,) once everybody has joined."""
        return self.traced.fitted(sorted(self.traced.chosen))

    @cached_property
    def _products(self) -> tuple[Array, Array, Array, Array]:
        """Parameters (k,) of who has not joined; N and h of what they lack, of unit columns.

        The norms (k,) of these as they are.
        """
        usual = np.append(self._held, np.zeros(self._count - len(self._held)))
        gram = self.traced.products()
        norms = np.sqrt(np.maximum(np.diag(gram)[:-1], 1e-200))
        normal = gram[:-1, :-1] / np.outer(norms, norms)
        normal[np.diag_indices(len(normal))] += RIDGE
        return usual, normal, (gram[:-1, -1] - gram[:-1, :-1] @ usual) / norms, norms

    def between(self, order: Sequence[int]) -> Array:
        """All parameters (m − 1, k) once the first, the first two … of an order have joined."""
        usual, normal, side, norms = self._products
        at = np.r_[self._always, *(self._at[i] for i in order)]
        ends = np.cumsum([len(np.r_[self._at[i]]) for i in order])[:-1] + len(np.r_[self._always])
        factor = cholesky(normal[at[:, None], at], lower=True)
        forward = solve_triangular(factor, side[at], lower=True)
        found = np.repeat(usual[None], len(ends), axis=0)
        for row, end in zip(found, ends, strict=True):
            solved = solve_triangular(factor[:end, :end], forward[:end], lower=True, trans=1)
            row[at[:end]] += solved / norms[at[:end]]
        return found


class HeldOutErrors:
    """Errors of models with any of those `who` join: chosen candidates, and `INERTIAS` if kept.

    Of every joint a Gram matrix, or none. Its columns: those of all parameters, candidates in
    ascending order; what the fit lacks of the reported prediction, first and last; the torque.
    """

    def __init__(self, fit: _Fit, grams: Sequence[Array | None]) -> None:
        self._fit, self._grams = fit, grams
        self.who, self.joints = fit.who, len(grams)
        self._ends = fit.first(), fit.last()

    def along(self, order: Sequence[int]) -> Array:
        """Relative errors (m + 1, n) where joints move, of the model as they join in an order."""
        first, last = self._ends
        values = np.vstack([first, self._fit.between(order), last] if order else [first])
        share = np.arange(len(values))[:, None] / max(len(order), 1)
        weights = np.hstack([-values, share - 1.0, -share, np.ones_like(share)])
        return np.column_stack([_errors(gram, weights) for gram in self._grams])


def _errors(gram: Array | None, weights: Array) -> Array:
    """Of models of some weights (m, k)."""
    if gram is None:
        return np.full(len(weights), np.nan)
    squares = np.sum(weights @ gram * weights, axis=1)
    return np.asarray(np.sqrt(np.maximum(squares, 0.0) / gram[-1, -1]))


def _grams(
    played: HeldOutRuns,
    fit: _Fit,
    after: IdentifiedModel,
    first: Sequence[Prediction],
    last: Sequence[Prediction],
) -> list[Array | None]:
    """Per joint, of the held-out samples in motion; None where there are too few."""
    model = fit.traced.model
    solved = [fit.first(), fit.last()]
    width = len(solved[0]) + len(solved) + 1
    sums = np.zeros((model.robot.n, width, width))
    counts = np.zeros(model.robot.n, dtype=int)
    for run, *told in zip(played.runs, first, last, strict=True):
        body = RigidBody(model.robot, after.phi, run.q, run.v, run.a)
        signals = with_effects(seen_of(run, body), after.effects, after.values)
        inertial = body.regressor[:, :, model.base.selection]
        own = effect_columns(fit.effects, signals)
        torques = [run.averaged_torque(each.torque) for each in told]
        for j in range(model.robot.n):
            kept = run.valid[:, j] & run.moving[:, j]
            of_inertias = apply(run.valid_averages[j], inertial[:, j])[kept]
            columns = np.hstack([of_inertias, apply(run.valid_averages[j], own[:, j])[kept]])
            lacks = [
                torque[kept, j] - columns @ x for torque, x in zip(torques, solved, strict=True)
            ]
            rows = np.column_stack([columns, *lacks, run.tau[kept, j]])
            sums[j] += rows.T @ rows
            counts[j] += len(rows)
    return [
        gram if count >= FEWEST and gram[-1, -1] > 0.0 else None
        for gram, count in zip(sums, counts, strict=True)
    ]


def error_parts(traced: SearchResult, errors: HeldOutErrors) -> dict[int, Array]:
    """Per who joins, what it takes off the relative error of each joint (n,) where it moves.

    `errors` of the held-out data. NaN for joints that hardly move there.
    """
    parts = {i: np.zeros(errors.joints) for i in errors.who}
    orders = list(_orders(traced, errors.who))
    for order in orders:
        for i, taken_off in zip(order, -np.diff(errors.along(order), axis=0), strict=True):
            parts[i] += taken_off / len(orders)
    return parts


def _orders(traced: SearchResult, who: Sequence[int]) -> Iterator[list[int]]:
    """Orders in which what is refined comes first; each drawn with its reverse."""
    rng = np.random.default_rng(_SEED)
    parents = {i: set(traced.judge.parents[i]) if i >= 0 else set() for i in who}
    drawn = [rng.permutation(who).tolist() for _ in range(_ORDERS // 2)]
    for drawn_order in (*drawn, *(order[::-1] for order in drawn)):
        waiting, order = list(drawn_order), []
        while waiting:
            # Kinds may refine each other: then the first comes first.
            ready = next((i for i in waiting if not parents[i] & set(waiting)), waiting[0])
            waiting.remove(ready)
            order.append(ready)
        yield order
