"""What a candidate adds to a model: the Schur complement of its Gram matrix.

With N = G_SS + Λ (Λ the precision of what is known without the data, if anything is) and a
candidate c, the Schur complement Z = G_cc − G_cS N⁻¹ G_Sc is what is left of the candidate once the
model has taken its part, z = G_cy − G_cS N⁻¹ G_Sy its product with the residual, and zᵀ Z⁻¹ z the
energy that it explains: χ² distributed for unit noise if the candidate is not there.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs

from excite_cli.arrays import Array, Indices, Mask

# Cholesky factors of the many small normal matrices of a search, by LAPACK itself.
#
# On matrices of 60 columns scipy's functions spend as long on their arguments as on the work.

# On the diagonal of a normal matrix of normalised columns, so that what data do not show stays
# where it is. No more than this: parameters that data do show may have 1e-10 of their columns'
# energy to themselves.
RIDGE = 1e-13


class Cholesky:
    """The factor of a symmetric positive definite matrix (k, k)."""

    def __init__(self, matrix: Array) -> None:
        """Raise LinAlgError where `matrix` is not positive definite."""
        self._factor, wrong = dpotrf(matrix.T, lower=1, clean=0)
        if wrong:
            raise np.linalg.LinAlgError(f"column {wrong} of {len(matrix)} depends on those before")

    def solve(self, rhs: Array) -> Array:
        """The solution (k,) or (k, m) for right sides of that shape."""
        return np.asarray(dpotrs(self._factor, rhs, lower=1)[0])


# A direction of a candidate of which less than this share is left is absorbed by the model.
ABSORBED = 1e-3
# Members of a model are judged beside each other: friction terms share nearly all they have.
SHARED = 1e-7
_COLLINEAR = 1e-9


@dataclass(frozen=True)
class Gain:
    """What one candidate adds to a model: χ², degrees of freedom, share of it that is left."""

    chi2: float
    dof: int
    left: float


@dataclass(frozen=True)
class OneShape:
    """Candidates of w columns each with d directions: `columns` (m, w), `bases` (m, w, d).

    `grams` (m, w, w) of their columns.
    """

    candidates: list[int]
    columns: Indices
    bases: Array
    grams: Array


class CandidateBases:
    """Columns of candidates in the normalised Gram matrix of all."""

    def __init__(self, total: Array, fixed: int, blocks: list[Indices]) -> None:
        self.total, self.fixed, self.blocks = total, fixed, blocks
        self._bases: dict[int, Array] = {}
        self._of_one_shape: dict[tuple[int, ...], list[OneShape]] = {}

    def basis(self, candidates: Sequence[int]) -> Array:
        """Orthonormal directions (p, d) of candidates' columns, without collinear ones."""
        if len(candidates) > 1:
            return self._basis(np.concatenate([self.blocks[i] for i in candidates]))
        if candidates[0] not in self._bases:
            self._bases[candidates[0]] = self._basis(self.blocks[candidates[0]])
        return self._bases[candidates[0]]

    def of_one_shape(self, some: Iterable[int]) -> list[OneShape]:
        """Some of the candidates; of the same ones they are made once."""
        key = tuple(some)
        if key not in self._of_one_shape:
            self._of_one_shape[key] = self._sorted_by_shape(key)
        return self._of_one_shape[key]

    def _sorted_by_shape(self, some: Sequence[int]) -> list[OneShape]:
        shapes: dict[tuple[int, ...], list[int]] = {}
        for i in some:
            shapes.setdefault(self.basis([i]).shape, []).append(i)
        found = []
        for several in shapes.values():
            at = np.stack([self.blocks[i] for i in several])
            bases = np.stack([self.basis([i]) for i in several])
            found.append(OneShape(several, at, bases, self.total[at[:, :, None], at[:, None]]))
        return found

    def _basis(self, at: Indices) -> Array:
        values, vectors = np.linalg.eigh(self.total[np.ix_(at, at)])
        kept = values > _COLLINEAR * values[-1]
        return np.asarray(vectors[:, kept] / np.sqrt(values[kept]))


class Schur:
    """Candidates after projection off a model.

    Of the (p, p) that is left of p columns only what is asked for is reckoned: their diagonal,
    blocks of single candidates, pairs. It knows the candidates and not the evidence, which keeps
    it: in a circle, all the matrices of a pass would outlive it.
    """

    def __init__(
        self,
        candidates: CandidateBases,
        products: tuple[Array, Array],
        diagonal: Array,
        cross: Array,
        identified_by_prior_only: Mask,
        of_larger: "tuple[Schur, Array, Array] | None" = None,
    ) -> None:
        """`products` (k, p) are G_Sc and N⁻¹ G_Sc, `diagonal` and `cross` (p,) of Z and z.

        `identified_by_prior_only` (p,): columns that scales tell from the model, and data do not.
        `of_larger`: the same of a model with one member more, whose products these are, and W_i,
        P_ii⁻¹ W_i (w, p) of that member.
        """
        self._candidates, self.diagonal, self.cross = candidates, diagonal, cross
        self._shared, self._solved = products
        self._told, self._of_larger = identified_by_prior_only, of_larger
        self._left_of: dict[tuple[int, ...], Array] = {}  # blocks of candidates of one shape

    def block(self, rows: Indices, columns: Indices) -> Array:
        """What is left (r, c) of some candidates' columns, counted from the first candidate's."""
        e = self._candidates
        if self._of_larger is not None:
            larger, solved, more = self._of_larger
            return np.asarray(larger.block(rows, columns) + solved[:, rows].T @ more[:, columns])
        own = e.total[np.ix_(rows + e.fixed, columns + e.fixed)]
        return np.asarray(own - self._shared[:, rows].T @ self._solved[:, columns])

    def _left(self, alike: OneShape) -> Array:
        """What is left (m, w, w) of candidates of one shape."""
        at = alike.columns - self._candidates.fixed
        if self._of_larger is not None:
            larger, *both = self._of_larger
            solved, more = (np.moveaxis(x[:, at], 0, 2) for x in both)
            return np.asarray(larger._left(alike) + solved @ np.swapaxes(more, 1, 2))
        key = tuple(alike.candidates)
        if key not in self._left_of:
            shared, solved = (np.moveaxis(x[:, at], 0, 2) for x in (self._shared, self._solved))
            self._left_of[key] = alike.grams - shared @ np.swapaxes(solved, 1, 2)
        return self._left_of[key]

    def without(self, own: slice, inverse: Array, values: Array) -> "Schur":
        """After projection off the model without its columns `own` (w,).

        `inverse` (w, w) of their block of N⁻¹, `values` (w,) their fitted parameters.
        """
        solved = self._solved[own]
        more = inverse @ solved
        diagonal = self.diagonal + np.einsum("wp,wp->p", solved, more)
        cross = self.cross + values @ more
        products = self._shared, self._solved
        both = (self, solved, more)
        return Schur(self._candidates, products, diagonal, cross, self._told, both)

    def identified_by_prior_only(self, candidate: int) -> bool:
        """Whether scales alone tell a candidate of one column from the model."""
        at = self._candidates.blocks[candidate] - self._candidates.fixed
        return len(at) == 1 and bool(self._told[at[0]])

    def gain(self, *candidates: int, absorbed: float = ABSORBED) -> Gain:
        """χ², degrees of freedom and the largest share left of candidates taken together.

        Directions of which less than `absorbed` is left do not count, but for what scales tell.
        """
        if len(candidates) == 1 and self.identified_by_prior_only(candidates[0]):
            absorbed = SHARED
        e = self._candidates
        at = np.concatenate([e.blocks[i] for i in candidates]) - e.fixed
        return gain_of_columns(self.block(at, at), self.cross[at], e.basis(candidates), absorbed)

    @cached_property
    def singles(self) -> dict[int, Gain]:
        """Gain of every candidate alone."""
        return self.singles_of(range(len(self._candidates.blocks)))

    def singles_of(self, some: Iterable[int]) -> dict[int, Gain]:
        """Gain of some candidates alone."""
        found: dict[int, Gain] = {}
        for alike in self._candidates.of_one_shape(some):
            at = alike.columns - self._candidates.fixed
            left = self._left(alike)
            told = self._told[at[:, :1]] & (at.shape[1] == 1)
            absorbed = np.where(told, SHARED, ABSORBED)
            gains = _gains(left, self.cross[at], alike.bases, absorbed)
            found |= dict(zip(alike.candidates, gains, strict=True))
        return found

    def pair_chi2(self, first: Array, second: Array) -> Array:
        """χ² of pairs of candidates of one column each, without those that are collinear."""
        e = self._candidates
        i = np.array([e.blocks[k][0] for k in first]) - e.fixed
        j = np.array([e.blocks[k][0] for k in second]) - e.fixed
        several, where = np.unique(np.concatenate([i, j]), return_inverse=True)
        left = self.block(several, several)[where[: len(i)], where[len(i) :]]
        ii, jj, ij = self.diagonal[i], self.diagonal[j], left
        zi, zj = self.cross[i], self.cross[j]
        determinant = ii * jj - ij**2
        found = (zi**2 * jj - 2 * zi * zj * ij + zj**2 * ii) / np.maximum(determinant, 1e-300)
        return np.where(determinant > 1e-3 * ii * jj, found, 0.0)


def gain_of_columns(left: Array, cross: Array, basis: Array, absorbed: float) -> Gain:
    """Of w columns of which (w, w) is `left`, with products (w,) with the residual and a basis."""
    return _gains(left[None], cross[None], basis[None], np.full((1, 1), absorbed))[0]


def _gains(left: Array, cross: Array, bases: Array, absorbed: Array) -> list[Gain]:
    """Of candidates of one shape: (m, w, w), (m, w), (m, w, d) and (m, 1)."""
    turned = np.swapaxes(bases, 1, 2)
    shares, axes = np.linalg.eigh(turned @ left @ bases)
    alive = shares > absorbed
    z = (np.swapaxes(axes, 1, 2) @ (turned @ cross[:, :, None]))[:, :, 0]
    chi2 = np.sum(np.where(alive, z**2 / np.where(alive, shares, 1.0), 0.0), axis=1)
    # Columns of nothing, of an effect that these data do not show, have no direction at all.
    most = shares.max(axis=1, initial=0.0)
    each = zip(chi2.tolist(), alive.sum(axis=1).tolist(), most.tolist(), strict=True)
    return [Gain(*values) for values in each]
