"""Second-order Taylor models: what a quantity can be at every instant of a short interval.

With s ∈ [−1, 1] across the interval, a quantity x(s) is known as

    x(s) = c₀ + c₁ s + c₂ s² + e(s),      |e(s)| ≤ radius.

Sums, products, sines and matrix products of such models are again such models: terms of third and
higher order go into the radius with their absolute values, so the enclosure is a proof (up to
rounding, some 1e-16 of each term), and its width falls with the third power of the interval
(Makino and Berz 2003). Arrays of any shape are enclosed entry by entry.
"""

from dataclasses import dataclass
from typing import Union

import numpy as np

from excite_cli.arrays import Array as Array


@dataclass(frozen=True)
class Taylor:
    """`terms` (3, …): c₀, c₁, c₂; `radius` (…) ≥ 0."""

    terms: Array
    radius: Array

    @classmethod
    def constant(cls, value: Array) -> "Taylor":
        """What does not change in the interval."""
        value = np.asarray(value, dtype=float)
        terms = np.zeros((3, *value.shape))
        terms[0] = value
        return cls(terms, np.zeros(value.shape))

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the quantity."""
        return self.radius.shape

    @property
    def center(self) -> Array:
        """c₀: the value in the middle of the interval, up to the radius."""
        return self.terms[0]

    @property
    def size(self) -> Array:
        """A bound on |x(s)|, entry by entry."""
        return np.asarray(_absolute(self.terms) + self.radius)

    @property
    def reach(self) -> Array:
        """A bound on |x(s) − c₀|, entry by entry."""
        return np.asarray(np.abs(self.terms[1:]).sum(axis=0) + self.radius)

    def __getitem__(self, key: object) -> "Taylor":
        """Entries; `key` counts the axes of the quantity."""
        inner = key if isinstance(key, tuple) else (key,)
        return Taylor(self.terms[(slice(None), *inner)], self.radius[inner])

    def __neg__(self) -> "Taylor":
        return Taylor(-self.terms, self.radius)

    def __add__(self, other: Union["Taylor", Array, float]) -> "Taylor":
        if isinstance(other, Taylor):
            return Taylor(self.terms + other.terms, self.radius + other.radius)
        shape = np.broadcast_shapes(self.shape, np.shape(other))
        terms = np.broadcast_to(self.terms, (3, *shape)).copy()
        terms[0] += other
        return Taylor(terms, np.broadcast_to(self.radius, shape))

    def __sub__(self, other: Union["Taylor", Array, float]) -> "Taylor":
        if isinstance(other, Taylor):
            return Taylor(self.terms - other.terms, self.radius + other.radius)
        return self + (-np.asarray(other))

    def scaled(self, factor: Array | float) -> "Taylor":
        """x times a number that is known, entry by entry."""
        return Taylor(self.terms * factor, self.radius * np.abs(factor))

    def times(self, other: "Taylor") -> "Taylor":
        """The product, entry by entry."""
        (a0, a1, a2), (b0, b1, b2) = self.terms, other.terms
        terms = np.empty((3, *np.broadcast_shapes(self.shape, other.shape)))
        np.multiply(a0, b0, out=terms[0])
        np.multiply(a0, b1, out=terms[1])
        terms[1] += a1 * b0
        np.multiply(a0, b2, out=terms[2])
        terms[2] += a1 * b1
        terms[2] += a2 * b0
        radius = np.abs(a1 * b2 + a2 * b1)
        radius += np.abs(a2 * b2)
        if other.radius.any():
            radius += _absolute(self.terms) * other.radius
        if self.radius.any():
            radius += self.radius * other.size
        return Taylor(terms, radius)

    def through(self, matrix: Array) -> "Taylor":
        """x·matrixᵀ over the last axis: a linear map (m, k) that is known."""
        return Taylor(self.terms @ matrix.T, self.radius @ np.abs(matrix).T)

    def summed(self, axis: int) -> "Taylor":
        """Sum over an axis, counted from the end (negative)."""
        return Taylor(self.terms.sum(axis=axis), self.radius.sum(axis=axis))

    def lower(self) -> Array:
        """The least value that x can take in the interval, entry by entry."""
        c0, c1, c2 = self.terms
        least = c0 + c2 - np.abs(c1)
        inside = 2 * c2 > np.abs(c1)
        safe = np.where(inside, c2, 1.0)
        least = np.where(inside, c0 - c1 * c1 / (4 * safe), least)
        return np.asarray(least - self.radius)

    def upper(self) -> Array:
        """The largest value that x can take in the interval, entry by entry."""
        return -(-self).lower()

    def at(self, s: float) -> Array:
        """c₀ + c₁ s + c₂ s², which is x(s) up to the radius."""
        return np.asarray(self.terms[0] + s * (self.terms[1] + s * self.terms[2]))


def _absolute(terms: Array) -> Array:
    """|c₀| + |c₁| + |c₂|."""
    one, two, three = np.abs(terms)
    return np.asarray(one + two + three)


def matmul(a: Taylor, b: Taylor) -> Taylor:
    """The matrix product over the last two axes."""
    products = a.terms[:, None] @ b.terms[None]
    terms = np.stack(
        [
            products[0, 0],
            products[0, 1] + products[1, 0],
            products[0, 2] + products[1, 1] + products[2, 0],
        ]
    )
    radius = np.abs(products[1, 2] + products[2, 1]) + np.abs(products[2, 2])
    radius = radius + _absolute(a.terms) @ b.radius + a.radius @ b.size
    return Taylor(terms, radius)


def applied(matrix: Taylor, vector: Taylor) -> Taylor:
    """The matrix (…, i, j) times the vector (…, j)."""
    column = Taylor(vector.terms[..., None], vector.radius[..., None])
    return matmul(matrix, column)[..., 0]


def transposed(matrix: Taylor) -> Taylor:
    """Last two axes exchanged."""
    return Taylor(matrix.terms.swapaxes(-1, -2), matrix.radius.swapaxes(-1, -2))


def dot(a: Taylor, b: Taylor) -> Taylor:
    """a·b over the last axis."""
    return a.times(b).summed(-1)


def cross(a: Taylor, b: Taylor) -> Taylor:
    """a × b over the last axis."""
    forward, back = [1, 2, 0], [2, 0, 1]
    return a[..., forward].times(b[..., back]) - a[..., back].times(b[..., forward])


def stacked(parts: list[Taylor], axis: int = -1) -> Taylor:
    """Parts beside each other along a new axis, counted from the end (negative)."""
    return Taylor(
        np.stack([part.terms for part in parts], axis=axis),
        np.stack([part.radius for part in parts], axis=axis),
    )


def joined(parts: list[Taylor], axis: int = -1) -> Taylor:
    """Parts one after the other along an axis, counted from the end (negative)."""
    return Taylor(
        np.concatenate([part.terms for part in parts], axis=axis),
        np.concatenate([part.radius for part in parts], axis=axis),
    )


def sine_and_cosine(x: Taylor) -> tuple[Taylor, Taylor]:
    """sin x and cos x; what is left out of both is below |δ|³/6 and the cut of δ²/2."""
    c0, c1, c2 = x.terms
    sine, cosine = np.sin(c0), np.cos(c0)
    delta = np.abs(c1) + np.abs(c2)
    cut = np.abs(c1 * c2) + 0.5 * c2 * c2
    rest = delta**3 / 6 + x.radius
    half = 0.5 * c1 * c1
    sin = np.stack([sine, cosine * c1, cosine * c2 - sine * half])
    cos = np.stack([cosine, -sine * c1, -sine * c2 - cosine * half])
    return (
        Taylor(sin, np.abs(sine) * cut + rest),
        Taylor(cos, np.abs(cosine) * cut + rest),
    )
