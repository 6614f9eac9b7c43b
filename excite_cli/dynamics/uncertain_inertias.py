"""What the inertias may be, and the least that a linear functional of them can take.

φ (P,) holds the ten parameters of every body of the whole robot, what stands still (body 0) first.
Before identification φ lies in a box |φ − φ_URDF| ≤ ρ. A fit bounds the base parameters φ_B = X φ
by an ellipsoid (φ_B − φ̂_B)ᵀ P⁻¹ (φ_B − φ̂_B) ≤ κ². For any split y = y₁ + Xᵀ y₂ and every φ in both

    y·φ ≥ y₁·φ_URDF − ρ·|y₁| + y₂·φ̂_B − κ ‖P^½ y₂‖,

and y₂ = G y with G = (X R² Xᵀ + λ κ² P)⁻¹ X R², R = diag ρ, is the best split up to the shape of
the sets: for λ → ∞ all is left to the box, for λ → 0 as much as can be to the ellipsoid. So the
least of y·φ is bounded by the greatest of a few pieces c·y − ‖D y‖₁ − ‖E y‖₂, concave in y:

    c = φ_URDF + Gᵀ (φ̂_B − X φ_URDF),      D = R (1 − Xᵀ G),      E = κ P^½ G.

For the box alone this is exact. The derivative of a piece with respect to y is c − Dᵀ sign(D y) −
Eᵀ E y / ‖E y‖: the worst inertias (for a piece with both terms, as good as such for derivatives).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from excite_cli.config.spec import BodyUncertaintySpec, UncertaintySpec
from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.regressor import Regressor
from excite_cli.dynamics.whole_robot import (
    GroundWrench,
    body_names,
    drawn_states,
    whole_parameters,
)
from excite_cli.errors import ConfigError, FileError, nearest
from excite_cli.robot.model import Array, Robot

# Weights λ of the ellipsoid against the box.
_SPLITS = (1e-3, 0.1, 3.0)
# States from which typical functionals are taken, rounds of reweighting, and its least residual.
_DRAWN, _REWEIGHTED, _DEAREST = 12, 12, 1e-3
# Mean share of the width of an interval that may be lost by leaving pieces out.
_LOST = 0.03
# Shares of the largest eigenvalue below which a direction counts as none.
_NOTHING = 1e-13
# Weights of the ellipsoid against the box when both are to be met, and how far inside (squared).
_AGREEMENT = (1.0, 0.1, 1e-2, 1e-3, 1e-4, 1e-6)
_WELL_INSIDE = 0.5


@dataclass(frozen=True)
class FitKnowledge:
    """What a fit knows: base parameters `values` (r,) with their `covariance` (r, r).

    `names` (r,) of the base parameters, `fingerprint` of the robot, `source` for messages. The
    covariance holds infinity on the diagonal for what the data did not show.
    """

    values: Array
    covariance: Array
    names: tuple[str, ...]
    fingerprint: str
    source: str


@dataclass(frozen=True)
class Piece:
    """A bound y·φ ≥ c·y − ‖D y‖₁ − ‖E y‖₂: `center` c (P,), `corners` D, `axes` E (e, P).

    `corners` is a vector (P,) if D is diagonal, else (P, P).
    """

    center: Array
    corners: Array
    axes: Array

    def middle_and_slack(self, y: Array) -> tuple[Array, Array]:
        """c·y and ‖D y‖₁ + ‖E y‖₂, each (…,), for functionals y (…, P)."""
        if self.corners.ndim == 1:
            slack = np.abs(y) @ self.corners
        else:
            slack = np.abs(y @ self.corners.T).sum(axis=-1)
        if len(self.axes):
            slack = slack + np.linalg.norm(y @ self.axes.T, axis=-1)
        return np.asarray(y @ self.center), np.asarray(slack)

    def least(self, y: Array) -> Array:
        """The bound (…,) for functionals y (…, P)."""
        middle, slack = self.middle_and_slack(y)
        return np.asarray(middle - slack)

    def worst(self, y: Array) -> Array:
        """Derivative (…, P) of the bound with respect to y."""
        if self.corners.ndim == 1:
            change = np.sign(y) * self.corners
        else:
            change = np.sign(y @ self.corners.T) @ self.corners
        if len(self.axes):
            reach = y @ self.axes.T
            length = np.linalg.norm(reach, axis=-1, keepdims=True)
            change = change + reach @ self.axes / np.where(length > 0, length, 1.0)
        return np.asarray(self.center - change)

    def of(self, part: slice | NDArray[np.intp]) -> "Piece":
        """The piece for functionals that are zero but for `part` of φ."""
        corners = self.corners[part] if self.corners.ndim == 1 else self.corners[:, part]
        return Piece(self.center[part], corners, self.axes[:, part])


@dataclass(frozen=True)
class InertiaUncertainty:
    """Bounds on linear functionals of φ; the box comes first among `pieces`."""

    pieces: tuple[Piece, ...]

    @classmethod
    def none(cls, robot: Robot) -> "InertiaUncertainty":
        """The URDF's inertias and no others."""
        phi = whole_parameters(robot)
        return cls((Piece(phi, np.zeros_like(phi), np.zeros((0, len(phi)))),))

    def least(self, y: Array) -> Array:
        """A lower bound (…,) on y·φ over all admitted φ, for functionals y (…, P)."""
        return np.max([piece.least(y) for piece in self.pieces], axis=0)

    def least_both(self, y: Array) -> tuple[Array, Array]:
        """`least` of y and of −y."""
        parts = [piece.middle_and_slack(y) for piece in self.pieces]
        below = np.max([middle - slack for middle, slack in parts], axis=0)
        return below, np.max([-middle - slack for middle, slack in parts], axis=0)

    def worst(self, y: Array) -> Array:
        """φ* (K, P) for functionals y (K, P): y·φ* = `least`, and its derivative is φ*."""
        if len(self.pieces) == 1:
            return self.pieces[0].worst(y)
        chosen = np.argmax([piece.least(y) for piece in self.pieces], axis=0)
        phi = np.empty_like(y)
        for index, piece in enumerate(self.pieces):
            rows = chosen == index
            if rows.any():
                phi[rows] = piece.worst(y[rows])
        return phi

    def sharpest(self, y: Array) -> "InertiaUncertainty":
        """Only the pieces that matter for functionals like y (K, P); the bounds stay bounds.

        Pieces are taken one after the other until the mean width of the intervals of y·φ is
        within a few hundredths of that of all pieces.
        """
        if len(self.pieces) == 1:
            return self
        seen = [piece.middle_and_slack(y) for piece in self.pieces]
        low = np.array([middle - slack for middle, slack in seen])
        high = np.array([middle + slack for middle, slack in seen])
        best = high.min(axis=0) - low.max(axis=0)
        counted = best > _NOTHING * np.abs(low).max()
        if not counted.any():
            return InertiaUncertainty(self.pieces[:1])
        taken: list[int] = []
        lost = np.inf
        while lost > _LOST:
            sets = [[*taken, index] for index in range(len(self.pieces))]
            widths = [(high[at].min(axis=0) - low[at].max(axis=0))[counted] for at in sets]
            losses = [float(np.mean(width / best[counted])) - 1.0 for width in widths]
            taken.append(int(np.argmin(losses)))
            lost = min(losses)
        return InertiaUncertainty(tuple(self.pieces[index] for index in sorted(taken)))

    def of(self, part: slice | NDArray[np.intp]) -> "InertiaUncertainty":
        """The same bounds for functionals that are zero but for `part` of φ."""
        return InertiaUncertainty(tuple(piece.of(part) for piece in self.pieces))

    def of_moving_bodies(self) -> "InertiaUncertainty":
        """For functionals of φ (10·n_bodies,), what stands still left out."""
        return self.of(slice(10, None))

    def of_masses(self) -> "InertiaUncertainty":
        """For functionals of m, m c (4,) per body, from what stands still on."""
        size = len(self.pieces[0].center)
        return self.of(np.flatnonzero(np.arange(size) % 10 < 4))


def inertia_uncertainty(
    spec: UncertaintySpec, robot: Robot, base: BaseParameters, fit: FitKnowledge | None = None
) -> InertiaUncertainty:
    """The set that `spec` states, narrowed by what a `fit` knows.

    Where a fit contradicts the box, the box is widened to hold the inertias that the fit asks for
    and are nearest to the URDF's.

    Raises
    ------
    ConfigError
        A name under `bodies` is no body of the robot.
    FileError
        The fit belongs to another robot.
    """
    phi, reach = whole_parameters(robot), box(spec, robot)
    nothing = np.zeros((0, len(phi)))
    if fit is None:
        return InertiaUncertainty((Piece(phi, reach, nothing),))
    mapping, values, covariance = _known(robot, base, fit)
    gap = values - mapping @ phi
    narrow = spec.sigmas**2 * covariance
    reach = _widened(reach, mapping, narrow, gap)
    pieces = [Piece(phi, reach, nothing)]
    spread = np.square(reach)[:, None] * mapping.T
    wide = mapping @ spread
    eigenvalues, vectors = np.linalg.eigh(narrow)
    root = np.sqrt(np.maximum(eigenvalues, 0.0))[:, None] * vectors.T
    gains = [_solved(wide + split * narrow, spread.T) for split in _SPLITS]
    gains += [_fitted_gain(y, gains[0], mapping, reach, narrow) for y in _typical(robot)]
    for gain in gains:
        left = np.eye(len(phi)) - mapping.T @ gain
        pieces.append(Piece(phi + gain.T @ gap, reach[:, None] * left, root @ gain))
    return InertiaUncertainty(tuple(pieces))


def _typical(robot: Robot) -> Iterator[Array]:
    """Functionals (K, P) as constraints ask them: loads on the ground, wrenches, torques."""
    states = drawn_states(robot, _DRAWN, 0)
    wrench = GroundWrench(robot).regressor(states)
    yield wrench[:, 2]
    yield wrench.reshape(-1, wrench.shape[-1])
    torque = Regressor(replace(robot, rows=robot.moved)).evaluate(states.q, states.v, states.a)
    yield np.pad(torque.reshape(-1, torque.shape[-1]), ((0, 0), (10, 0)))


def _fitted_gain(y: Array, gain: Array, mapping: Array, reach: Array, narrow: Array) -> Array:
    """G (k, P) whose split suits functionals like y (K, P), by reweighted least squares.

    With weights w = ρ/|y₁| and v = 1/‖κ P^½ y₂‖ (means over the functionals), the least of
    Σ w y₁² + v ‖κ P^½ y₂‖² is nearer to that of ρ·|y₁| + κ ‖P^½ y₂‖.
    """
    y = y / np.maximum(np.abs(y) @ reach, _NOTHING)[:, None]
    for _ in range(_REWEIGHTED):
        known = y @ gain.T
        left = np.abs(y - known @ mapping).mean(axis=0)
        length = np.sqrt(np.maximum(np.einsum("kr,rs,ks->k", known, narrow, known), 0.0)).mean()
        # A parameter that is hardly left over must not become infinitely dear.
        weights = reach / np.maximum(left, _DEAREST * float(np.abs(y).mean()) + _NOTHING)
        weighed = weights[:, None] * mapping.T
        matrix = mapping @ weighed + narrow / max(float(length), _NOTHING)
        gain = _solved(matrix, weighed.T)
    return gain


def _widened(reach: Array, mapping: Array, narrow: Array, gap: Array) -> Array:
    """ρ (P,), larger where what agrees with box and fit lies outside the box.

    The least change of φ (in units of ρ) that brings the base parameters into the ellipsoid must be
    admitted, or no inertia would be, and bounds over an empty set say nothing.

    Raises
    ------
    ConfigError
        Bounds of zero keep any such change out.
    """
    spread = np.square(reach)[:, None] * mapping.T
    for share in _AGREEMENT:
        gain = _solved(mapping @ spread + share * narrow, spread.T).T
        moved = gain @ gap
        left = gap - mapping @ moved
        if float(left @ _solved(narrow, left)) <= _WELL_INSIDE:
            break
    exact = _solved(mapping @ spread, spread.T).T
    rest = gap - mapping @ (exact @ gap)
    if float(rest @ _solved(narrow, rest)) > _WELL_INSIDE:
        raise ConfigError(
            "uncertainty.fit: no inertias within the bounds agree with the fit, since some bounds "
            "are zero (shares of zero, or a link without inertia in the URDF). Give wider ones "
            "under uncertainty, or under uncertainty.bodies for single bodies."
        )
    unsure = np.sqrt(np.maximum(np.einsum("pk,kl,pl->p", gain, narrow, gain), 0.0))
    return np.where(np.abs(moved) > reach, np.abs(moved) + unsure, reach)


def box(spec: UncertaintySpec, robot: Robot) -> Array:
    """Half widths ρ (P,) of the box, see `BodyUncertaintySpec`.

    Raises
    ------
    ConfigError
        A name under `bodies` is no body of the robot.
    """
    names = body_names(robot)
    bounds: list[BodyUncertaintySpec] = [spec] * len(names)
    for given, bound in spec.bodies.items():
        at = next((b for b, known in enumerate(names) if given in known), None)
        if at is None:
            known = [name for of_body in names for name in of_body[:1]]
            every = [name for of_body in names for name in of_body]
            locked = (
                " It is locked, and its body is part of the one that carries it."
                if given in robot.locked
                else nearest(given, every)
            )
            raise ConfigError(
                f"uncertainty.bodies: the robot has no moved joint '{given}'.{locked} Bodies: "
                f"{', '.join(known)}."
            )
        bounds[at] = bound
    phi = whole_parameters(robot).reshape(-1, 10)
    return np.concatenate([half_widths(ten, bound) for ten, bound in zip(phi, bounds, strict=True)])


def half_widths(ten: Array, bound: BodyUncertaintySpec) -> Array:
    """ρ (10,) of one body with parameters `ten` (10,): the least box that holds all such bodies.

    m ∈ m₀(1 ± μ), c ∈ c₀ ± δ, inertia about the centre ± ι; then δ(m c) and the parallel axis
    m (|c|² 1 − c cᵀ) have products of two and three uncertain numbers, taken by intervals.
    """
    mass = abs(float(ten[0]))
    center = ten[1:4] / ten[0] if mass > 0 else np.zeros(3)
    low, high = max(1.0 - bound.mass, 0.0) * mass, (1.0 + bound.mass) * mass
    shift = bound.center_of_mass
    squares = np.array(
        [np.maximum(np.abs(center) - shift, 0.0) ** 2, (np.abs(center) + shift) ** 2]
    )
    first = high * shift + bound.mass * mass * np.abs(center)
    parallel_axis = mass * (center @ center - np.square(center))
    about = np.abs(ten[[4, 6, 9]] - parallel_axis)
    widths = []
    for k, j in _PAIRS:
        own = bound.inertia * (about[k] + about[j]) / 2
        if k == j:
            others = [i for i in range(3) if i != k]
            least, most = (squares[side, others].sum() for side in (0, 1))
            nominal = float(np.square(center[others]).sum())
            parallel = max(high * most - mass * nominal, mass * nominal - low * least)
        else:
            ends = [
                (center[k] + a * shift) * (center[j] + b * shift) for a in (-1, 1) for b in (-1, 1)
            ]
            products = [m * end for m in (low, high) for end in ends]
            parallel = max(abs(product - mass * center[k] * center[j]) for product in products)
        sure = bound.mass == bound.center_of_mass == 0.0  # or rounding would be left
        widths.append(own + (0.0 if sure else parallel))
    return np.concatenate([[bound.mass * mass], first, widths])


_PAIRS = (0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)  # order of Ixx, Ixy, Iyy, Ixz, Iyz, Izz


def _known(robot: Robot, base: BaseParameters, fit: FitKnowledge) -> tuple[Array, Array, Array]:
    """Mapping (k, P), values (k,) and covariance (k, k) of the base parameters that were shown."""
    names = tuple(base.names[index] for index in base.selection)
    if fit.fingerprint != robot.fingerprint() or fit.names != names:
        raise FileError(
            f"uncertainty.fit: {fit.source} was made for another robot, other moved joints, "
            "posture or rows. Identify with this config, or leave it out."
        )
    shown = np.isfinite(np.diag(fit.covariance))
    still = np.zeros((int(shown.sum()), 10))
    mapping = np.hstack([still, base.mapping[shown]])
    return mapping, fit.values[shown], fit.covariance[np.ix_(shown, shown)]


def _solved(matrix: Array, right: Array) -> Array:
    """M⁺ b for a symmetric M ≥ 0 whose rows differ in size by powers of ten."""
    scale = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    scale = np.where(scale > 0, scale, 1.0)
    values, vectors = np.linalg.eigh(matrix / np.outer(scale, scale))
    seen = values > _NOTHING * max(float(values[-1]), 1e-300)
    inverse = np.where(seen, 1.0 / np.where(seen, values, 1.0), 0.0)
    turned = (right.T / scale) @ vectors * inverse
    return np.asarray((turned @ vectors.T / scale).T)
