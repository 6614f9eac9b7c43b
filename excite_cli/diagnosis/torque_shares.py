"""How well torques fit a motion, with the URDF's inertias and passive joints: a share per joint.

The torque of a joint is taken as a sum, with coefficients that must not be negative, of

    gravity, inertial and Coriolis torque of the URDF, v, sgn v, |load| sgn v, a, q,

and an offset of any sign. What is left, as a share of the torque's standard deviation, is small if
torque and motion belong together: however wrong the inertias and however large the friction, mass
is positive, friction takes energy, and what is elastic pulls back. It is near 1 if they do not.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from excite_cli.dynamics.inverse_dynamics import InverseDynamics
from excite_cli.identification.prepare import PreparedRun
from excite_cli.measurement.dataset import Mask
from excite_cli.robot.model import Array

_SWEEPS = 80


@dataclass(frozen=True)
class Samples:
    """Some instants of all runs: q, v, a, tau (T, n), and which torques are `usable` (T, n)."""

    q: Array
    v: Array
    a: Array
    tau: Array
    usable: Mask

    def thinned(self, most: int) -> "Samples":
        """At most `most` of them, evenly spread."""
        stride = -(-len(self.q) // most)
        every = (self.q, self.v, self.a, self.tau, self.usable)
        return Samples(*(x[::stride] for x in every))  # type: ignore[arg-type]


def samples_of(runs: Sequence[PreparedRun], most: int) -> Samples:
    """At most about `most` of the filtered samples of all runs."""
    stride = max(1, -(-sum(run.averages.shape[0] for run in runs) // most))
    parts = []
    for run in runs:
        picks = run.averages[::stride]
        motion = [np.asarray(picks @ x) for x in (run.q, run.v, run.a)]
        parts.append([*motion, run.tau[::stride], run.usable[::stride]])
    return Samples(*(np.concatenate(each) for each in zip(*parts, strict=True)))


def columns_of(dynamics: InverseDynamics, q: Array, v: Array, a: Array) -> Array:
    """What a torque may be made of, (T, n, 7), for a motion q, v, a (T, n)."""
    rest = np.zeros_like(q)
    gravity = dynamics.torques(q, rest, rest)
    load = dynamics.torques(q, v, a)
    way = np.sign(v)
    return np.stack([gravity, load - gravity, v, way, np.abs(load) * way, a, q], axis=-1)


def shares_left(columns: Array, tau: Array, usable: Mask) -> Array:
    """Share (n, m, 2) of the deviation of torque k that joint j's columns leave.

    `columns` (T, n, p); `tau` and `usable` (T, m). The last axis: the torque as it is, and with
    the other sign.
    """
    weight = usable.astype(float)
    count = np.maximum(weight.sum(axis=0), 1.0)
    mean = np.einsum("tjp,tk->jkp", columns, weight) / count[:, None]
    y = (tau - (tau * weight).sum(axis=0) / count) * weight
    gram = np.einsum("tjp,tjr,tk->jkpr", columns, columns, weight, optimize=True)
    gram -= mean[..., :, None] * mean[..., None, :] * count[:, None, None]
    product = np.einsum("tjp,tk->jkp", columns, y)
    return _left(gram, product, (y**2).sum(axis=0)[None, :])


def own_shares_left(columns: Array, tau: Array, usable: Mask) -> Array:
    """As `shares_left`, torque j on the columns of joint j alone: (…, n, 2).

    `columns` (…, T, n, p), `tau` and `usable` (…, T, n), for stacks of motions.
    """
    weight = usable.astype(float)
    count = np.maximum(weight.sum(axis=-2, keepdims=True), 1.0)
    y = (tau - (tau * weight).sum(axis=-2, keepdims=True) / count) * weight
    mean = (columns * weight[..., None]).sum(axis=-3, keepdims=True) / count[..., None]
    x = np.moveaxis((columns - mean) * weight[..., None], -3, -1)  # (…, n, p, T)
    gram = x @ np.swapaxes(x, -1, -2)
    product = (x @ np.swapaxes(y, -1, -2)[..., None])[..., 0]
    return _left(gram, product, (y**2).sum(axis=-2))


def _left(gram: Array, product: Array, energy: Array) -> Array:
    size = np.sqrt(np.maximum(np.einsum("...pp->...p", gram), 0.0))
    size = np.where(size > 1e-9 * size.max(axis=-1, keepdims=True), size, np.inf)
    unit = gram / size[..., :, None] / size[..., None, :]
    target = product / size
    signs = np.array([1.0, -1.0])[:, None]
    b = target[..., None, :] * signs
    x = nonnegative(unit[..., None, :, :], b)
    total = np.broadcast_to(energy, product.shape[:-1])[..., None]
    fitted = 2 * (b * x).sum(-1) - np.einsum("...p,...pr,...r->...", x, unit[..., None, :, :], x)
    safe = np.maximum(total, 1e-300)
    return np.where(total > 0, np.sqrt(np.clip(1.0 - fitted / safe, 0.0, 1.0)), 1.0)


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
