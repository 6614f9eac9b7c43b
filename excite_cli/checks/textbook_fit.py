"""How well one textbook model explains some data, if the robot was set up in some way.

With a set-up s the torque of joint j is taken as

    τ_j = Y_j(s) (φ + D z) + X_j c_j,      X_j = [v, sgn v, |load| sgn v, a, 1],

with the URDF's parameters φ, their standard deviations D (masses and inertias 30 %, centres of mass
3 cm; all torques together 30 %), and c ≥ 0 but for the offset, since friction takes energy. z and c
minimise

    L(s) = Σ_j [ r_j² / (2 s_j²) + log s_j ] + ½ ‖z‖²,

r_j the share of the joint's torque (RMS over RMS) that is left, and s_j how large it is taken to
be: as large as it is, at least `FLOOR`. That is minus the logarithm of the posterior with one
observation for each joint, not one for each sample: what the set-up should explain must not be
explained by bodies that nobody built. At the minimum L = Σ_j log s_j + ½ ‖z‖² and a constant.
Set-ups are compared by L: the one with which the same model explains far more is the truth.

Instants in which a joint stands or reverses do not count: what it then carries is up to its
friction. Friction that follows a change of direction late looks like torques that are late. Where
the two are compared, X has directions b that follow that of the motion over some way, too
(`with_late_friction`).
"""

from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag

from excite_cli.checks.setup import FEWEST, Samples, Setup
from excite_cli.dynamics.pseudo_inertia import inertial_prior
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.measurement.dataset import Mask
from excite_cli.robot.model import Array, Robot

_UNCERTAIN, _CENTER = 0.3, 0.03  # share of masses and inertias; m by which centres of mass are off
_SCALE = 0.3  # share by which all torques may be off together, as currents' constants are
_TOOL, _REACH = 0.3, 0.2  # mass of a tool in that of the robot; m to its centre
# Standard deviations by which all torques together may be smaller: a body of no mass fits nothing,
# but beside torques in another unit, which then are no one's, anything does.
_LIGHTEST = -1.5
FLOOR = 0.02  # shares below this are noise and effects: no difference is made there
_ROUNDS, _SETTLED = 6, 0.02  # of the weights; in log
_FIRST = 0.3  # s_j to begin with
_ROUNDING = 1e-13
_STATES, _SEEN = 40, 1e-9  # states; share of the largest singular value from which one counts
_RIDGE = 1e-9  # of a column of X, whose norm is 1
_TRIMS = 3  # fits, each without the instants that the one before leaves most of


@dataclass(frozen=True)
class TextbookShares:
    """`shares` (n,) of the torques that are left, 1 where not `judged` (n,); `loss` L.

    `z` (r + 1,): by how many standard deviations bodies, and all torques, are others than the URDF
    says; `passive` (n, k): coefficients c of X.
    """

    shares: Array
    judged: Mask
    loss: float
    z: Array
    passive: Array

    @property
    def bent(self) -> float:
        """½ ‖z‖²: how unlikely the bodies are that explain the data."""
        return float(0.5 * self.z @ self.z)

    @property
    def left(self) -> float:
        """Share of the torques that is left, in the median of the joints that can be judged."""
        return float(np.median(self.shares[self.judged])) if self.judged.any() else 0.0


class TextbookFit:
    """Fits the textbook's model to samples of a robot, for any set-up.

    `floor`: shares below which no difference is made. `loose`: times the usual deviations by which
    bodies may be others than the URDF's.
    """

    def __init__(
        self, robot: Robot, samples: Samples, floor: float = FLOOR, loose: float = 1.0
    ) -> None:
        self.robot, self.samples, self._floor = robot, samples, floor
        self.phi = standard_parameters(robot)
        spread = inertial_prior(robot, self.phi, _UNCERTAIN).std.reshape(-1, 10).copy()
        own = _UNCERTAIN * self.phi.reshape(-1, 10)[:, 1:4]
        spread[:, 1:4] = np.hypot(own, _CENTER * spread[:, :1] / _UNCERTAIN)
        self._scale, self._late = loose * _SCALE, False
        self._basis = loose * _seen(robot, self.phi, spread.ravel())

    def __call__(self, setup: Setup) -> TextbookShares:
        """How well the data fit, set up so."""
        return self._fitted(setup, self.columns(setup), self.phi, self._basis_of(setup))

    @cached_property
    def with_late_friction(self) -> "TextbookFit":
        """The same model with friction that follows a change of direction late."""
        other = copy(self)
        other._late = True
        return other

    def gravity(self, setup: Setup, z: Array | None = None) -> Array:
        """The direction (3,) of gravity that fits best beside the rest, at the bodies of `z`.

        What is missing of gravity is as uncertain as gravity is large.
        """
        phi = self.phi if z is None else self.bodies(setup, z)
        columns = np.concatenate([self.columns(setup), self.weight(setup, phi)], axis=2)
        size = float(np.linalg.norm(setup.gravity))
        basis = block_diag(self._basis_of(setup), size * np.eye(3))
        found = self._fitted(setup, columns, np.append(self.phi, np.zeros(3)), basis)
        gravity = setup.gravity + size * found.z[-4:-1]
        return np.asarray(gravity / max(float(np.linalg.norm(gravity)), 1e-9))

    def bodies(self, setup: Setup, z: Array) -> Array:
        """Parameters φ (P,) of bodies that are so many standard deviations off, z (r + 1,)."""
        return np.asarray((1.0 + self._scale * z[-1]) * self.phi + self._basis_of(setup) @ z[:-1])

    def counted(self, setup: Setup) -> Mask:
        """Instants (T, n) that count of each joint."""
        known, moves = self.samples.known[:, setup.tau_order], self.samples.moves[:, setup.q_order]
        return np.asarray(known & moves)

    def columns(self, setup: Setup) -> Array:
        """Y (T, n, P) of the robot so mounted and so moved."""
        q, v, a = setup.motion(self.samples)
        robot = self.robot.with_gravity(setup.gravity)
        return setup.of_motors(RigidBody(robot, self.phi, q, v, a).regressor)

    def weight(self, setup: Setup, phi: Array | None = None) -> Array:
        """Torque (T, n, 3) of bodies φ under 1 m/s² along each axis."""
        q = setup.motion(self.samples)[0]
        phi, rest = self.phi if phi is None else phi, np.zeros_like(q)
        turned = [self.robot.with_gravity(axis) for axis in np.eye(3)]
        along = [RigidBody(each, phi, q, rest, rest).load for each in turned]
        return setup.of_motors(np.stack(along, axis=-1))

    def left(self, setup: Setup, found: TextbookShares) -> Array:
        """Torque (T, n) that bodies and friction leave, those of these or of other samples."""
        load = self.columns(setup) @ self.bodies(setup, found.z)
        columns = self.passive(setup)
        passive = [x @ own for x, own in zip(columns, found.passive, strict=True)]
        return np.asarray(self._rows(setup)[3] - load - np.column_stack(passive))

    def passive(self, setup: Setup) -> list[Array]:
        """X (T, k) of every joint: friction, rotor and offset."""
        v, a, _, _, bristles = self._rows(setup)
        load = self.columns(setup) @ self.phi
        return [_passive(v[:, j], a[:, j], load[:, j], bristles[:, j]) for j in range(v.shape[1])]

    def missed(self, setup: Setup, found: TextbookShares) -> Array:
        """Shares (n,) of these torques that bodies and friction of other samples miss.

        `nan` where either has none that count.
        """
        counted, torque = self.counted(setup), setup.torque(self.samples)
        left, shares = self.left(setup, found), np.full(len(found.shares), np.nan)
        for j in np.flatnonzero(found.judged & (counted.sum(axis=0) >= FEWEST)):
            at = counted[:, j]
            rms = np.sqrt(np.mean(left[at, j] ** 2))
            shares[j] = rms / max(float(np.std(torque[at, j])), 1e-9)
        return shares

    def without_worst(self, setup: Setup, share: float) -> "TextbookFit":
        """The same without the instants that fit worst, a share of all (least trimmed squares)."""
        fit = self
        for _ in range(_TRIMS):
            found = fit(setup)
            counted = self.counted(setup) & found.judged
            torque = np.where(counted, setup.torque(self.samples), 0.0)
            size = np.square(torque).sum(axis=0) / np.maximum(counted.sum(axis=0), 1)
            left = np.square(self.left(setup, found)) / np.maximum(size * found.shares**2, 1e-18)
            wrong = np.where(counted, left, 0.0).sum(axis=1)
            kept = wrong <= np.quantile(wrong, 1.0 - share)
            samples = replace(self.samples, known=self.samples.known & kept[:, None])
            fit = copy(self)
            fit.samples = samples
        return fit

    def _fitted(self, setup: Setup, columns: Array, phi: Array, basis: Array) -> TextbookShares:
        bodies = (phi, basis, self._scale, self._floor)
        return _explained(columns, bodies, self._rows(setup), self.counted(setup))

    def _basis_of(self, setup: Setup) -> Array:
        """D V, and beside it the ten parameters of every tool, as wide as tools are heavy."""
        mass = _TOOL * float(np.abs(self.phi[::10]).sum())
        tools = np.zeros((len(self.phi), 10 * len(setup.loaded)))
        for k, body in enumerate(setup.loaded):
            sizes = mass * np.repeat([1.0, _REACH, _REACH**2], [1, 3, 6])
            tools[10 * body : 10 * body + 10, 10 * k : 10 * k + 10] = np.diag(sizes)
        return np.hstack([self._basis, tools])

    def _rows(self, setup: Setup) -> tuple[Array, Array, Array, Array, Array]:
        """v, a, the torque, that with the weight which was taken off it, (T, n); b (T, n, 3)."""
        _, v, a = setup.motion(self.samples)
        torque = setup.torque(self.samples)
        whole = torque + self.weight(setup) @ setup.gravity if setup.weightless else torque
        bristles = setup.bristles(self.samples)[:, :, : None if self._late else 0]
        return setup.turned_by(v), setup.turned_by(a), torque, whole, bristles


def _seen(robot: Robot, phi: Array, spread: Array) -> Array:
    """D V (P, r): directions of D z that show in some torque, however the robot is mounted.

    Elsewhere z stays zero. They are those of Y D at random states, under gravity along each axis.
    """
    rng = np.random.default_rng(0)
    states = rng.uniform(-np.pi, np.pi, (3, _STATES, robot.n))
    mounted = [robot.with_gravity(axis) for axis in np.eye(3)]
    rows = [RigidBody(each, phi, *states).regressor.reshape(-1, len(phi)) for each in mounted]
    _, sizes, directions = np.linalg.svd(np.vstack(rows) * spread, full_matrices=False)
    return np.asarray((directions[sizes > _SEEN * sizes[0]] * spread).T)


def _passive(v: Array, a: Array, load: Array, bristles: Array) -> Array:
    """X (T, 5 or 8)."""
    way = np.sign(v)
    return np.column_stack([v, way, np.abs(load) * way, a, bristles, np.ones(len(v))])


def _explained(
    columns: Array,
    bodies: tuple[Array, Array, float, float],
    rows: tuple[Array, ...],
    counted: Mask,
) -> TextbookShares:
    """Of the `whole` torque, in shares of the recorded one: `rows` are v, a and these, (T, n)."""
    judged = np.count_nonzero(counted, axis=0) >= FEWEST
    phi, basis, scale, floor = bodies
    grams, scales = [], []
    for j in np.flatnonzero(judged):
        at = counted[:, j]
        v, a, torque, whole, bristles = (x[at, j] for x in rows)
        size = float(np.sum(np.square(torque - torque.mean())))
        if not size > 0.0:
            judged[j] = False
            continue
        load = columns[at, j] @ phi
        uncertain = [columns[at, j] @ basis, scale * load]
        passive = _passive(v, a, load, bristles)
        norms = np.linalg.norm(passive, axis=0)
        scales.append(np.sqrt(size) / np.where(norms > 0.0, norms, 1.0))
        block = np.column_stack([*uncertain, passive * scales[-1], whole - load])
        grams.append(block.T @ block / size)
    shares, z = np.ones(counted.shape[1]), np.zeros(basis.shape[1] + 1)
    coefficients = np.zeros((len(shares), passive.shape[1] if grams else 0))
    if not grams:
        return TextbookShares(shares, judged, 0.0, z, coefficients)
    products = _Products(np.array(grams), len(z))
    s = np.full(len(grams), _FIRST)
    for _ in range(_ROUNDS):
        z, left, follows = products.solved(s)
        before, s = s, np.maximum(left, floor)
        shares[judged] = left
        if np.abs(np.log(s / before)).max() < _SETTLED:
            break
    coefficients[judged] = follows * np.array(scales)
    return TextbookShares(shares, judged, float(np.log(s).sum() + 0.5 * z @ z), z, coefficients)


class _Products:
    """Products (J, P + 1 + k, P + 1 + k) of the columns Y D, X and τ − Y φ of every judged joint.

    Friction and rotors that would be negative leave for good.
    """

    def __init__(self, grams: Array, size: int) -> None:
        self._grams, self._size = grams, size
        self._active = np.ones((len(grams), grams.shape[1] - size - 1))
        self._others = np.append(np.arange(size), grams.shape[1] - 1)
        self._eliminate()

    def _eliminate(self) -> None:
        """What is left of the others, (J, P + 1, P + 1), beside X; and how X follows them."""
        own, on = slice(self._size, -1), self._active
        inner = self._grams[:, own, own] * on[:, :, None] * on[:, None, :]
        inner += np.eye(on.shape[1]) * (_RIDGE + 1.0 - on)[:, None, :]
        cross = self._grams[:, own, :][:, :, self._others] * on[:, :, None]
        self._gain = np.linalg.solve(inner, cross)
        whole = self._grams[:, self._others[:, None], self._others]
        self._rest = whole - np.swapaxes(cross, 1, 2) @ self._gain

    def solved(self, s: Array) -> tuple[Array, Array, Array]:
        """z (P,), what is left of each joint (J,), and coefficients of X (J, k)."""
        while True:
            total = np.tensordot(s**-2, self._rest, axes=1)
            inner = total[:-1, :-1]
            # Of torques far smaller than any body makes them, rounding would be left of the one.
            precision = 1.0 + _ROUNDING * np.trace(inner)
            inner = inner + precision * np.eye(len(inner))
            z = np.asarray(np.linalg.solve(inner, total[:-1, -1]))
            if z[-1] < _LIGHTEST:
                side = total[:-2, -1] - _LIGHTEST * inner[:-1, -1]
                z = np.append(np.linalg.solve(inner[:-1, :-1], side), _LIGHTEST)
            both: Array = np.append(-z, 1.0)
            follows = np.asarray(self._gain @ both)
            negative = (follows[:, :-1] < 0.0) & (self._active[:, :-1] > 0.0)
            if not negative.any():
                left = np.einsum("p,jpr,r->j", both, self._rest, both)
                return z, np.asarray(np.sqrt(np.maximum(left, 0.0))), follows
            self._active[:, :-1][negative] = 0.0
            self._eliminate()
