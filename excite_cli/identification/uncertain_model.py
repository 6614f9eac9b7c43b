"""An identified model with its covariance, and models drawn from it that robots can have.

All standard parameters and effects x = [φ; θ] are Gaussian about the estimate, x ~ N(x̂, B Bᵀ).
What the data say of the base parameters and effects is their covariance; of the rest of φ, about
which no torque says anything, the prior knows as much as it did:

    φ = x̂_φ + G δ_B + (1 − G mapping) Σ^½ z,    G = Σ mappingᵀ (mapping Σ mappingᵀ)⁻¹

with δ_B the deviation of the base parameters, Σ that of the prior and z white. Then mapping φ has
just the covariance of the fit. Of these models only those exist whose bodies are some mass
distribution and whose friction and armature are not negative. They are drawn by elliptical slice
sampling (Murray, Adams & MacKay 2010) of w in x = x̂ + B w, a few of its numbers at a time: from w
to w cos α + z sin α with z white, and α drawn anew from a smaller and smaller arc until that model
exists. No draw is moved to the border for it.
"""

from dataclasses import dataclass, replace

import numpy as np

from excite_cli.arrays import Array, Indices, Mask
from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.pseudo_inertia import InertialPrior, nearest_inertias, pseudo_inertias
from excite_cli.errors import ConfigError
from excite_cli.identification.consistent import without_constraints
from excite_cli.identification.identified_model import IdentifiedModel

_MARGIN = 1e-6  # kg per kg of the mean mass of a body: least eigenvalue of one that exists
_BLOCK = 2  # numbers of w that move together: the more, the smaller the arcs
_SWEEPS = 12  # from a model to the next that counts
_BEGINNING = 5  # models until the one that is begun with is forgotten
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
        return _Limits(self._signed(x), self._scaled(x).ravel()).kept

    def drawn(self, count: int, seed: int) -> Array:
        """Models (count, P + k) that exist; the same `seed` gives the same."""
        rng = np.random.default_rng([seed, 7])
        gap = self.numbers - self.center
        w: Array = np.asarray(np.linalg.lstsq(self.root, gap, rcond=None)[0], dtype=float)
        # Linear in w are what must not be negative, and the bodies: one row for each column of B.
        signed = np.array([self._signed(column) for column in self.root.T])
        bodies = np.array([self._scaled(column).ravel() for column in self.root.T])
        begin = self.numbers - self.root @ w  # the model's, where B does not reach it
        fixed = _Limits(self._signed(begin), self._scaled(begin).ravel())
        blocks = np.array_split(np.arange(len(w)), -(-len(w) // _BLOCK))
        found = np.empty((count, len(gap)))
        for k in range(-_BEGINNING, count):
            here = fixed.plus(w @ signed, w @ bodies)
            for _ in range(_SWEEPS):
                for block in blocks:
                    here = _turned(w, block, here, signed[block], bodies[block], rng)
            if k >= 0:
                found[k] = begin + self.root @ w
        return found

    def _signed(self, x: Array) -> Array:
        """Those of x that must not be negative."""
        return np.asarray(x[len(self.model.phi) :][self.nonnegative])

    def _scaled(self, x: Array) -> Array:
        """Pseudo-inertias D J D (bodies, 4, 4) [kg], linear in x."""
        d = np.ones((len(self.lengths), 4))
        d[:, :3] /= self.lengths[:, None]
        return np.asarray(pseudo_inertias(self.bodies(x)) * d[:, :, None] * d[:, None, :])


@dataclass(frozen=True)
class _Limits:
    """What decides whether a model exists: numbers that must not be negative, and its bodies.

    These are scaled pseudo-inertias (16·bodies,).
    """

    signed: Array
    bodies: Array

    def plus(self, signed: Array, bodies: Array) -> "_Limits":
        return _Limits(self.signed + signed, self.bodies + bodies)

    @property
    def kept(self) -> bool:
        if self.signed.size and self.signed.min() < 0.0:
            return False
        try:
            np.linalg.cholesky(self.bodies.reshape(-1, 4, 4))
        except np.linalg.LinAlgError:
            return False
        return True


def _turned(
    w: Array,
    block: Indices,
    here: _Limits,
    signed: Array,
    bodies: Array,
    rng: np.random.Generator,
) -> _Limits:
    """Move the numbers `block` of w on an ellipse, all others fixed; what decides there."""
    own, other = w[block], rng.normal(size=len(block))
    own_signed, other_signed = own @ signed, other @ signed
    own_bodies, other_bodies = own @ bodies, other @ bodies
    rest = here.plus(-own_signed, -own_bodies)
    angle = rng.uniform(0.0, 2.0 * np.pi)
    low, high = angle - 2.0 * np.pi, angle
    while high - low > _SMALLEST_ARC:
        c, s = np.cos(angle), np.sin(angle)
        tried = rest.plus(c * own_signed + s * other_signed, c * own_bodies + s * other_bodies)
        if tried.kept:
            w[block] = c * own + s * other
            return tried
        low, high = (angle, high) if angle < 0.0 else (low, angle)
        angle = rng.uniform(low, high)
    return here


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
