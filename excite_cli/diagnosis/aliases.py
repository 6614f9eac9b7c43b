"""Candidates that the data at hand cannot tell from one that was named.

With the rest of the model projected off, c leaves Z_cc and its fitted signal has the energy
θᵀ Z_cc θ. What another candidate d cannot imitate of it is E = θᵀ (Z_cc − Z_cd Z_dd⁻¹ Z_dc) θ, and
the Kullback–Leibler divergence between the two is E/2: below 3 no test tells them apart reliably.
The data themselves may also be undecided where the divergence is larger: then the residual
energies of the two fits differ by less than 6.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.evidence import Evidence, Schur
from excite_cli.robot.model import Array

UNDECIDED = 3.0  # KL divergence [nats]


@dataclass(frozen=True)
class Alias:
    """A candidate that might be meant instead, with the divergence from the named one."""

    candidate: int
    divergence: float


def aliases_of(
    named: int,
    rest: Sequence[int],
    taken: set,
    candidates: Sequence[Candidate],
    white: Evidence,
    inflation: float,
    allowed: Callable[[Sequence[int], int], bool],
) -> list[Alias]:
    """Candidates that could replace `named` beside the `rest`, nearest first, one per place.

    Places in `taken` are named already. By how much there is more of it in some runs is no other
    name of what all runs have: where `rest` lacks what refines it, that stands for what is lacking.

    A candidate with more parameters than the named one has more to explain it with and is no alias;
    `allowed(rest, d)` vetoes impossible signs.
    """
    schur = white.schur(rest)
    own = schur.gain(named)
    found: dict[tuple, Alias] = {}
    rows = set(candidates[named].rows)
    for i, c in enumerate(candidates):
        if c.place in taken or not rows & set(c.rows):
            continue
        if c.effect.is_change and c.place._replace(runs=()) == candidates[named].place:
            continue
        other = schur.singles[i]
        if other.dof == 0 or other.dof > own.dof or other.chi2 < 0.5 * own.chi2:
            continue
        expected = 0.5 * _left(schur, white, named, i) / inflation
        observed = 0.5 * (own.chi2 - other.chi2) / inflation
        divergence = min(expected, max(observed, 0.0))
        if divergence < UNDECIDED and allowed(rest, i):
            best = found.get(c.place)
            if best is None or divergence < best.divergence:
                found[c.place] = Alias(i, divergence)
    return sorted(found.values(), key=lambda alias: alias.divergence)


def _left(schur: Schur, white: Evidence, named: int, other: int) -> float:
    """Energy of the named candidate's fitted signal that the other cannot imitate."""
    c, d = (white.blocks[k] - white.fixed for k in (named, other))
    theta = _solve(schur.matrix[np.ix_(c, c)], schur.cross[c])
    mixed = schur.matrix[np.ix_(d, c)] @ theta
    whole = float(theta @ schur.matrix[np.ix_(c, c)] @ theta)
    return max(0.0, whole - float(mixed @ _solve(schur.matrix[np.ix_(d, d)], mixed)))


def _solve(matrix: Array, rhs: Array) -> Array:
    return np.asarray(np.linalg.lstsq(matrix, rhs, rcond=1e-6)[0])
