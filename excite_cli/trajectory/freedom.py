"""How many coefficients a motion gets where the config leaves that open.

More harmonics make better motions (UR10, 12 s: 8.0 with 5, 5.9 with 8, 5.3 with 12, 5.2 with 16)
until they are faster than what a robot follows or so fast that its acceleration moves nothing.
"""

import math

import numpy as np

from excite_cli.config.trajectory_spec import BSplineSpec, FourierSpec
from excite_cli.trajectory.base import Array

# Below the first resonances of arms and the cutoffs of their controllers.
_FASTEST = 1.5  # Hz
# What a joint's full acceleration should still move it by, at the highest frequency.
_AMPLITUDE = 0.05  # rad or m
_FEWEST, _MOST = 5, 12
# Time of an iteration grows with the square of the variables and more.
_VARIABLES = 450


def with_freedom(
    spec: FourierSpec | BSplineSpec, accelerations: Array
) -> FourierSpec | BSplineSpec:
    """`spec` with its harmonics or control points; `accelerations` (n,) bound those of joints.

    [rad/s² or m/s²], infinite where nothing bounds them.
    """
    if isinstance(spec, FourierSpec):
        if spec.harmonics is not None:
            return spec
        duration = 2 * math.pi / spec.base_frequency
        return spec.model_copy(update={"harmonics": harmonics_for(duration, accelerations)})
    if spec.control_points is not None:
        return spec
    # A series of N harmonics has 2 N + 1 coefficients; at rest, four points are held at the ends.
    points = 2 * harmonics_for(spec.duration, accelerations) + 1 + (4 if spec.at_rest else 0)
    return spec.model_copy(update={"control_points": max(points, spec.degree + 5)})


def harmonics_for(duration: float, accelerations: Array) -> int:
    """N for a motion of `duration` [s] of joints with these bounds (n,) on accelerations."""
    typical = float(np.median(accelerations))
    fastest = min(_FASTEST, math.sqrt(typical / _AMPLITUDE) / (2 * math.pi))
    affordable = (_VARIABLES // len(accelerations) - 1) // 2
    return max(_FEWEST, min(int(fastest * duration), affordable, _MOST))
