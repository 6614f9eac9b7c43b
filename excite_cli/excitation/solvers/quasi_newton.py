"""Damped BFGS: an update of the Hessian that stays positive definite (Powell 1978)."""

import numpy as np

from excite_cli.constraints.base import Array


def damped_update(hessian: Array, step: Array, change: Array) -> Array:
    """BFGS kept positive definite by Powell's damping (Nocedal and Wright 2006, Eq. 18.15)."""
    image = hessian @ step
    curvature, bend = float(step @ change), float(step @ image)
    if bend <= 1e-14:
        return hessian
    if curvature < 0.1 * bend:
        share = 0.9 * bend / (bend - curvature)
        change = share * change + (1 - share) * image
        curvature = float(step @ change)
    return hessian - np.outer(image, image) / bend + np.outer(change, change) / curvature
