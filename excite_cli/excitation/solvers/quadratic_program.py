"""Convex quadratic programs: minimise ½ xᵀHx + gᵀx subject to Ax ≥ b.

The family of library backends; each is imported only when it is asked for.
"""

import importlib
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np

from excite_cli.constraints.base import Array
from excite_cli.errors import ConfigError, MissingExtraError, nearest

_INFINITE = 1e30


@dataclass(frozen=True)
class QuadraticSolution:
    """Minimiser (n,) and multipliers (m,), none negative: Hx + g = Aᵀλ."""

    x: Array
    multipliers: Array


class QuadraticBackend(ABC):
    """A library that solves one quadratic program at a time."""

    name: str

    def __init__(self) -> None:
        self._library = _imported(self.name)

    @abstractmethod
    def minimise(
        self, hessian: Array, gradient: Array, rows: Array, bounds: Array
    ) -> QuadraticSolution | None:
        """Solve for positive definite H (n, n), g (n,), A (m, n), b (m,).

        None where the library finds no solution, as for rows that contradict one another.
        """


class Daqp(QuadraticBackend):
    """Dual active set (Arnström, Bemporad and Axehill 2022): quick with few binding rows."""

    name = "daqp"

    def minimise(
        self, hessian: Array, gradient: Array, rows: Array, bounds: Array
    ) -> QuadraticSolution | None:
        """See the family; rows are met to 1e-9 of their own length."""
        x, _, flag, info = self._library.solve(
            np.ascontiguousarray(hessian),
            np.ascontiguousarray(gradient),
            np.ascontiguousarray(rows),
            np.full(len(bounds), _INFINITE),
            np.ascontiguousarray(bounds),
            np.zeros(len(bounds), dtype=np.intc),
            primal_tol=1e-9,
        )
        if flag != 1 or not np.all(np.isfinite(x)):
            return None
        return QuadraticSolution(np.array(x), np.maximum(-np.array(info["lam"]), 0.0))


class Piqp(QuadraticBackend):
    """Proximal interior point (Schwan et al. 2023): its time hardly depends on what binds."""

    name = "piqp"

    def minimise(
        self, hessian: Array, gradient: Array, rows: Array, bounds: Array
    ) -> QuadraticSolution | None:
        """See the family."""
        solver = self._library.DenseSolver()
        solver.settings.eps_abs = solver.settings.eps_rel = 1e-8
        solver.settings.eps_duality_gap_abs = solver.settings.eps_duality_gap_rel = 1e-8
        solver.setup(
            np.asfortranarray(hessian),
            gradient,
            G=np.asfortranarray(rows),
            h_l=bounds,
            h_u=np.full(len(bounds), _INFINITE),
        )
        if solver.solve() != self._library.PIQP_SOLVED:
            return None
        result = solver.result
        return QuadraticSolution(np.array(result.x), np.maximum(np.array(result.z_l), 0.0))


_BACKENDS: dict[str, type[QuadraticBackend]] = {kind.name: kind for kind in (Daqp, Piqp)}


def build_backend(name: str) -> QuadraticBackend:
    """The backend called `name`.

    Raises
    ------
    ConfigError
        There is no backend of that name.
    MissingExtraError
        Its library is not installed.
    """
    if name not in _BACKENDS:
        raise ConfigError(
            f"optimizer.qp_solver: '{name}' is not one of {', '.join(sorted(_BACKENDS))}."
            f"{nearest(name, _BACKENDS)}"
        )
    return _BACKENDS[name]()


def _imported(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise MissingExtraError(
            f"optimizer.qp_solver: {name} is not installed. Install it with "
            "`pip install excite-cli[qp]`, or take optimizer.method: interior_point, which needs "
            "no quadratic programs."
        ) from error
