"""In which runs an effect of single runs is: the few sets of runs that explain most.

With G_r and y_r the Gram matrix of the effect's columns in run r and their product with the
residual there, values of their own in the runs S and outside of it explain

    E(S) = y_SᵀG_S⁻¹y_S + y_NᵀG_N⁻¹y_N − yᵀG⁻¹y,    G_S = Σ_{r∈S} G_r,  N the runs not in S,

more than one value in all of them, which is what the robot's own parameters take up. Sets that are
looked at: single runs, all runs from one on, and the clusters of what each run says alone; their
number, and that of the candidates, grows linearly with the runs, or not at all.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.cluster.hierarchy import linkage

from excite_cli.robot.model import Array

MOST = 6  # sets that become candidates
_RIDGE = 1e-9
_CLIMBS = 3  # best sets that are improved run by run

RunSet = frozenset[int]


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

    def values(self, chosen: Sequence[int]) -> Array:
        """Values (p,) fitted to some runs."""
        return np.asarray(np.linalg.solve(*self._sums(chosen)))

    def explained(self, chosen: Sequence[int]) -> float:
        """E(S), for all columns."""
        rest = [r for r in range(self.runs) if r not in set(chosen)]
        whole = range(self.runs)
        return self.energy(chosen) + self.energy(rest) - self.energy(whole)

    def _sums(self, chosen: Sequence[int]) -> tuple[Array, Array]:
        at = list(chosen)
        gram = self.grams[at].sum(axis=0)
        scale = np.diag(self.grams.sum(axis=0))
        gram[np.diag_indices(len(gram))] += _RIDGE * scale + 1e-300
        return gram, self.cross[at].sum(axis=0)

    def energy(self, chosen: Sequence[int]) -> float:
        """What values fitted to some runs explain in them."""
        gram, cross = self._sums(chosen)
        return float(cross @ np.linalg.solve(gram, cross))


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


def run_sets(found: RunEvidence) -> list[tuple[int, ...]]:
    """The sets of runs that explain most, best first; none where there is one run only."""
    if found.runs < 2:
        return []
    ranked = _ranked(found, _looked_at(found))
    better = [_improved(found, chosen) for chosen in ranked[:_CLIMBS]]
    best = _ranked(found, [*better, *ranked])[:MOST]
    return [tuple(sorted(_meant(found, chosen))) for chosen in best]


def sets_looked_at(runs: int) -> int:
    """How many tests the choice of the set stands for."""
    return max(3 * runs - 2, 1)


def _looked_at(found: RunEvidence) -> Iterator[RunSet]:
    count = found.runs
    for r in range(count):
        yield frozenset({r})
    for r in range(1, count):
        yield frozenset(range(r, count))
    yield from _clusters(found)


def _clusters(found: RunEvidence) -> Iterator[RunSet]:
    """Of what every run says alone, in units of what an average run can tell."""
    gram = found.grams.mean(axis=0)
    sizes, vectors = np.linalg.eigh(gram)
    root = vectors * np.sqrt(np.maximum(sizes, 0.0))
    said = np.stack([found.values([r]) for r in range(found.runs)]) @ root
    members = [frozenset({r}) for r in range(found.runs)]
    for a, b, *_ in linkage(said, method="ward"):
        members.append(members[int(a)] | members[int(b)])
        if len(members[-1]) < found.runs:
            yield members[-1]


def _ranked(found: RunEvidence, sets: Sequence[RunSet] | Iterator[RunSet]) -> list[RunSet]:
    """Best first, without empty ones; a set and all other runs are one and the same."""
    everything = frozenset(range(found.runs))
    scores: dict[RunSet, float] = {}
    for chosen in sets:
        if not chosen or chosen == everything or everything - chosen in scores:
            continue
        scores.setdefault(chosen, found.explained(sorted(chosen)))
    return sorted(scores, key=lambda chosen: -scores[chosen])


def _improved(found: RunEvidence, chosen: RunSet) -> RunSet:
    """Runs are taken in or out, one at a time, while that explains more."""
    best = found.explained(sorted(chosen))
    for _ in range(found.runs):
        moves = [chosen ^ {r} for r in range(found.runs)]
        moves = [move for move in moves if move and len(move) < found.runs]
        scores = [found.explained(sorted(move)) for move in moves]
        at = int(np.argmax(scores)) if scores else -1
        if at < 0 or scores[at] <= best * (1.0 + 1e-9):
            return chosen
        best, chosen = scores[at], moves[at]
    return chosen


def _meant(found: RunEvidence, chosen: RunSet) -> RunSet:
    """The set or all other runs: those with more, or else the fewer; at a tie the later ones."""
    rest = frozenset(range(found.runs)) - chosen
    if found.positive:
        difference = found.values(sorted(chosen))[0] - found.values(sorted(rest))[0]
        return chosen if difference > 0 else rest
    if len(chosen) != len(rest):
        return min(chosen, rest, key=len)
    return max(chosen, rest, key=sum)
