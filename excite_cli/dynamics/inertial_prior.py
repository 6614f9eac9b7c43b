"""What the URDF's inertias are worth: φ ~ N(φ_CAD, (uncertainty · scale)²) per standard parameter.

Scales are |value| with floors made of the body's mass m and length ℓ (m, m ℓ and m ℓ² with
factors), so that entries that are zero in the URDF may move a little, and those of bodies without
inertia as well. Data depend on φ through φ_B = mapping φ only, so the prior acts on base parameters
as N(mapping φ_CAD, mapping Σ mappingᵀ), and the full φ that goes with a fitted φ_B is the
conditional mean, the smallest whitened change of φ_CAD.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.pseudo_inertia import body_lengths
from excite_cli.robot.model import Array, Robot

# Floors: of m in shares of the mean mass, of the others in shares of m ℓ and m ℓ².
_MASS_SHARE, _MOMENT_FLOOR, _INERTIA_FLOOR = 0.1, 0.2, 0.1
_MEDIAN = 0.6745  # of |z|, z normal
_AS_USUAL = 1.05
# Standard deviation of the URDF's inertial parameters, as a share, where nobody says it: over real
# and simulated robots 0.3 is best or next to it (docs/decisions/prior-of-inertial-parameters.md).
UNSURE = 0.3


@dataclass(frozen=True)
class InertialPrior:
    """`mean` (P,), `std` (P,) of independent standard parameters [kg, kg m, kg m²]."""

    mean: Array
    std: Array

    def widened(self, base: BaseParameters, values: Array) -> "InertialPrior":
        """The same, as wide as the usual one of its differences from `values` (r,) of a fit.

        Masses of a placeholder are off by many times their size, all of them. A model that lacks
        something is far off in a few directions, and the median does not know these.
        """
        whiten, target = self.on_base(base)
        usual = float(np.median(np.abs(whiten @ values - target))) / _MEDIAN
        return self if usual <= _AS_USUAL else InertialPrior(self.mean, usual * self.std)

    def base_std(self, base: BaseParameters) -> Array:
        """Standard deviations (r,) of base parameters."""
        return np.sqrt(np.square(base.mapping) @ np.square(self.std))

    def rows(self, base: BaseParameters, more: int = 0) -> Array:
        """`on_base` as rows [A b] (r, r + more + 1), zero for `more` other parameters."""
        whiten, target = self.on_base(base)
        return np.column_stack([whiten, np.zeros((len(whiten), more)), target])

    def on_base(self, base: BaseParameters) -> tuple[Array, Array]:
        """Pseudo-rows (A (r, r), b (r,)) with ‖A φ_B − b‖² the prior on base parameters."""
        covariance = (base.mapping * np.square(self.std)) @ base.mapping.T
        lower = np.linalg.cholesky(_regular(covariance))
        a = solve_triangular(lower, np.eye(len(lower)), lower=True)
        return a, a @ (base.mapping @ self.mean)

    def completed(self, base: BaseParameters, values: Array) -> Array:
        """Full φ (P,) with mapping φ = `values` (r,), nearest to the prior's mean."""
        spread = np.square(self.std)[:, None] * base.mapping.T
        covariance = base.mapping @ spread
        gap = values - base.mapping @ self.mean
        phi = self.mean + spread @ cho_solve(cho_factor(_regular(covariance)), gap)
        return phi + _exact(base, values - base.mapping @ phi)


def inertial_prior(robot: Robot, phi_cad: Array, uncertainty: float) -> InertialPrior:
    """The prior of all standard parameters around `phi_cad` (P,), `uncertainty` as a share."""
    bodies = np.asarray(phi_cad, dtype=float).reshape(-1, 10)
    mass, length = np.abs(bodies[:, 0]), body_lengths(robot, phi_cad)
    mass = np.maximum(mass, _MASS_SHARE * max(float(mass.mean()), 1e-6))
    floors = np.empty_like(bodies)
    floors[:, 0] = mass
    floors[:, 1:4] = (_MOMENT_FLOOR * mass * length)[:, None]
    floors[:, 4:] = (_INERTIA_FLOOR * mass * length**2)[:, None]
    scale = np.maximum(np.abs(bodies), floors)
    return InertialPrior(bodies.ravel().copy(), uncertainty * scale.ravel())


def _regular(covariance: Array) -> Array:
    """With a trace of diagonal, against rounding."""
    return covariance + 1e-13 * np.diag(np.diag(covariance))


def _exact(base: BaseParameters, gap: Array) -> Array:
    """Rounding of the solve, put on the columns that stand for the base parameters."""
    correction = np.zeros(base.mapping.shape[1])
    correction[base.selection] = gap
    return correction
