"""The finite-difference checker for every derivative in the program."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FORWARD_STEP = 1e-6
CENTRAL_STEP = 1e-5
FOURTH_ORDER_STEP = 3e-5


def forward_differences(
    function: Callable[[Array], float], x: Array, step: float = FORWARD_STEP
) -> Array:
    """∂f/∂x_i ≈ (f(x + h e_i) − f(x)) / h, in the shape of x; the paper's check with h = 1e-6."""
    value = function(x)
    return _each(lambda shifted, h: (function(shifted(h)) - value) / h, x, step)


def central_differences(
    function: Callable[[Array], float], x: Array, step: float = CENTRAL_STEP
) -> Array:
    """∂f/∂x_i ≈ (f(x + h e_i) − f(x − h e_i)) / 2h, in the shape of x."""
    return _each(lambda at, h: (function(at(h)) - function(at(-h))) / (2 * h), x, step)


def fourth_order_differences(
    function: Callable[[Array], float], x: Array, step: float = FOURTH_ORDER_STEP
) -> Array:
    """Central differences on five points: truncation h⁴ allows a large step, hence little noise."""
    return _each(
        lambda at, h: (
            (
                8 * (function(at(h)) - function(at(-h)))
                - (function(at(2 * h)) - function(at(-2 * h)))
            )
            / (12 * h)
        ),
        x,
        step,
    )


def relative_error(found: Array, reference: Array) -> float:
    """‖found − reference‖ / ‖reference‖, zero where both vanish."""
    scale = float(np.linalg.norm(reference))
    difference = float(np.linalg.norm(found - reference))
    return difference / scale if scale > 0 else difference


def _each(
    slope: Callable[[Callable[[float], Array], float], float], x: Array, step: float
) -> Array:
    result = np.empty_like(x)
    for index in np.ndindex(x.shape):

        def at(h: float, index: tuple[int, ...] = index) -> Array:
            shifted = x.copy()
            shifted[index] += h
            return shifted

        result[index] = slope(at, step)
    return result
