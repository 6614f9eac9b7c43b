"""Distance of the meshes of two links, tabulated over the two joints between them."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from excite_cli.kernels.compiled import KERNELS

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PairTable:
    """Distance [m] of the meshes of two links over two moved joints.

    joints: the two moved joints; grids: positions of each; values: distances at all of them;
    error: the most by which the table was found to exceed the true distance at trial postures
    [m]; touching: share of the grid in contact; turning: which of the two joints turn without end.
    """

    first: str
    second: str
    joints: tuple[int, int]
    grids: tuple[Array, Array]
    values: Array
    error: float
    touching: float
    turning: tuple[bool, bool] = (False, False)

    @cached_property
    def _spline(self) -> Any:
        from scipy.interpolate import RectBivariateSpline  # few robots need a table

        return RectBivariateSpline(*self.grids, self.values, kx=3, ky=3)

    @cached_property
    def _slope_splines(self) -> tuple[Any, Any]:
        return self._spline.partial_derivative(1, 0), self._spline.partial_derivative(0, 1)

    def distances(self, q: Array) -> Array:
        """Distances (T,) [m], cut off at 0.02 m, at q (T, n)."""
        if KERNELS is not None:
            return self._value_and_slopes(q)[:, 0]
        return np.asarray(self._spline.ev(*self._at(q)))

    def slopes(self, q: Array) -> Array:
        """Derivatives (T, 2) by the two joints."""
        if KERNELS is not None:
            return self._value_and_slopes(q)[:, 1:]
        at = self._at(q)
        return np.stack([spline(*at, grid=False) for spline in self._slope_splines], axis=1)

    def _value_and_slopes(self, q: Array) -> Array:
        assert KERNELS is not None
        first, second, coefficients = self._knots_and_coefficients
        at = np.ascontiguousarray(self.positions(q), dtype=float)
        found = np.empty((len(at), 3))
        KERNELS.call("bicubic", first, second, coefficients, at, found)
        return found

    @cached_property
    def _knots_and_coefficients(self) -> tuple[Array, Array, Array]:
        first, second, coefficients = (np.ascontiguousarray(part) for part in self._spline.tck)
        return first, second, coefficients.reshape(len(first) - 4, len(second) - 4)

    def holds(self, at: Array) -> NDArray[np.bool_]:
        """Whether positions (T, 2) of the two joints are within the table (T,)."""
        low, high = (np.array([grid[end] for grid in self.grids]) for end in (0, -1))
        inside = (at >= low) & (at <= high)
        if not np.ptp(self.values, axis=1).any():  # the second joint changes nothing
            inside[:, 1] = True
        return np.asarray(inside.all(axis=1))

    def positions(self, q: Array) -> Array:
        """Positions (T, 2) of the two joints, within one turn where they turn without end."""
        at = q[:, list(self.joints)]
        if not any(self.turning):
            return at
        wrapped = np.mod(at + np.pi, 2 * np.pi) - np.pi
        return np.where(self.turning, wrapped, at)

    @cached_property
    def bends(self) -> tuple[float, float, float]:
        """Bounds on |second derivatives|: by one joint, by both, by the other.

        A spline is nowhere beyond its coefficients.
        """
        found = [self._spline.partial_derivative(*by) for by in ((2, 0), (1, 1), (0, 2))]
        one, both, other = (float(np.abs(spline.tck[2]).max()) for spline in found)
        return one, both, other

    def _at(self, q: Array) -> tuple[Array, Array]:
        one, two = (
            np.clip(at, grid[0], grid[-1])
            for at, grid in zip(self.positions(q).T, self.grids, strict=True)
        )
        return one, two
