"""Gains of drives and parameters of the textbook's model together, by Gauss and Newton.

    min over φ, f, κ = log kp of  Σ_j n_j log ‖e_j − ((Y φ)_j + F_j f_j) exp(−κ_j)‖ + prior(φ, κ)

with e_j (M,) the distances of set points from positions, of a unit gain (`drive_law`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from excite_cli.effects.judgement import half_of
from excite_cli.robot.model import Array

_STEPS, _SETTLED = 30, 1e-4  # of Gauss and Newton; in log kp
# Of log kp beside the logarithm of the joint's largest torque, one standard deviation: stiffness
# goes with a drive's size. Of the gains that a simulated Panda and UR10 were given 0.4 and 0.6;
# real drives were not surveyed.
_ALIKE = 0.6


@dataclass(frozen=True)
class Gains:
    """Parameters theta (p,) of the textbook's model, κ = log kp (n,), of covariance H Hᵀ (n, n)."""

    theta: Array
    kappa: Array
    half: Array


def fit_gains(
    joints: Sequence[tuple[Array, int]],
    start: Gains,
    prior: tuple[Array, Array],
    usual: Array,
    lasting: Array | None = None,
) -> Gains:
    """The minimum over φ, f and κ by Gauss and Newton, steps halved until they lead down.

    The volume of all φ that fit grows with the scale, by exp(N_j κ_j) where joint j determines N_j
    of them (Laplace's approximation); without this factor gains came out 10 to 48 % too low.
    """
    n, rank, (whiten, target) = len(joints), len(prior[1]), prior
    width = len(start.theta)
    counts = np.array([m for _, m in joints]) / (1.0 if lasting is None else lasting)
    alike = (np.eye(n) - 1.0 / n) / _ALIKE

    def noise(x: Array) -> Array:
        left = [np.linalg.norm(left_by(own, x[:width], x[width + k])) for k, (own, _) in each]
        return np.array(left) / np.sqrt([m for _, m in joints]) + 1e-12

    def unlikely(x: Array) -> float:
        off = whiten @ x[:rank] - target
        return float(0.5 * off @ off)

    def cost(x: Array, told: Array) -> float:
        differ = alike @ (x[width:] - usual)
        misfit = float(counts @ np.log(noise(x))) - float(told @ x[width:])
        return misfit + unlikely(x) + 0.5 * float(differ @ differ)

    each = list(enumerate(joints))
    x = np.concatenate([start.theta, start.kappa])
    for _ in range(_STEPS):
        weights = np.sqrt(counts / [m for _, m in joints]) / noise(x)
        matrix, right = [], []
        for k, (own, _) in each:
            slope = own[:, :width] * np.exp(-x[width + k])
            block = np.zeros((len(own), width + n))
            block[:, :width], block[:, width + k] = slope, -slope @ x[:width]
            matrix.append(block * weights[k])
            right.append(left_by(own, x[:width], x[width + k]) * weights[k])
        known = np.zeros((rank + n, width + n))
        known[:rank, :rank], known[rank:, width:] = whiten, alike
        a = np.concatenate([*matrix, known])
        b = np.concatenate([*right, target - whiten @ x[:rank], -alike @ (x[width:] - usual)])
        scale = np.maximum(np.linalg.norm(a, axis=0), 1e-30)
        told = _told([block[:, :width] for block in matrix], whiten, width - rank)
        inverse = np.linalg.pinv((a / scale).T @ (a / scale), hermitian=True)
        change = np.linalg.lstsq(a / scale, b, rcond=1e-10)[0] / scale
        change += inverse[:, width:] @ (told / scale[width:]) / scale
        before, share = cost(x, told), 1.0
        while cost(x + share * change, told) > before and share > 1e-3:
            share *= 0.5
        x = x + share * change
        if float(np.abs(change[width:]).max()) < _SETTLED or share <= 1e-3:
            break
    own = inverse[width:, width:] / np.outer(scale[width:], scale[width:])
    return Gains(x[:width], x[width:], half_of(own))


def _told(blocks: Sequence[Array], whiten: Array, beside: int) -> Array:
    """N (n,): how many inertial parameters each joint's rows determine, its friction being free.

    N_j = tr(S⁻¹ S_j) with S = Σ_j S_j + WᵀW, S_j the information of its rows `blocks` (M, r + k)
    on φ (r,) beside the last `beside` columns, W the prior's rows.
    """
    rank = whiten.shape[1]
    parts = []
    for block in blocks:
        q = np.linalg.svd(block[:, rank:], full_matrices=False) if beside else None
        own = block[:, :rank]
        if q is not None:
            basis = q[0][:, q[1] > 1e-9 * max(float(q[1].max(initial=0.0)), 1e-300)]
            own = own - basis @ (basis.T @ own)
        parts.append(own.T @ own)
    inverse = np.linalg.pinv(sum(parts) + whiten.T @ whiten, hermitian=True)
    return np.array([float(np.sum(inverse * part)) for part in parts])


def left_by(own: Array, theta: Array, kappa: float) -> Array:
    """What a joint's [columns, e] leave."""
    return np.asarray(own[:, -1] - own[:, :-1] @ theta * np.exp(-kappa))
