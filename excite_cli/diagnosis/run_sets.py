"""In which runs an effect of single runs is: the few sets of runs that explain most.

With G_r and y_r the Gram matrix of the effect's columns in run r and their product with the
residual there, values of their own in the runs S and outside of it explain

    E(S) = y_SᵀG_S⁻¹y_S + y_NᵀG_N⁻¹y_N − yᵀG⁻¹y,    G_S = Σ_{r∈S} G_r,  N the runs not in S,

more than one value in all of them, which is what the robot's own parameters take up. Sets that are
looked at: single runs, all runs from one on, and the clusters of what each run says alone; their
number, and that of the candidates, grows linearly with the runs, or not at all.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.cluster.hierarchy import linkage

from excite_cli.arrays import Mask
from excite_cli.robot.model import Array

MOST = 6  # sets that become candidates
_LEAST = 25.0  # what a set must explain, in units of the squared median of what is left
# Of a climb; among a thousand runs of noise it would go on for hundreds, to no end.
_MOST_STEPS = 60
_RIDGE = 1e-9
_CLIMBS = 3  # best sets that are improved run by run


@dataclass(frozen=True)
class RunEvidence:
    """`grams` (R, p, p) of an effect's columns and `cross` (R, p) with the residual, by run.

    `positive`: its first value cannot be negative, so that of a set and all other runs, the one
    that has more of it is meant.
    """

    grams: Array
    cross: Array
    positive: bool

    @property
    def runs(self) -> int:
        """R."""
        return len(self.cross)

    def values(self, sets: Mask) -> Array:
        """Values (S, p) fitted to sets (S, R) of runs."""
        return self._fitted(*self._sums(sets))

    def energy(self, sets: Mask) -> Array:
        """What values fitted to sets (S, R) of runs explain in them, (S,)."""
        return self._energy(*self._sums(sets))

    def explained(self, sets: Mask) -> Array:
        """E(S) of sets (S, R), (S,)."""
        return self._explained(*self._sums(sets))

    def toggled(self, chosen: Mask) -> Array:
        """E(S) of all sets that differ from `chosen` (R,) in one run, by that run (R,)."""
        sign = np.where(chosen, -1.0, 1.0)[:, None]
        gram, cross = self._sums(chosen[None])
        return self._explained(gram + sign[:, None] * self.grams, cross + sign * self.cross)

    def _sums(self, sets: Mask) -> tuple[Array, Array]:
        member = sets.astype(float)
        return np.tensordot(member, self.grams, axes=1), member @ self.cross

    def _explained(self, gram: Array, cross: Array) -> Array:
        """From sums (S, p, p) and (S, p) over the sets."""
        whole = self._sums(np.ones((1, self.runs), bool))
        others = self._energy(whole[0] - gram, whole[1] - cross)
        return self._energy(gram, cross) + others - self._energy(*whole)

    def _energy(self, gram: Array, cross: Array) -> Array:
        return np.einsum("sp,sp->s", self._fitted(gram, cross), cross)

    def _fitted(self, gram: Array, cross: Array) -> Array:
        ridge = np.diag(_RIDGE * np.diag(self.grams.sum(axis=0)) + 1e-300)
        return np.asarray(np.linalg.solve(gram + ridge, cross[:, :, None])[:, :, 0])


def evidence_by_run(
    columns: Sequence[Array], residuals: Sequence[Array], unit_of: Sequence[int], positive: bool
) -> RunEvidence:
    """Evidence of columns (T, rows, p) and residuals (T, rows) of parts of the runs `unit_of`.

    Rows count by their own size, so that a large joint does not drown a wrist.
    """
    spread = np.median(np.abs(np.concatenate(list(residuals))), axis=0)
    scale = np.maximum(spread, 1e-6 * spread.max() + 1e-300)
    count, width = max(unit_of) + 1, columns[0].shape[2]
    grams, cross = np.zeros((count, width, width)), np.zeros((count, width))
    for block, residual, unit in zip(columns, residuals, unit_of, strict=True):
        x = (block / scale[:, None]).reshape(-1, width)
        grams[unit] += x.T @ x
        cross[unit] += x.T @ (residual / scale).ravel()
    return RunEvidence(grams, cross, positive)


def run_sets(found: RunEvidence, most: int = MOST) -> list[tuple[int, ...]]:
    """The sets of runs that explain most, best first; none where there is one run only.

    What explains next to nothing becomes no candidate: of all places and kinds, few are left.
    """
    if found.runs < 2:
        return []
    ranked = _ranked(found, _looked_at(found))
    better = [_improved(found, chosen) for chosen in ranked[:_CLIMBS]]
    best = _ranked(found, np.array([*better, *ranked]))[:most]
    worth = best[found.explained(best) > _LEAST]
    return [tuple(np.flatnonzero(_meant(found, chosen)).tolist()) for chosen in worth]


def sets_looked_at(runs: int) -> int:
    """How many tests the choice of the set stands for."""
    return max(3 * runs - 2, 1)


def _looked_at(found: RunEvidence) -> Mask:
    """Single runs, all from one on, clusters: (S, R)."""
    single = np.eye(found.runs, dtype=bool)
    later = np.triu(np.ones((found.runs, found.runs), bool))[1:]
    return np.concatenate([single, later, _clusters(found)])


def _clusters(found: RunEvidence) -> Mask:
    """Of what every run says alone, in units of what an average run can tell: (S, R)."""
    sizes, vectors = np.linalg.eigh(found.grams.mean(axis=0))
    root = vectors * np.sqrt(np.maximum(sizes, 0.0))
    members = list(np.eye(found.runs, dtype=bool))
    for a, b, *_ in linkage(found.values(np.eye(found.runs, dtype=bool)) @ root, method="ward"):
        members.append(members[int(a)] | members[int(b)])
    return np.array(members[found.runs : -1], dtype=bool).reshape(-1, found.runs)


def _ranked(found: RunEvidence, sets: Mask) -> Mask:
    """Best first, without empty ones; a set and all other runs are one and the same."""
    sets = sets[sets.any(axis=1) & ~sets.all(axis=1)]
    _, first = np.unique(sets ^ sets[:, :1], axis=0, return_index=True)
    sets = sets[np.sort(first)]
    return np.asarray(sets[np.argsort(-found.explained(sets), kind="stable")])


def _improved(found: RunEvidence, chosen: Mask) -> Mask:
    """Runs are taken in or out, one at a time, while that explains more."""
    best = found.explained(chosen[None])[0]
    for _ in range(min(found.runs, _MOST_STEPS)):
        scores = found.toggled(chosen)
        if chosen.sum() == 1:
            scores[chosen] = -np.inf  # no run or all runs: no set
        if (~chosen).sum() == 1:
            scores[~chosen] = -np.inf
        if scores.max() <= best * (1.0 + 1e-9):
            return chosen
        best, chosen = scores.max(), chosen ^ (np.arange(found.runs) == np.argmax(scores))
    return chosen


def _meant(found: RunEvidence, chosen: Mask) -> Mask:
    """The set or all other runs: those with more, or else the fewer; at a tie the later ones."""
    if found.positive:
        own, others = found.values(np.array([chosen, ~chosen]))[:, 0]
        return chosen if own > others else ~chosen
    count, places = chosen.sum(), np.arange(found.runs)
    if 2 * count != found.runs:
        return chosen if 2 * count < found.runs else ~chosen
    return chosen if places[chosen].sum() > places[~chosen].sum() else ~chosen
