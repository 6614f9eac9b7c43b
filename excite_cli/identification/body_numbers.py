"""Numbers of a body as people know them: mass, centre, and the inertia about the centre.

The ten standard parameters are mass, first moments and inertia about a frame; inertias are Ixx,
Ixy, Iyy, Ixz, Iyz, Izz.
"""

from collections.abc import Callable

import numpy as np

from excite_cli.dynamics.pseudo_inertia import moved
from excite_cli.robot.model import Array

SIX_AT = [[0, 1, 3], [1, 2, 4], [3, 4, 5]]  # where in the six the entries of the tensor are


def about_centre(ten: Array) -> Array:
    """Mass, centre and inertia about it (10,), of standard parameters."""
    centre = ten[1:4] / ten[0]
    return np.concatenate([ten[:1], centre, (moved(np.eye(3), centre) @ ten)[4:]])


def about_frame(numbers: Array) -> Array:
    """Standard parameters (10,) of mass, centre, and inertia about the centre."""
    at_centre = np.concatenate([numbers[:1], np.zeros(3), numbers[4:]])
    return np.asarray(moved(np.eye(3), -numbers[1:4]) @ at_centre)


def slopes(function: Callable[[Array], Array], at: Array, steps: Array) -> Array:
    """Derivatives (m, k) of a function at (k,), by central differences."""
    columns = [
        (function(at + step) - function(at - step)) / (2.0 * step.max()) for step in np.diag(steps)
    ]
    return np.stack(columns, axis=1)
