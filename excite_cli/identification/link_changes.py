"""What a fit changed of every link: mass and centre of mass, how surely, and whether data said so.

Deviations are those of the Gaussian posterior of all standard parameters φ and effects θ,

    covariance = ([mapping 0; 0 1]ᵀ RᵀR [mapping 0; 0 1] + diag(1/std², 0))⁻¹

with R the triangular factor of the regression in units of its noise (samples counted by the
independent ones that they stand for) and std that of the prior as it was given: that the consistent
set is kept nearer (`consistent_near_prior`) says where to stand when the data are silent, not that
the URDF is right. That bodies are real is not used, so deviations are rather too large. Centres
c = h / m are carried over to first order at what was found; where the mass is less than its
deviation, at that much mass, since c has no deviation where m may be zero.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.pseudo_inertia import InertialPrior, moved
from excite_cli.identification.consistent import without_constraints
from excite_cli.robot.link_frame import own_link
from excite_cli.robot.model import Array, Robot

# Numbers of a body as people know them: mass, centre, and the inertia about the centre.
#
# The ten standard parameters are mass, first moments and inertia about a frame; inertias are Ixx,
# Ixy, Iyy, Ixz, Iyz, Izz.

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


# Determined: at most this share of the prior's variance is left, 0.7 of its deviation.
_DETERMINED = 0.49
_CHANGED = 2.0  # standard deviations
_LEAST_MASS = 1e-9  # kg


@dataclass(frozen=True)
class LinkParameterChange:
    """One number of a link in the URDF (`before`) and in the fit (`after`), `std` of the latter.

    `left`: share of the prior's variance that the data leave, 1 where they say nothing.
    """

    before: float
    after: float
    std: float
    left: float

    @property
    def determined(self) -> bool:
        """Whether the data say more than the prior does."""
        return self.left <= _DETERMINED

    @property
    def significant(self) -> bool:
        """Whether it moved by more than two standard deviations."""
        return abs(self.after - self.before) > _CHANGED * self.std


@dataclass(frozen=True)
class LinkChange:
    """A link and all that is fixed to it: `mass` [kg] and `center` of mass (3) [m] in its frame.

    `joint` carries it (the root joint a floating base). What the URDF gives no mass has its centre
    at the frame's origin. `marks`: what no such robot can have, one clause each; empty if there is
    nothing.
    """

    link: str
    joint: str
    mass: LinkParameterChange
    center: tuple[LinkParameterChange, LinkParameterChange, LinkParameterChange]
    marks: tuple[str, ...] = ()

    @property
    def significant(self) -> bool:
        """Whether mass or centre moved by more than two standard deviations."""
        return any(change.significant for change in (self.mass, *self.center))


def inertial_covariance(factor: Array, base: BaseParameters, prior: InertialPrior) -> Array:
    """Covariance (P, P) of standard parameters, as in the module's text.

    `factor` (p+1, p+1) of [base columns, effects' columns, τ], rows divided by their noise.
    """
    half = without_constraints(factor, base, prior)[1][: len(prior.mean)]
    return np.asarray(half @ half.T)


def link_changes(
    robot: Robot, phi: Array, covariance: Array, prior: InertialPrior
) -> tuple[LinkChange, ...]:
    """Every body of φ (P,) with its `covariance` (P, P), against the URDF's, the prior's mean."""
    changes = []
    for body in range(len(phi) // 10):
        first = slice(10 * body, 10 * body + 4)
        given = np.diag(np.square(prior.std[first]))
        before, after = _mass_and_center(prior.mean[first]), _mass_and_center(phi[first])
        slope = _slope(phi[first], float(np.sqrt(covariance[10 * body, 10 * body])))
        std = np.sqrt(np.einsum("ij,jk,ik->i", slope, covariance[first, first], slope))
        usual = np.sqrt(np.einsum("ij,jk,ik->i", slope, given, slope))
        left = np.minimum(np.square(std / usual), 1.0)
        mass, x, y, z = (
            LinkParameterChange(*map(float, each))
            for each in zip(before, after, std, left, strict=True)
        )
        link, joint = body_names(robot, body)
        changes.append(LinkChange(link, joint, mass, (x, y, z)))
    return tuple(changes)


def body_names(robot: Robot, body: int) -> tuple[str, str]:
    """Link and joint that stand for a body of φ; those of the root for a floating base."""
    joint = body + 1
    moved = joint - robot.first_joint
    if moved >= 0:
        return own_link(robot.tree, moved).name, robot.tree.joint_names[moved]
    frames = [str(f.name) for f in robot.model.frames if int(f.parentJoint) == joint]
    root = str(robot.model.names[joint])
    return next((name for name in frames if name != root), root), root


def _mass_and_center(four: Array) -> Array:
    """m, c (4,) of m, h."""
    mass = float(four[0])
    center = four[1:] / mass if mass > _LEAST_MASS else np.zeros(3)
    return np.concatenate([[mass], center])


def _slope(four: Array, least: float) -> Array:
    """∂(m, c)/∂(m, h) (4, 4), at a mass of `least` [kg] at least."""
    mass = max(float(four[0]), least, _LEAST_MASS)
    slope = np.eye(4)
    slope[1:, 0] = -_mass_and_center(four)[1:] / mass
    slope[1:, 1:] /= mass
    return slope
