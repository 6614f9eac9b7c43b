"""Data in blocks of time, each predicted by a model that did not see it.

Columns are [inertial | declared effects | candidates | torque]. With Gram matrices per joint and
block any model is fitted without some blocks, and what it leaves of each, E_jb, is found without
touching samples again. A member leaves a model by a downdate: with P the inverse of the normal
matrix and P_i its columns of the member, θ falls by P_i P_ii⁻¹ θ_i. One more joins by what is left
of it, S = G_cc − G_cA P G_Ac, and of its product with the torque, z: it has β = S⁻¹ z, and θ falls
by P G_Ac β.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from excite_cli.arrays import Array, Indices
from excite_cli.diagnosis.schur import RIDGE

_KEPT = 64  # models whose fits are kept


@dataclass(frozen=True)
class _Fits:
    """A model fitted without each group: columns `at` (k,), θ (G, k) and P (G, k, k).

    `exact`: not by a downdate, each of which costs digits.
    """

    at: Indices
    parameters: Array
    inverses: Array
    exact: bool = True


class Blocks:
    """Gram matrices `grams[j]` (B, A_j, A_j) of the rows of every joint in every block.

    `active[j]` (A_j,) are their columns among all, the torque last. `total` (K, K) is their sum,
    with what is known without the data; all are of normalised columns. `columns` gives those of the
    model of some candidates and `own` those of one. A model is fitted without the blocks of one of
    the `groups` (B,) to predict these, or, where they are `seen`, to all.
    """

    def __init__(
        self,
        active: Sequence[Indices],
        grams: Sequence[Array],
        total: Array,
        columns: Callable[[Sequence[int]], Indices],
        own: Callable[[int], Indices],
        groups: Indices,
        seen: bool = False,
    ) -> None:
        self._grams, self._columns, self._own = grams, columns, own
        self.groups = groups
        size = len(total)
        self._position = np.full((len(active), size), -1)
        for position, at in zip(self._position, active, strict=True):
            position[at] = np.arange(len(at))
        self._rest = np.repeat(total[None], int(groups.max()) + 1, axis=0)  # (G, K, K)
        for at, of_joint in zip(active, grams, strict=True):
            for group, rest in enumerate(() if seen else self._rest):
                rest[np.ix_(at, at)] -= of_joint[groups == group].sum(axis=0)
        self._fitted: dict[tuple[int, ...], _Fits] = {}
        self._whole: tuple[frozenset[int], _Fits] | None = None
        self._energies: dict[tuple, Array] = {}

    def energies(self, chosen: Sequence[int], joints: Sequence[int] | None = None) -> Array:
        """Energy (n, B) of each joint, or of some, that is left in each block."""
        rows = tuple(range(len(self._grams)) if joints is None else joints)
        key = (tuple(sorted(chosen)), rows)
        if key not in self._energies:
            fits = self._fits(key[0])
            (found,) = self._left(fits.at, fits.parameters[:, None], rows)
            keep(self._energies, key, found)
        return self._energies[key]

    def without_each(self, chosen: Sequence[int]) -> dict[int, Array]:
        """As `energies`, (n, B) of the model without one of the chosen, of each of them."""
        fits = self._fits(tuple(sorted(chosen)))
        fewer = np.repeat(fits.parameters[:, None], len(chosen), axis=1)
        places = {int(column): k for k, column in enumerate(fits.at)}
        for k, i in enumerate(chosen):
            own = [places[int(column)] for column in self._own(i)]
            among = fits.inverses[:, own][:, :, own]
            steps = np.linalg.solve(among, fits.parameters[:, own][:, :, None])
            fewer[:, k] -= (fits.inverses[:, :, own] @ steps)[:, :, 0]
            fewer[:, k, own] = 0.0
        every = tuple(range(len(self._grams)))
        return dict(zip(chosen, self._left(fits.at, fewer, every), strict=True))

    def with_each(
        self, chosen: Sequence[int], more: Sequence[int], joints: Sequence[int]
    ) -> dict[int, Array]:
        """As `energies`, of the model with one of `more` beside the chosen, of each of them."""
        fits = self._fits(tuple(sorted(chosen)))
        ends = np.cumsum([0, *(len(self._own(i)) for i in more)])
        beside = np.concatenate([fits.at[:0], *(self._own(i) for i in more)])
        at = np.concatenate([fits.at, beside])
        found = np.zeros((len(self._rest), len(more), len(at)))
        shared = self._rest[:, fits.at[:, None], beside]
        normal, rhs = self._rest[:, beside[:, None], beside], self._rest[:, beside, -1]
        across = fits.inverses @ shared
        left = normal - np.swapaxes(shared, 1, 2) @ across
        left[:, np.arange(len(beside)), np.arange(len(beside))] += RIDGE
        side = rhs - (fits.parameters[:, None] @ shared)[:, 0]
        base = slice(len(fits.at))
        for k, own in enumerate(slice(*pair) for pair in pairwise(ends)):
            sizes = np.linalg.solve(left[:, own, own], side[:, own, None])
            found[:, k, len(fits.at) :][:, own] = sizes[:, :, 0]
            found[:, k, base] = fits.parameters - (across[:, :, own] @ sizes)[:, :, 0]
        return dict(zip(more, self._left(at, found, joints), strict=True))

    def fit(self, chosen: Sequence[int]) -> None:
        """Fit a model of which others that lack one member will be asked."""
        fits = self._fits(tuple(sorted(chosen)))
        if fits.exact:
            self._whole = frozenset(chosen), fits

    def _fits(self, chosen: tuple[int, ...]) -> _Fits:
        if chosen not in self._fitted:
            keep(self._fitted, chosen, self._without_one(chosen) or self._anew(chosen))
        return self._fitted[chosen]

    def _anew(self, chosen: tuple[int, ...]) -> _Fits:
        at = self._columns(chosen)
        normal = self._rest[:, at[:, None], at]
        normal[:, np.arange(len(at)), np.arange(len(at))] += RIDGE
        inverses = np.linalg.inv(normal)
        parameters = np.asarray((inverses @ self._rest[:, at, -1][:, :, None])[:, :, 0])
        return _Fits(at, parameters, np.asarray(inverses))

    def _without_one(self, chosen: tuple[int, ...]) -> _Fits | None:
        """By a downdate, where it lacks one member of the model that is at hand (`fit`)."""
        if self._whole is None or len(self._whole[0]) != len(chosen) + 1:
            return None
        more, fits = self._whole
        gone = more.difference(chosen)
        if len(gone) > 1:
            return None
        out = np.isin(fits.at, self._own(*gone))
        own, kept = np.flatnonzero(out), np.flatnonzero(~out)
        across = fits.inverses[:, kept[:, None], own]
        among = fits.inverses[:, own[:, None], own]
        both = np.concatenate([fits.parameters[:, own, None], np.swapaxes(across, 1, 2)], axis=2)
        steps = np.linalg.solve(among, both)
        parameters = fits.parameters[:, kept] - (across @ steps[:, :, :1])[:, :, 0]
        inverses = fits.inverses[:, kept[:, None], kept] - across @ steps[:, :, 1:]
        return _Fits(fits.at[kept], parameters, inverses, exact=False)

    def _left(self, at: Indices, parameters: Array, joints: Sequence[int]) -> Array:
        """Of m models (m, n, B) with the columns `at` (k,) and `parameters` (G, m, k)."""
        found = np.empty((parameters.shape[1], len(joints), len(self.groups)))
        for row, joint in enumerate(joints):
            position = self._position[joint, at]
            there = np.flatnonzero(position >= 0)
            both = np.append(position[there], self._position[joint, -1])
            grams = self._grams[joint][:, both[:, None], both]
            w = np.empty((*parameters.shape[:2], len(both)))
            w[:, :, :-1], w[:, :, -1] = -parameters[:, :, there], 1.0
            for group, each in enumerate(w):  # (m, A)
                here = self.groups == group
                found[:, row, here] = np.einsum("bma,ma->mb", each @ grams[here], each)
        return np.maximum(found, 0.0)


def keep(kept: dict, key: tuple, value: object, most: int = _KEPT) -> None:
    """Keep a value, and forget the first where there would be more than `most`."""
    if len(kept) >= most:
        kept.pop(next(iter(kept)))
    kept[key] = value
