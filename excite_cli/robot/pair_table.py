"""Distance of the meshes of two links, tabled over the two joints between them."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

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

    def distances(self, q: Array) -> Array:
        """Distances (T,) [m], cut off at 0.02 m, at q (T, n)."""
        return np.asarray(self._spline.ev(*self._at(q)))

    def slopes(self, q: Array) -> Array:
        """Derivatives (T, 2) by the two joints."""
        at = self._at(q)
        return np.stack([self._spline.ev(*at, dx=1), self._spline.ev(*at, dy=1)], axis=1)

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
