"""Second derivatives of the rigid-body torque, in one direction of the states.

Pinocchio's Python module has no second derivatives of the inverse dynamics. Every effect needs them
in one direction d = (d_q, d_v, d_a) per sample only,

    d/ds [ wᵀ ∂τ/∂(q, v, a) ](q + s d_q, v + s d_v, a + s d_a)  at s = 0,

which is a central difference of exact first derivatives: two passes, about nine digits.
"""

import numpy as np

from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.robot.model import Array

_STEP = 1e-5  # rad


def slope_of_gradient(
    body: RigidBody, weights: Array, d_q: Array, d_v: Array | None = None, d_a: Array | None = None
) -> tuple[Array, Array, Array]:
    """Derivative of Σ_t w_tᵀ (∂τ/∂q d_q + ∂τ/∂v d_v + ∂τ/∂a d_a) by q, v and a at constant d.

    Parameters
    ----------
    body: the motion and its parameters
    weights, d_q, d_v, d_a: (T, n); None is zero

    Returns
    -------
    gq, gv, ga: (T, n) each
    """
    d_v = np.zeros_like(d_q) if d_v is None else d_v
    d_a = np.zeros_like(d_q) if d_a is None else d_a
    # The step is small against every state: torque is quadratic in v and linear in a.
    size = np.abs(d_q)
    size = np.maximum(size, np.abs(d_v) / (1.0 + np.abs(body.v)))
    size = np.maximum(size, np.abs(d_a) / (1.0 + np.abs(body.a))).max(axis=1, keepdims=True)
    step = _STEP / np.where(size > 0, size, 1.0)
    ahead = _gradient(body, weights, step * d_q, step * d_v, step * d_a)
    behind = _gradient(body, weights, -step * d_q, -step * d_v, -step * d_a)
    gq, gv, ga = ((plus - minus) / (2 * step) for plus, minus in zip(ahead, behind, strict=True))
    return gq, gv, ga


def _gradient(body: RigidBody, weights: Array, dq: Array, dv: Array, da: Array) -> list[Array]:
    shifted = RigidBody(body.robot, body.phi, body.q + dq, body.v + dv, body.a + da)
    parts = (shifted.by_position, shifted.by_velocity, shifted.mass)
    return [np.einsum("tr,trk->tk", weights, part) for part in parts]
