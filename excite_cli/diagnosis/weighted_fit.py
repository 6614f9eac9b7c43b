"""Weighted least squares of models of some candidates, each joint weighed by what it leaves itself.

As in `identify`: x minimises Σ_j ‖τ_j − C_j x‖² / σ_j² and what the prior says, and
σ_j² = ‖τ_j − C_j x‖² / (N_j − p N_j / N), in turn until they settle. Of N_j rows of a joint and
p parameters; from Gram matrices of the rows as they are.

Where the data do not reach, the textbook's model has the word. What was found beyond it is seen in
the states of the recordings alone, and a model with more parameters says the more of other states
the less is known of them. So the fit has imagined samples beside the recorded ones,
`rules.IMAGINED` N_j of each joint, along the usual motion, with the torque C' x_b that the
textbook's model, fitted to the same data, says there, and as uncertain as what that leaves of the
data, σ_bj: Σ_j IMAGINED N_j mean_t (c'_jᵀ (x − x_b))² / σ_bj² more to minimise. Nothing is imagined
for a part of the textbook's model.

Where data say what x is, they have the word: what is imagined may leave no joint's data with more
than 2 % of error above what they are left with on their own, and else weighs a tenth, and so on.
"""

from collections.abc import Collection, Sequence

import numpy as np

from excite_cli.arrays import Array, Indices
from excite_cli.diagnosis import rules
from excite_cli.diagnosis.noise_model import NoiseModel
from excite_cli.diagnosis.schur import RIDGE, Cholesky
from excite_cli.diagnosis.training import Columns, TrainingData
from excite_cli.identification.least_squares import AT_FIRST, EXACT

_ROUNDS, _SETTLED = 30, 1e-6
_WEIGHTS = (1.0, 0.1, 0.01, 1e-3)
_ROUNDING = 1e-14  # of the largest eigenvalue


class WeightedFit:
    """Fits models with some of the candidates.

    `usual` (n, k, k): mean products of all columns along the usual motion. The `plain` candidates
    are the textbook's. Without them nothing is imagined.
    """

    def __init__(
        self,
        data: TrainingData,
        candidates: Sequence[Columns],
        usual: Array | None = None,
        plain: Collection[int] = (),
    ) -> None:
        self._counts = sum(run.usable.sum(axis=0) for run in data.runs)
        found = data.evidence(candidates, NoiseModel.white(np.ones(data.n)))
        self._evidence = found
        self._grams = [(joint.active, joint.blocks.sum(axis=0)) for joint in found.grams.joints]
        self._prior = np.zeros((found.torque + 1,) * 2)
        if data.prior is not None:
            known = np.append(np.arange(found.fixed), found.torque)
            self._prior[np.ix_(known, known)] = data.prior
        whole = np.array([gram[-1, -1] for _, gram in self._grams])
        self._floor = np.maximum(EXACT * np.sqrt(whole / np.maximum(self._counts, 1)), 1e-12)
        self._usual, self._plain = usual, frozenset(plain)
        self._kept: dict[bytes, Array] = {}

    def __call__(
        self,
        chosen: Sequence[int],
        held: Array | None = None,
        near: Array | None = None,
    ) -> tuple[Array, Array]:
        """Parameters x (k,) of the model and σ (n,); the first ones are those that are `held`.

        With weights `near` (n,) these are σ.
        """
        held = np.zeros(0) if held is None else held
        _, x, sigma = self._fitted(chosen, held, near)
        return np.concatenate([held, x]), sigma

    def _fitted(
        self, chosen: Sequence[int], held: Array, near: Array | None
    ) -> tuple[float, Array, Array]:
        """The weight of what is imagined, beside `rules.IMAGINED`, free parameters and σ."""
        imagined = self._imagined(chosen, held)
        alone, of_alone, least = self._solution(chosen, held, near, self._prior)
        for weight in _WEIGHTS if imagined.any() else ():
            x, sigma, left = self._solution(chosen, held, near, self._prior + weight * imagined)
            if (left <= rules.AS_GOOD * least).all():
                return weight, x, sigma
        return 0.0, alone, of_alone

    def _solution(
        self, chosen: Sequence[int], held: Array, near: Array | None, known: Array
    ) -> tuple[Array, Array, Array]:
        """Free parameters, σ (n,), and the RMS (n,) that is left of the data."""
        columns = self._evidence.columns(chosen)[len(held) :]
        count = len(columns)
        at = np.concatenate([columns, np.arange(len(held)), [self._evidence.torque]])
        prior = _less(known[np.ix_(at, at)], count, held)
        where = np.full(self._evidence.torque, -1)
        where[columns] = np.arange(count)
        own = []  # of each joint, where its columns are in the model, and their products
        for active, gram in self._grams:
            there = np.flatnonzero(where[active] >= 0)
            rows = np.concatenate([there, np.arange(len(held)), [len(active)]])
            rest = _less(gram[np.ix_(rows, rows)], len(there), held)
            own.append((np.append(where[active[there]], count), rest))
        share = 1.0 - count / max(float(np.sum(self._counts)), 1.0)
        freedom = np.maximum(self._counts * share, 1.0)
        sigma = AT_FIRST / EXACT * self._floor if near is None else near
        x = _solved(prior, own, sigma)
        for _ in range(_ROUNDS if near is None else 0):
            now = self._left(x, own, freedom)
            settled = np.abs(now - sigma).max() <= _SETTLED * now.max()
            sigma, x = now, _solved(prior, own, now)
            if settled:
                break
        return x, sigma, self._left(x, own, freedom)

    def _left(self, x: Array, own: Sequence[tuple[Indices, Array]], freedom: Array) -> Array:
        """RMS (n,) of what parameters leave of the data."""
        both = np.append(-x, 1.0)
        squares = np.array([both[at] @ gram @ both[at] for at, gram in own])
        return np.maximum(np.sqrt(np.maximum(squares, 0.0) / freedom), self._floor)

    def products(self, chosen: Sequence[int]) -> Array:
        """Products (k + 1, k + 1), the torque's last, of all that a model's parameters minimise."""
        weight, _, sigma = self._fitted(chosen, np.zeros(0), None)
        found = self._prior + weight * self._imagined(chosen, np.zeros(0))
        for (active, gram), each in zip(self._grams, sigma, strict=True):
            there = np.append(active, self._evidence.torque)
            found[np.ix_(there, there)] += gram / each**2
        at = np.append(self._evidence.columns(chosen), self._evidence.torque)
        return np.asarray(found[np.ix_(at, at)])

    def imagined(self, chosen: Sequence[int]) -> tuple[Array, Array]:
        """Rows A (m, k) and b (m,) of unit variance: A x = b of what is imagined for a model."""
        columns = self._evidence.columns(chosen)
        if self._usual is None or self._plain.issuperset(chosen):
            return np.zeros((0, len(columns))), np.zeros(0)
        at = np.append(columns, self._evidence.torque)
        weight, *_ = self._fitted(chosen, np.zeros(0), None)
        if weight == 0.0:
            return np.zeros((0, len(columns))), np.zeros(0)
        gram = weight * self._imagined(chosen, np.zeros(0))[np.ix_(at, at)]
        norms = np.sqrt(np.diag(gram)[:-1])
        norms[norms == 0.0] = 1.0
        values, vectors = np.linalg.eigh(gram[:-1, :-1] / np.outer(norms, norms))
        there = values > _ROUNDING * values[-1]
        halves = np.sqrt(values[there])
        # of P x = h: rows are the half of P, and what they say is the rest of h
        said = vectors[:, there].T @ (gram[:-1, -1] / norms) / halves
        # What the data do not have at all, no rounding of an imagined motion tells.
        norms[np.diag(self._evidence.total)[columns] == 0.0] = 0.0
        return halves[:, None] * vectors[:, there].T * norms, said

    def _imagined(self, chosen: Sequence[int], held: Array) -> Array:
        """Products (k + 1, k + 1) of what is imagined, all columns and the torque."""
        size = self._evidence.torque
        if self._usual is None or self._plain.issuperset(chosen):
            return np.zeros((size + 1, size + 1))
        key = held.tobytes()
        if key not in self._kept:
            plain = sorted(self._plain)
            own, sigma = self(plain, held)
            weights = rules.IMAGINED * self._counts / np.square(sigma)
            x = np.zeros(size)
            x[self._evidence.columns(plain)] = own
            normal = np.einsum("j,jpq->pq", weights, self._usual)
            side = normal @ x
            found = np.zeros((size + 1, size + 1))
            found[:-1, :-1], found[:-1, -1], found[-1, :-1] = normal, side, side
            found[-1, -1] = x @ side
            self._kept[key] = found
        return self._kept[key]


def _less(gram: Array, free: int, held: Array) -> Array:
    """Products of `free` columns and of the torque less what the others, `held`, give of it."""
    change = np.zeros((len(gram), free + 1))
    change[:free, :free] = np.eye(free)
    change[free:, -1] = np.append(-held, 1.0)
    return np.asarray(change.T @ gram @ change) if len(held) else gram


def _solved(prior: Array, own: Sequence[tuple[Indices, Array]], sigma: Array) -> Array:
    """The least-squares solution, joints weighed by `sigma`."""
    if len(prior) == 1:  # the torque's column alone
        return np.zeros(0)
    total = prior.copy()
    for (at, gram), each in zip(own, sigma, strict=True):
        total[np.ix_(at, at)] += gram / each**2
    norms = np.sqrt(np.maximum(np.diag(total)[:-1], 1e-200))
    normal = total[:-1, :-1] / np.outer(norms, norms)
    normal[np.diag_indices(len(norms))] += RIDGE
    return Cholesky(normal).solve(total[:-1, -1] / norms) / norms
