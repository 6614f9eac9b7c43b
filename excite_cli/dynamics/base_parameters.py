"""Base parameters by column-pivoted QR (Gautier 1991; Eq. 2).

With Y P = Q [R₁ R₂; 0 0] over random states, the r leading columns are independent and
Y φ = Y_B φ_B with Y_B = Y X (X selects those columns) and φ_B = φ₁ + R₁⁻¹ R₂ φ₂.

Columns that are rounding errors (a rotation by 180° leaves 1e-16 instead of 0) are zeroed first:
scaled to unit norm, they would count as parameters. The rest is scaled to unit norm to find the
rank. Which column stands for a group decides the condition number of Y_B (by up to twenty times):
of the orders found with and without scaling, the one with better conditioned columns is taken.
The result is checked on a second random draw. The draw has its own fixed seed, so that every run
on a robot uses the same base parameters and stacks of earlier runs fit.
"""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.linalg import lstsq, qr

from excite_cli.dynamics.regressor import (
    PARAMETERS_PER_BODY,
    Regressor,
    standard_parameter_names,
)
from excite_cli.errors import RobotError
from excite_cli.robot.model import Array, Robot

# Rotations that are right angles but for their decimals: 1.57, 1.571, 3.1416.
#
# Tilted by a thousandth of a radian, an upright axis shows parameters through gravity that nobody
# can measure, and the condition number is a million. Which parameters show is therefore decided on
# a robot whose nearly right angles are right; its dynamics keep the angles as they are given.

# 3.14 is 1.6e-3 off; a real tilt of a mount is rarely smaller, and shows as little.
_NEAR = 2e-3  # rad
_ROUNDING = 1e-12
BASE = "base_orientation"


def nearly_right(robot: Robot) -> tuple[str, ...]:
    """Joints whose frame is turned by nearly right angles, `base_orientation` for the base.

    Of a joint at a fixed base the turn contains that of the base.
    """
    found = [
        str(robot.model.names[joint])
        for joint in range(1, robot.model.njoints)
        if _differs(robot.model.jointPlacements[joint].rotation)
    ]
    if robot.floating and _differs(_base_rotation(robot)):
        found.append(BASE)
    return tuple(found)


def squared(robot: Robot, but: str | None = None) -> Robot:
    """The robot with all nearly right angles made right, but for those of the joint `but`."""
    model = robot.model.copy()
    for joint in range(1, model.njoints):
        if str(model.names[joint]) != but:
            placement = model.jointPlacements[joint]
            model.jointPlacements[joint] = pin.SE3(
                _squared(placement.rotation), placement.translation
            )
    reference = robot.reference.copy()
    if robot.floating and but != BASE:
        reference[3:7] = pin.Quaternion(_squared(_base_rotation(robot))).coeffs()
    return replace(robot, model=model, reference=reference)


def _base_rotation(robot: Robot) -> Array:
    return np.asarray(pin.Quaternion(*robot.reference[[6, 3, 4, 5]]).matrix())


def _differs(rotation: Array) -> bool:
    return bool(np.abs(_squared(rotation) - rotation).max() > _ROUNDING)


def _squared(rotation: Array) -> Array:
    """The rotation next to `rotation` (3, 3) of which no entry is nearly 0 or nearly ±1.

    Entries near 0 become 0 and rows and columns unit; any angle about a coordinate axis stays.
    """
    small = (np.abs(rotation) < _NEAR) & (rotation != 0.0)
    if not small.any():
        return np.asarray(rotation)
    near_one = np.abs(np.abs(rotation) - 1.0) < _NEAR**2
    rounded = np.where(near_one, np.sign(rotation), rotation)
    kept = np.where(np.abs(rotation) < _NEAR, 0.0, rounded)
    if np.array_equal(kept @ kept.T, np.eye(3)):
        return np.asarray(kept)
    left, _, right = np.linalg.svd(kept)
    found = left @ right
    return np.asarray(np.where(np.abs(found) < _ROUNDING, 0.0, found))


DUST = 1e-10
RANK_TOLERANCE = 1e-8
_SEED = 20170529


@dataclass(frozen=True)
class BaseParameters:
    """Which columns of Y are kept and how the others are grouped into them.

    `selection` (r,) column indices; `mapping` (r, P): φ_B = mapping φ; `residual` the largest
    relative error of Y φ − Y_B φ_B on states not used to find them; `gap` the ratio of the last
    kept to the first dropped pivot.

    `tilted`: joints (or base_orientation) turned by nearly right angles that would show further
    parameters, `hidden` of them, which are treated as not identifiable; the figures are then those
    of right angles, and `exact` is what the angles as given would show.
    """

    selection: NDArray[np.intp]
    mapping: Array
    names: tuple[str, ...]
    residual: float
    gap: float
    tilted: tuple[str, ...] = ()
    hidden: int = 0
    exact: "BaseParameters | None" = None

    @property
    def rank(self) -> int:
        """Number of base parameters."""
        return len(self.selection)

    def silent_direction(self) -> Array:
        """A change d (P,) of the standard parameters that no torque shows: Y d = 0.

        Every mass that is grouped into others is one, the kept parameters make up for it.
        """
        if self.exact is not None:
            return self.exact.silent_direction()
        direction = np.zeros(self.mapping.shape[1])
        direction[::10] = 1.0
        direction[self.selection] = 0.0
        direction[self.selection] = -self.mapping @ direction
        return direction

    def beside(self, phi: Array) -> Array:
        """φ (P,) less what the base parameters hold of it, `Y φ − Y_B mapping φ = Y beside(φ)`.

        It shows nothing, but where a base moves that stood still in the states of the selection.
        """
        rest = phi.copy()
        rest[self.selection] -= self.mapping @ phi
        return rest

    @property
    def note(self) -> str:
        """What nearly right angles would show, in words; empty where there are none."""
        if not self.tilted:
            return ""
        angles = "angles that are" if len(self.tilted) > 1 else "an angle that is"
        count = f"{self.hidden} more" if self.hidden else "some more"
        return (
            f"{', '.join(self.tilted)}: turned by {angles} right but for decimals, which show "
            f"{count} base parameter{'' if self.hidden == 1 else 's'} by rounding alone; treated "
            "as not identifiable. Write multiples of pi/2 in full (1.5707963267948966) to be rid "
            "of this note."
        )

    def in_words(self, digits: int = 3) -> tuple[str, ...]:
        """For every base parameter the standard parameters it groups, `m[a] + 0.4·mz[b] …`."""
        return tuple(_sum_in_words(row, self.names, digits) for row in self.mapping)


def find_base_parameters(robot: Robot, samples: int | None = None) -> BaseParameters:
    """Base parameters of `robot` for the measured rows and moved joints.

    What shows only because right angles were rounded does not count (`near_right_angles`).

    Raises
    ------
    RobotError
        The second draw contradicts the first (the rank is not decided), or nothing is identifiable.
    """
    if robot.held is not None:  # one choice of columns, so that motions and data stack
        kept = find_base_parameters(robot.held, samples).selection
        return base_parameters_as_given(robot, samples, kept + PARAMETERS_PER_BODY * robot.massless)
    tilted = nearly_right(robot)
    right = base_parameters_as_given(squared(robot), samples)
    if not tilted:  # columns that are equally long but for rounding are then taken in one order
        return base_parameters_as_given(robot, samples, right.selection)
    try:
        given = base_parameters_as_given(robot, samples)
        if given.rank == right.rank:
            return base_parameters_as_given(robot, samples, right.selection)
    except RobotError:
        return replace(right, tilted=tilted)
    causes = [name for name in tilted if _rank_of(squared(robot, but=name), samples) != right.rank]
    return replace(
        right, tilted=tuple(causes) or tilted, hidden=given.rank - right.rank, exact=given
    )


def _rank_of(robot: Robot, samples: int | None) -> int | None:
    try:
        return base_parameters_as_given(robot, samples).rank
    except RobotError:
        return None


def base_parameters_as_given(
    robot: Robot,
    samples: int | None = None,
    chosen: NDArray[np.intp] | None = None,
) -> BaseParameters:
    """Base parameters of the robot as it is, also those that show by decimals of angles only.

    The columns are those that are `chosen`, if there are any.

    Raises
    ------
    RobotError
        The second draw contradicts the first (the rank is not decided), or nothing is identifiable.
    """
    per_sample = len(robot.rows)
    count = samples or max(60, 4 * 10 * robot.n_bodies // per_sample + 20)
    regressor = Regressor(robot)
    first = _stack(regressor, robot, count, _SEED)
    second = _stack(regressor, robot, count, _SEED + 1)
    norms = np.linalg.norm(first, axis=0)
    alive = np.flatnonzero(norms > DUST * norms.max()) if norms.max() > 0 else np.array([], int)
    if alive.size == 0:
        raise RobotError("No inertial parameter of this robot shows in the measured rows.")
    _, triangle, order = qr(first[:, alive] / norms[alive], mode="economic", pivoting=True)
    pivots = np.abs(np.diag(triangle))
    rank = int(np.sum(pivots > RANK_TOLERANCE * pivots[0]))
    gap = float(pivots[rank - 1] / pivots[rank]) if rank < len(pivots) else float("inf")
    raw = qr(first[:, alive], mode="r", pivoting=True)[1]
    order = min((order, raw), key=lambda o: np.linalg.cond(first[:, alive[o[:rank]]]))
    kept, grouped = alive[order[:rank]], alive[order[rank:]]
    if chosen is not None:
        rank, kept, grouped = len(chosen), chosen, np.setdiff1d(alive, chosen)
    weights = np.zeros((rank, len(grouped)))
    if len(grouped):
        weights = lstsq(first[:, kept], first[:, grouped])[0]
    weights[np.abs(weights) < 1e-9 * max(1.0, np.abs(weights).max(initial=0.0))] = 0.0
    mapping = np.zeros((rank, first.shape[1]))
    mapping[np.arange(rank), kept] = 1.0
    mapping[:, grouped] = weights
    sort = np.argsort(kept)
    kept, mapping = kept[sort], mapping[sort]
    residual = float(np.linalg.norm(second - second[:, kept] @ mapping) / np.linalg.norm(second))
    if residual > 1e-6:
        raise RobotError(
            f"The base parameters are not decided: {rank} were found, but a second random draw "
            f"contradicts them (relative error {residual:.1e}, allowed 1e-6). Check the URDF for "
            "almost parallel axes, or lock the joints concerned."
        )
    return BaseParameters(kept, mapping, standard_parameter_names(robot), residual, gap)


def _stack(regressor: Regressor, robot: Robot, count: int, seed: int) -> Array:
    y = regressor.evaluate(*robot.draw_states(count, seed))
    return y.reshape(-1, y.shape[-1])


def _sum_in_words(row: Array, names: tuple[str, ...], digits: int) -> str:
    words = ""
    own_first = sorted(np.flatnonzero(row), key=lambda i: (row[i] != 1.0, i))
    for i in own_first:
        size = abs(row[i])
        factor = "" if abs(size - 1.0) < 1e-9 else f"{size:.{digits}g}·"
        sign = ("-" if row[i] < 0 else "") if not words else (" - " if row[i] < 0 else " + ")
        words += f"{sign}{factor}{names[i]}"
    return words
