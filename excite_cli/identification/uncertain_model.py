"""An identified model with its covariance, and models drawn from it that robots can have.

All standard parameters and effects x = [φ; θ] are Gaussian about the estimate, x ~ N(x̂, B Bᵀ).
What the data say of the base parameters and effects is their covariance; of the rest of φ, about
which no torque says anything, the prior knows as much as it did:

    φ = x̂_φ + G δ_B + (1 − G mapping) Σ^½ z,    G = Σ mappingᵀ (mapping Σ mappingᵀ)⁻¹

with δ_B the deviation of the base parameters, Σ that of the prior and z white. Then mapping φ has
just the covariance of the fit. Of these models only those exist whose bodies are some mass
distribution and whose friction and armature are not negative. They are drawn by elliptical slice
sampling (Murray, Adams & MacKay 2010): from x to x̂ + (x − x̂) cos α + B z sin α, with α drawn anew
from a smaller and smaller arc until that one exists. No draw is moved to the border for it.
"""

from dataclasses import dataclass, replace

import numpy as np

from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.inertial_prior import InertialPrior
from excite_cli.dynamics.nearest_inertias import nearest_inertias
from excite_cli.dynamics.pseudo_inertia import pseudo_inertias
from excite_cli.errors import ConfigError
from excite_cli.identification.consistent import without_constraints
from excite_cli.identification.factors import Mask
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.robot.model import Array

_MARGIN = 1e-6  # kg per kg of the mean mass of a body: least eigenvalue of one that exists
_THINNING = 200  # steps from a model to the next that counts
_BEGINNING = 2000  # steps until the model that is begun with is forgotten
_SMALLEST_ARC = 1e-9  # rad


@dataclass(frozen=True)
class UncertainModel:
    """`model`, which exists, near the estimate `center` x̂ (P + k,), and `root` B (P + k, m).

    `carry` (P, k): what the effects add to the bodies. `lengths` (bodies,) [m]; `nonnegative` (k,).
    """

    model: IdentifiedModel
    center: Array
    root: Array
    carry: Array
    lengths: Array
    nonnegative: Mask

    @property
    def numbers(self) -> Array:
        """[φ; θ] of `model` (P + k,)."""
        return np.concatenate([self.model.phi, self.model.values])

    def at(self, x: Array) -> IdentifiedModel:
        """The model with the numbers x (P + k,)."""
        count = len(self.model.phi)
        return IdentifiedModel(x[:count], self.model.effects, x[count:])

    def bodies(self, x: Array) -> Array:
        """φ (P,) of the bodies with what they carry."""
        count = len(self.model.phi)
        return np.asarray(x[:count] + self.carry @ x[count:])

    def exists(self, x: Array) -> bool:
        """Whether bodies are some mass distribution, and signs are as they must be."""
        return self._possible(self._signed(x), self._scaled(x))

    def drawn(self, count: int, seed: int) -> Array:
        """Models (count, P + k) that exist; the same `seed` gives the same."""
        rng = np.random.default_rng([seed, 7])
        x, found = self.numbers - self.center, np.empty((count, len(self.center)))
        fixed = self._signed(self.center), self._scaled(self.center)
        for _ in range(_BEGINNING):
            x = self._step(x, fixed, rng)
        for k in range(count):
            for _ in range(_THINNING):
                x = self._step(x, fixed, rng)
            found[k] = self.center + x
        return found

    def _step(self, x: Array, fixed: tuple[Array, Array], rng: np.random.Generator) -> Array:
        """From one deviation to the next; `fixed`: signed numbers and bodies of the center."""
        other = self.root @ rng.normal(size=self.root.shape[1])
        signs = self._signed(x), self._signed(other)
        bodies = self._scaled(x), self._scaled(other)
        angle = rng.uniform(0.0, 2.0 * np.pi)
        low, high = angle - 2.0 * np.pi, angle
        while high - low > _SMALLEST_ARC:
            c, s = np.cos(angle), np.sin(angle)
            signed = fixed[0] + c * signs[0] + s * signs[1]
            if self._possible(signed, fixed[1] + c * bodies[0] + s * bodies[1]):
                return np.asarray(c * x + s * other)
            low, high = (angle, high) if angle < 0.0 else (low, angle)
            angle = rng.uniform(low, high)
        return x

    def _signed(self, x: Array) -> Array:
        """Those of x that must not be negative."""
        return np.asarray(x[len(self.model.phi) :][self.nonnegative])

    def _scaled(self, x: Array) -> Array:
        """Pseudo-inertias D J D (bodies, 4, 4) [kg], linear in x."""
        d = np.ones((len(self.lengths), 4))
        d[:, :3] /= self.lengths[:, None]
        return np.asarray(pseudo_inertias(self.bodies(x)) * d[:, :, None] * d[:, None, :])

    def _possible(self, signed: Array, bodies: Array) -> bool:
        if (signed < 0.0).any():
            return False
        return bool(np.linalg.eigvalsh(bodies)[:, 0].min() > 0.0)


def from_covariance(base: BaseParameters, prior: InertialPrior, covariance: Array) -> Array:
    """B (P + k, m) of the covariance (r + k, r + k) of base parameters and effects.

    What the data do not show (infinite) is as uncertain as in the prior; effects stay as they are.
    """
    rank, count, size = base.rank, len(prior.std), len(covariance)
    known = np.isfinite(np.diag(covariance))
    own = np.where(np.outer(known, known), covariance, 0.0)
    unseen = np.flatnonzero(~known[:rank])
    own[unseen, unseen] = np.square(prior.base_std(base)[unseen])
    values, vectors = np.linalg.eigh((own + own.T) / 2.0)
    half = vectors * np.sqrt(np.maximum(values, 0.0))
    spread = np.square(prior.std)[:, None] * base.mapping.T
    gain = np.linalg.lstsq(base.mapping @ spread, spread.T, rcond=None)[0].T
    root = np.zeros((count + size - rank, size + count))
    root[:count, :size] = gain @ half[:rank]
    root[count:, :size] = half[rank:]
    root[:count, size:] = np.diag(prior.std) - gain @ (base.mapping * prior.std)
    return root


def from_information(base: BaseParameters, prior: InertialPrior, factor: Array) -> Array:
    """B (P + k, P + k) with (B Bᵀ)⁻¹ = RᵀR of `factor` R (r + k, r + k), and the prior's."""
    rows = np.zeros((len(factor) + 1, len(factor) + 1))
    rows[:-1, :-1] = factor
    return without_constraints(rows, base, prior)[1]


def uncertain(
    model: IdentifiedModel,
    center: Array,
    root: Array,
    carry: Array,
    lengths: Array,
    nonnegative: Mask,
) -> UncertainModel:
    """`model` with its covariance; moved to the nearest that exists if it does not.

    Raises
    ------
    ConfigError
        None was found.
    """
    found = UncertainModel(model, center, root, carry, lengths, nonnegative)
    if found.exists(found.numbers):
        return found
    count = len(model.phi)
    margin = _MARGIN * max(float(np.abs(model.phi[::10]).mean()), 1e-6)
    signs = np.flatnonzero(nonnegative) + count
    nearest = nearest_inertias(root, found.numbers, lengths, signs, margin)
    moved = replace(found, model=found.at(nearest.x))
    if not (nearest.solved and moved.exists(moved.numbers)):
        raise ConfigError(
            "no robot near the model was found whose links are possible bodies. Identify with "
            "identification.consistent: true."
        )
    return moved
