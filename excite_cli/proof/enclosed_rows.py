"""Regressor rows over whole intervals of time: what any inertia would need of joints and ground.

Torque of joint i, wrench of the ground and first moment of mass are linear in the ten standard
parameters of every body. In the axes of body b, with ω, α and a (its origin's acceleration less
gravity), the force and moment that b needs, taken along u (moment) and w (force), are

    m:      w·a
    m c:    ω×(ω×w) − α×w + a×u
    I:      u·(I α) + (u×ω)·(I ω)

For revolute joint i: u = z_i, w = z_i × (p_b − p_i); prismatic: u = 0, w = z_i; for the wrench of
the ground about a point o: u = e_k, w = e_k × (p_b − o) (moments) and u = 0, w = e_k (forces).
"""

import numpy as np

from excite_cli.dynamics.uncertain_inertias import InertiaUncertainty, Piece
from excite_cli.proof.enclosed_motion import EnclosedMotion, turned_back
from excite_cli.proof.taylor import Array, Taylor, cross, dot, joined, stacked

# The least that linear functionals of uncertain inertias can take over whole intervals of time.
#
# A functional y(s) of φ, enclosed over an interval, is at least
#
#     c·y(s) − ‖D y(s)‖₁ − ‖E y(s)‖₂
#
# for every admitted φ (`dynamics.uncertain_inertias`). Entries of D y that keep their sign over the
# interval are ± themselves, so that they join c·y as one polynomial; the others count with the
# largest size they can have, which is small since they cross zero. With e the direction of E y in
# the middle, ‖E y‖₂ ≤ e·E y + ‖the rest‖² / (2 e·E y).


def least_of(y: Taylor, uncertainty: InertiaUncertainty, beside: Taylor | None = None) -> Array:
    """Lower bounds (T, m) on y·φ + b throughout each interval, for functionals y (T, m, P).

    `beside`: b (T, m), which changes with time as y does; None: zero.
    """
    return np.max([_piece_least(y, piece, beside) for piece in uncertainty.pieces], axis=0)


def _piece_least(y: Taylor, piece: Piece, beside: Taylor | None) -> Array:
    middle = y.through(piece.center[None])[..., 0]
    if beside is not None:
        middle = middle + beside
    if np.any(piece.corners):
        spread = y.scaled(piece.corners) if piece.corners.ndim == 1 else y.through(piece.corners)
        middle = middle - _sum_of_sizes(spread)
    least = middle.lower()
    if len(piece.axes):
        least = (middle - _length(y.through(piece.axes))).lower()
    return least


def _sum_of_sizes(z: Taylor) -> Taylor:
    """An upper bound (T, m) on ‖z‖₁ (T, m, P), as a polynomial and a radius."""
    low, high = z.lower(), z.upper()
    sign = np.where(low >= 0, 1.0, np.where(high <= 0, -1.0, 0.0))
    crossing = np.where(sign == 0, np.maximum(-low, high), 0.0)
    signed = z.scaled(sign).summed(-1)
    return signed + crossing.sum(axis=-1)


def _length(z: Taylor) -> Taylor:
    """An upper bound (T, m) on ‖z‖₂ (T, m, P), as a polynomial and a radius."""
    size = np.linalg.norm(z.center, axis=-1, keepdims=True)
    direction = z.center / np.where(size > 0, size, 1.0)
    along = z.times(Taylor.constant(direction)).summed(-1)
    parallel = Taylor(along.terms[..., None], along.radius[..., None]).scaled(direction)
    rest = z - parallel
    across = np.linalg.norm(rest.size, axis=-1)
    least = along.lower()
    beyond = np.where(
        least > across,
        across**2 / np.where(least > across, 2 * least, 1.0),
        across + 2 * np.maximum(-least, 0.0),  # |along| may be −along there
    )
    return along + beyond


_PER_BODY = 10


def torque_rows(motion: EnclosedMotion) -> Taylor:
    """Rows (T, n, 10·n_bodies) of the torques [N·m or N] of the moved joints."""
    robot = motion.robot
    model, first = robot.model, int(robot.moved[0])
    blocks = []
    for body in range(1, model.njoints):
        carriers = [
            int(joint)
            for joint in model.supports[body]
            if joint > 0 and model.joints[int(joint)].idx_v >= first
        ]
        terms = np.zeros((3, motion.count, robot.tree.n, _PER_BODY))
        radius = np.zeros((motion.count, robot.tree.n, _PER_BODY))
        if carriers:
            columns = _columns(motion, body, *_along_joints(motion, body, carriers))
            places = [model.joints[joint].idx_v - first for joint in carriers]
            terms[:, :, places], radius[:, places] = columns.terms, columns.radius
        blocks.append(Taylor(terms, radius))
    rows = joined(blocks, axis=-1)
    return rows if robot.coupling is None else combined(robot.coupling.matrix.T, rows)


def ground_rows(motion: EnclosedMotion, about: Array) -> Taylor:
    """Rows (T, 6, 10·(1 + n_bodies)) of force and moment about a point [N, N·m], world axes.

    Bodies from 0, what is fixed to the world, on.
    """
    axes = np.eye(3)
    blocks = []
    for body in range(motion.robot.model.njoints):
        way = motion.placements[body][1] - about
        zero = Taylor.constant(np.zeros((motion.count, 3)))
        along = [Taylor.constant(np.tile(axis, (motion.count, 1))) for axis in axes]
        moments = stacked([zero, zero, zero, *along], axis=-2)
        forces = stacked([*along, *(cross(axis, way) for axis in along)], axis=-2)
        blocks.append(_columns(motion, body, moments, forces))
    return joined(blocks, axis=-1)


def mass_rows(motion: EnclosedMotion) -> Taylor:
    """Rows (T, 3, 10·(1 + n_bodies)) of mass M, and of Σ m x and Σ m y [kg, kg·m] in the world."""
    blocks = []
    one = np.zeros((motion.count, 1, _PER_BODY))
    one[..., 0] = 1.0
    for turn, origin in motion.placements:
        rest = Taylor.constant(np.zeros((motion.count, 2, 6)))
        moments = joined([origin[:, :2, None], turn[:, :2], rest], axis=-1)
        blocks.append(joined([Taylor.constant(one), moments], axis=-2))
    return joined(blocks, axis=-1)


def combined(functionals: Array, rows: Taylor) -> Taylor:
    """a·r (T, m, P) for functionals a (m, r) of rows r (T, r, P)."""
    return Taylor(functionals @ rows.terms, np.abs(functionals) @ rows.radius)


def _along_joints(motion: EnclosedMotion, body: int, carriers: list[int]) -> tuple[Taylor, Taylor]:
    """Moment and force directions (T, K, 3) of the joints that carry a body."""
    moments, forces = [], []
    origin = motion.placements[body][1]
    for joint in carriers:
        axis, own, sliding = motion.column(joint)
        if sliding:
            moments.append(Taylor.constant(np.zeros((motion.count, 3))))
            forces.append(axis)
        else:
            moments.append(axis)
            forces.append(cross(axis, origin - own))
    return stacked(moments, axis=-2), stacked(forces, axis=-2)


def _columns(motion: EnclosedMotion, body: int, moments: Taylor, forces: Taylor) -> Taylor:
    """Columns (T, K, 10) of one body for directions (T, K, 3) in world axes."""
    turn, rates = motion.placements[body][0], motion.rates[body]
    u, w = turned_back(turn, moments), turned_back(turn, forces)
    spin = turned_back(turn, rates.spin)[:, None]
    spin_rate = turned_back(turn, rates.spin_rate)[:, None]
    acceleration = turned_back(turn, rates.acceleration)[:, None]
    mass = dot(w, acceleration)[..., None]
    moment = cross(spin, cross(spin, w)) - cross(spin_rate, w) + cross(acceleration, u)
    other = cross(u, spin)
    inertia = [
        _product(u, spin_rate, i, j) + _product(other, spin, i, j)
        for i, j in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))
    ]
    return joined([mass, moment, stacked(inertia)], axis=-1)


def _product(a: Taylor, b: Taylor, i: int, j: int) -> Taylor:
    """a_i b_j + a_j b_i, or a_i b_i where i = j."""
    first = a[..., i].times(b[..., j])
    return first if i == j else first + a[..., j].times(b[..., i])
