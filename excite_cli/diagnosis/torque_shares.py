"""How well torques fit a motion, whatever the inertias may be: a share per joint.

The torque of a joint is taken as a sum, with coefficients that must not be negative, of

    gravity, inertial and Coriolis torque of the URDF, v, sgn v, |load| sgn v, a, q,

an offset of any sign, and Y D z: what other inertias than the URDF's add, where D are the standard
deviations of the standard parameters (masses and inertias 30 %, centres of mass 3 cm) and z is
small. What is left,

    share² = min (‖τ − all of it‖² + λ² ‖τ‖² ‖z‖²) / ‖τ‖²,

is small if torque and motion belong together: mass is positive, friction takes energy, and what is
elastic pulls back. It is near 1 if they do not. z is taken out in closed form: with Z = Y D every
product xᵀ y of columns becomes xᵀ y − xᵀ Z (Zᵀ Z + λ² ‖τ‖²)⁻¹ Zᵀ y. Instants at which a joint
stands do not count, since what it then carries is up to its friction.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve

from excite_cli.dynamics.inverse_dynamics import InverseDynamics
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.identification.prepare import PreparedRun
from excite_cli.identification.prior import inertial_prior
from excite_cli.measurement.dataset import Mask
from excite_cli.robot.model import Array, Robot

_SWEEPS = 80
_PASSIVE = 7  # columns
_UNCERTAIN, _CENTER = 0.3, 0.03  # share of masses and inertias; m by which centres of mass are off
_DEVIATION = 0.03  # λ: inertias one standard deviation off cost as much as 3 % of the torque
_ROUNDING = 1e-12
_FEWEST = 50  # instants in motion from which a joint can be judged


@dataclass(frozen=True)
class Samples:
    """Some instants of all runs: q, v, a, tau (T, n), which torques are `known`, which joints move.

    `known` and `moves` (T, n).
    """

    q: Array
    v: Array
    a: Array
    tau: Array
    known: Mask
    moves: Mask

    def thinned(self, most: int) -> "Samples":
        """At most `most` of them, evenly spread."""
        stride = max(1, -(-len(self.q) // most))
        every = (self.q, self.v, self.a, self.tau, self.known, self.moves)
        return Samples(*(x[::stride] for x in every))  # type: ignore[arg-type]


def samples_of(runs: Sequence[PreparedRun], most: int) -> Samples:
    """At most about `most` of the filtered samples of all runs in which some joint moves.

    A joint that hardly moves is not judged: none of its instants counts.
    """
    parts = []
    for run in runs:
        moves = run.usable & run.moving
        some = moves.any(axis=1)
        picks = run.averages[some]
        motion = [np.asarray(picks @ x) for x in (run.q, run.v, run.a)]
        parts.append([*motion, run.tau[some], run.valid[some], moves[some]])
    whole = Samples(*(np.concatenate(each) for each in zip(*parts, strict=True)))
    judged = whole.moves.sum(axis=0) >= _FEWEST
    return replace(whole, moves=whole.moves & judged).thinned(most)


def those(names: Sequence[str], chosen: Mask) -> tuple[str, ...]:
    """The names that are chosen (n,)."""
    return tuple(names[j] for j in np.flatnonzero(chosen).tolist())


class RoughModel:
    """What a torque may be made of: the URDF's dynamics, passive joints, uncertain inertias.

    `spread` (P,): standard deviations of the standard parameters `phi`.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot, self.dynamics = robot, InverseDynamics(robot)
        self.phi = standard_parameters(robot)
        spread = inertial_prior(robot, self.phi, _UNCERTAIN).std.reshape(-1, 10).copy()
        own = _UNCERTAIN * self.phi.reshape(-1, 10)[:, 1:4]
        spread[:, 1:4] = np.hypot(own, _CENTER * spread[:, :1] / _UNCERTAIN)
        self.spread: Array = spread.ravel()

    def gravity(self, q: Array) -> Array:
        """Torques (T, n) of the URDF's weight."""
        return self.dynamics.torques(q, np.zeros_like(q), np.zeros_like(q))

    def shares_left(self, samples: Samples) -> Array:
        """Share (n, n, 2) of the deviation of torque k that the motion of joint j leaves.

        The last axis: the torque as it is, and with the other sign.
        """
        motion, here = self._columns(samples), range(samples.q.shape[1])
        return _left([[_products(samples, motion, j, k) for k in here] for j in here])

    def own_shares_left(self, several: Sequence[Samples]) -> Array:
        """As `shares_left`, torque j on the motion of joint j alone, of some samples: (S, n, 2)."""
        found = []
        for samples in several:
            motion, here = self._columns(samples), range(samples.q.shape[1])
            found.append([_products(samples, motion, j, j) for j in here])
        return _left(found)

    def _columns(self, samples: Samples) -> tuple[Array, Array]:
        """Columns (T, n, 7) with coefficients ≥ 0, and Y D (T, n, P)."""
        q, v, a = samples.q, samples.v, samples.a
        gravity = self.gravity(q)
        regressor = RigidBody(self.robot, self.phi, q, v, a).regressor
        load = regressor @ self.phi
        way = np.sign(v)
        passive = np.stack([gravity, load - gravity, v, way, np.abs(load) * way, a, q], axis=-1)
        return passive, regressor * self.spread


def _products(samples: Samples, motion: tuple[Array, Array], j: int, k: int) -> Array:
    """Products (9, 9) of joint j's columns and torque k with z taken out; ‖τ_k‖² in the corner.

    Zero where joint j moves too little: anything fits then.
    """
    counted = samples.moves[:, j] & samples.known[:, k]
    found = np.zeros((_PASSIVE + 2, _PASSIVE + 2))
    if np.count_nonzero(counted) <= 2 * len(found):
        return found
    passive, uncertain = (x[counted, j] for x in motion)
    x = np.column_stack([passive, samples.tau[counted, k]])
    x -= x.mean(axis=0)
    z = uncertain[:, np.abs(uncertain).max(axis=0) > 0.0]
    z -= z.mean(axis=0)
    gram = x.T @ x
    energy = float(gram[-1, -1])
    if not energy > 0.0:
        return found
    # Of a torque far smaller than any inertia makes it, rounding is left: anything fits.
    precision = max(_DEVIATION**2 * energy, _ROUNDING * float(np.square(z).sum()))
    if z.shape[1] > len(z):  # the smaller of two equal ways: x' x - x' Z (Z' Z + p)^-1 Z' x
        gram = precision * (x.T @ _solved(z @ z.T, precision, x))
    elif z.shape[1]:
        cross = z.T @ x
        gram -= cross.T @ _solved(z.T @ z, precision, cross)
    found[:-1, :-1], found[-1, -1] = gram, energy
    return found


def _solved(gram: Array, precision: float, right: Array) -> Array:
    """(gram + precision I)⁻¹ right."""
    gram[np.diag_indices(len(gram))] += precision
    return np.asarray(solve(gram, right, assume_a="pos", overwrite_a=True))


def _left(products: Sequence[Sequence[Array]]) -> Array:
    """Shares (…, 2), by the sign of the torque, from stacks of `_products`."""
    every = np.array(products)
    gram, energy = every[..., :-1, :-1], every[..., -1, -1]
    size = np.sqrt(np.maximum(np.einsum("...pp->...p", gram[..., :-1, :-1]), 0.0))
    size = np.where(size > 1e-9 * size.max(axis=-1, keepdims=True), size, np.inf)
    unit = (gram[..., :-1, :-1] / size[..., :, None] / size[..., None, :])[..., None, :, :]
    b = np.array([1.0, -1.0])[:, None] * (gram[..., :-1, -1] / size)[..., None, :]
    x = nonnegative(unit, b)
    fitted = 2 * (b * x).sum(-1) - np.einsum("...p,...pr,...r->...", x, unit, x)
    left = (gram[..., -1, -1, None] - fitted) / np.maximum(energy, 1e-300)[..., None]
    return np.asarray(np.sqrt(np.clip(left, 0.0, 1.0)))


def nonnegative(gram: Array, b: Array) -> Array:
    """x ≥ 0 that minimises ½ xᵀ gram x − bᵀ x, for stacks of problems (…, p, p) and (…, p).

    Coordinate descent, all problems at once. The diagonal of `gram` is 1, or 0 for columns that
    are not there.
    """
    x: Array = np.zeros(np.broadcast_shapes(gram.shape[:-1], b.shape))
    for _ in range(_SWEEPS):
        for p in range(b.shape[-1]):
            slope = b[..., p] - (gram[..., p, :] * x).sum(-1)
            there = gram[..., p, p] > 0
            x[..., p] = np.where(there, np.maximum(x[..., p] + slope, 0.0), 0.0)
    return x
