"""What goes with what among kinds of effects: order, prices, parents, exclusions."""

import numpy as np

from excite_cli.robot.model import Array

# Surprise at an effect of this kind (χ² units), where two explain the data about as well.
UNUSUAL = {
    "viscous_friction": 0.0,
    "coulomb_friction": 0.0,
    "torque_offset": 1.0,
    "load_dependent_friction": 1.0,
    "armature": 1.0,
    "spring": 12.0,  # else a constant is called a preloaded spring as soon as noise bends it
    "coupled_friction": 3.0,
    "nonlinear_viscous_friction": 2.0,
    "asymmetric_friction": 4.0,
    "contact": 60.0,  # three forces in a window of one's choice explain any event a little
    "cable_force": 25.0,  # three smooth functions of two angles come near an offset or a spring
    "friction_drift": 15.0,  # within the seconds of a run, friction hardly warms up
    "stribeck_friction": 2.0,
}
_UNUSUAL_DEFAULT = 4.0
# The order in which kinds are asked for: what every robot has, what many have, the rest. A later
# kind may still replace an earlier one.
_FIRST_TIER = ("viscous_friction", "coulomb_friction")
LAST_TIER = (
    "ripple", "contact", "friction_drift", "cable_force", "elasticity", "backlash",
    "torque_saturation", "asymmetric_friction",
)  # fmt: skip
# First-order friction comes first: what refines it is only asked for once it is in.
FIRST = {
    "nonlinear_viscous_friction": ("viscous_friction", "coulomb_friction"),
    "stribeck_friction": ("viscous_friction", "coulomb_friction"),
    "friction_drift": ("viscous_friction", "coulomb_friction"),
    "coupled_friction": ("viscous_friction", "coulomb_friction"),
    "asymmetric_friction": ("coulomb_friction", "torque_offset"),
    "load_dependent_friction": ("coulomb_friction",),
}
# Play is elasticity with a dead zone: of the two, one is named for a joint.
EXCLUDES = {"backlash": "elasticity", "elasticity": "backlash"}
# Columns that are first order (in an angle, a compliance, a delay) leave the second; the form of a
# cut-off, of a play, and of friction where it falls, are not known exactly; a tilt shows moments of
# the first links that a level base hides, with the URDF's errors. What they leave looks like other
# effects on the same joints: shares of their energy.
_ANGLES = ("base_tilt", "encoder_offset")
_SECOND_ORDER = 1.5  # of the first order, per rad
_LEFT_AT_LEAST = {
    "base_tilt": 1e-2, "encoder_offset": 2e-3, "torque_saturation": 4e-3,
    "elasticity": 2e-2, "backlash": 1e-2, "torque_delay": 1e-2,
    "stribeck_friction": 2e-2,
}  # fmt: skip


def left_beside(kind: str, values: Array) -> float:
    """Share of the energy of an effect with these values that its column may leave or add."""
    least = _LEFT_AT_LEAST.get(kind, 0.0)
    if kind not in _ANGLES:
        return least
    return max(least, (_SECOND_ORDER * float(np.linalg.norm(values))) ** 2)


def unusual(kind: str) -> float:
    """χ² that a candidate of this kind must save beyond what chance makes of all tests."""
    return UNUSUAL.get(kind, _UNUSUAL_DEFAULT)


def tier(kind: str) -> int:
    """When a kind is asked for: 1, 2 or 3."""
    return 1 if kind in _FIRST_TIER else 3 if kind in LAST_TIER else 2


def together(one: str, other: str) -> bool:
    """Whether two kinds may be named for one joint."""
    return one != other and EXCLUDES.get(one) != other
