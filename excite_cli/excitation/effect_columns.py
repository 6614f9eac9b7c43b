"""Columns of effects beside the base regressor, with their vector–Jacobian product.

An effect's column may depend on q, v, a, on the torque of the rigid bodies, or on entries of the
regressor (`Cotangents`). Its derivative reaches q, v, a

    directly,
    from a cotangent w of the torque τ(q, v, a; φ) by   wᵀ ∂τ/∂(q, v, a),   one RNEA pass, and
    from a cotangent Z of the regressor Y by            the batched adjoint of Σ_t Z_t : Y_t.

φ is that of the URDF. What the effects themselves add to the torque is left out of it: a column
proportional to the torque then lacks shares of friction columns only, which stand beside it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import lstsq

from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.regressor import InverseDynamics, Regressor, standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody, robot_with
from excite_cli.dynamics.spatial_adjoint import SpatialAdjoint
from excite_cli.effects.base import Cotangents, Effect, Signals
from excite_cli.effects.sign import sign_of_width
from excite_cli.excitation.weighting import Weighting
from excite_cli.robot.model import Array, Robot

# Width [rad/s] of the sign of a speed while planning: samples that cross zero are no steps.
PLANNED_SIGN = 0.02


@dataclass(frozen=True)
class SeenColumns:
    """Columns (T, R, k) of one motion, with the signals that they were made from."""

    signals: Signals
    columns: Array


class EffectColumns:
    """Columns of `effects` in the measured rows of `robot`; not to be shared between threads.

    `names` has one name per column (`spring[elbow].stiffness`); `width` is that of the sign.
    """

    def __init__(
        self, robot: Robot, effects: Sequence[Effect], width: float = PLANNED_SIGN
    ) -> None:
        self.robot, self.effects, self.width = robot, tuple(effects), width
        self.names = tuple(name for effect in effects for name in column_names(effect, robot))
        self.count = len(self.names)
        self._dynamics = InverseDynamics(robot)
        self._phi = standard_parameters(robot)
        self._model = robot_with(robot, self._phi)
        self._adjoint: SpatialAdjoint | None = None
        place = {int(row): index for index, row in enumerate(robot.rows)}
        self._rows: list[tuple[list[int], list[int]]] = []
        self.slices: list[slice] = []
        first = 0
        for effect in effects:
            rows = [place.get(int(robot.moved[j])) for j in effect.rows(robot.n)]
            own = [i for i, row in enumerate(rows) if row is not None]
            self._rows.append((own, [row for row in rows if row is not None]))
            self.slices.append(slice(first, first + len(effect.parameters)))
            first += len(effect.parameters)

    @property
    def phi(self) -> Array:
        """Standard parameters (10·n_bodies,) of the torque that columns depend on."""
        return self._phi

    def signals(
        self, times: Array, q: Array, v: Array, a: Array, load: Array | None = None
    ) -> Signals:
        """What the effects look at, for states (T, n) at equidistant `times`.

        load: their rigid-body torque (T, n) where it is known.
        """
        load = self._dynamics.torques(q, v, a) if load is None else load
        body = RigidBody(self.robot, self._phi, q, v, a, self._model)
        return Signals(times - times[0], q, v, a, load, load, body)

    def evaluate(
        self, times: Array, q: Array, v: Array, a: Array, load: Array | None = None
    ) -> SeenColumns:
        """Columns in the measured rows, torque per unit of each parameter; see `signals`."""
        signals = self.signals(times, q, v, a, load)
        columns = np.zeros((len(times), len(self.robot.rows), self.count))
        with sign_of_width(self.width):
            for effect, (own, rows), part in zip(
                self.effects, self._rows, self.slices, strict=True
            ):
                columns[:, rows, part] = effect.columns(signals)[:, own]
        return SeenColumns(signals, columns)

    def pull_back(self, seen: SeenColumns, weights: Array) -> tuple[Array, Array, Array]:
        """Derivatives by q, v, a, each (T, n), of Σ weights ∘ columns; weights (T, R, k)."""
        total, by_torque, by_regressor = self.cotangents(seen, weights)
        if by_torque.any():
            total += seen.signals.body.pull_back(by_torque)
        if by_regressor is not None:
            total += self._regressor_back(seen.signals, by_regressor)
        return total[0], total[1], total[2]

    def cotangents(self, seen: SeenColumns, weights: Array) -> tuple[Array, Array, Array | None]:
        """The same (3, T, n) without what reaches q, v, a through the torque or the regressor.

        And the derivatives by these: (T, n), and (T, n, 10·n_bodies) where a column has entries
        of the regressor.
        """
        signals, n = seen.signals, self.robot.n
        total = np.zeros((3, *signals.q.shape))
        by_torque, by_regressor = np.zeros_like(signals.load), None
        with sign_of_width(self.width):
            for effect, (own, rows), part in zip(
                self.effects, self._rows, self.slices, strict=True
            ):
                theirs = np.zeros((len(weights), len(effect.rows(n)), part.stop - part.start))
                theirs[:, own] = weights[:, rows, part]
                found = effect.pull_back(signals, theirs)
                found.add_to(total, by_torque)
                by_regressor = _sum(by_regressor, found)
        return total, by_torque, by_regressor

    def _regressor_back(self, signals: Signals, weights: Array) -> Array:
        if self._adjoint is None:  # its rows are those of the moved joints, measured or not
            self._adjoint = SpatialAdjoint(replace(self.robot, rows=self.robot.moved))
        q, v, a = signals.q, signals.v, signals.a
        return np.array(self._adjoint.pull_back_dense(q, v, a, weights))


def column_names(effect: Effect, robot: Robot) -> list[str]:
    """`kind[joints].parameter` of every linear parameter, with column and shape, if any."""
    joints = ",".join(robot.joint_names[j] for j in effect.joints)
    joints += f";{effect.covariate}" if effect.covariate else ""
    shape = "".join(f";{name}={value:.6g}" for name, value in effect.shape.items())
    return [f"{effect.kind}[{joints}{shape}].{p.name}" for p in effect.parameters]


def _sum(total: Array | None, found: Cotangents) -> Array | None:
    if found.regressor is None:
        return total
    return found.regressor if total is None else total + found.regressor


# Which effects extend the regressor of a planned motion, and in which scale.
#
#     C = [Y_B diag(s), columns of effects diag(s_e)]
#
# Base parameters are in kg, kg·m and kg·m², effects in N·m, N·m·s/rad and others: a condition
# number over both depends on units. So every effect column gets the root mean square of the
# median inertial column, over random states that are drawn once: fixed per problem, so that
# stacks fit. Without effects nothing is scaled and the paper's raw form stays as it is.
#
# Left out, with a reason, are effects that no planned motion can excite, that show in no measured
# row, that belong to single recorded runs, and those whose columns the regressor has already.

_STATES, _SEED = 300, 20210914
# A column of which less than this share is new counts as absorbed.
_NEW = 1e-6


@dataclass(frozen=True)
class Extension:
    """Effects beside the base parameters.

    `scales` (k,) of their columns and `names`, in order; `left_out` says which effects were not
    taken and why; with `fine` a column has time derivatives and needs a fine, even grid. `width` is
    that of the sign of a speed [rad/s].
    """

    robot: Robot
    effects: tuple[Effect, ...]
    scales: Array
    names: tuple[str, ...]
    left_out: tuple[str, ...] = ()
    fine: bool = False
    width: float = PLANNED_SIGN

    def columns(self) -> EffectColumns:
        """The evaluator of the columns (unscaled); one per thread."""
        return EffectColumns(self.robot, self.effects, self.width)


class _AskedForRate(Exception):
    """A column wants a time derivative."""


class _WithoutRates(Signals):
    def rate(self, x: Array) -> Array:
        raise _AskedForRate


@dataclass(frozen=True)
class _RandomStates:
    """States that scales and absorption are judged on, with the weighted inertial columns."""

    times: Array
    q: Array
    v: Array
    a: Array
    inertial: Array

    def weighted(self, columns: Array, rows: Array) -> Array:
        """Columns (T, R, k) as (T·R, k), rows weighted."""
        return np.asarray((columns * rows[:, None]).reshape(-1, columns.shape[2]))


def extend(
    robot: Robot,
    base: BaseParameters,
    weighting: Weighting,
    effects: Sequence[Effect],
    duration: float,
    absorbed_too: bool = False,
) -> Extension:
    """Choose and scale the columns of `effects` for motions of `duration` [s].

    With `absorbed_too`, effects are taken although their columns are in the regressor already.
    """
    drawn = _draw(robot, base, weighting, duration)
    typical = float(np.median(_size(drawn.inertial)))
    taken: list[Effect] = []
    left_out: list[str] = []
    scales: list[Array] = []
    known, names, fine = drawn.inertial, [base.names[i] for i in base.selection], False
    for effect in effects:
        reason = why_not_planned(effect, robot)
        if not reason:
            columns, rated = _evaluated(robot, effect, drawn, weighting)
            reason = "" if np.all(_size(columns) > 0) else "its columns vanish on random motions"
        if not reason and not absorbed_too:
            reason = _absorbed(columns, known, [*names, *column_names(effect, robot)])
        if reason:
            left_out.append(f"{in_words(effect, robot)}: {reason}")
            continue
        taken.append(effect)
        scales.append(typical / _size(columns))
        known = np.hstack([known, columns * scales[-1]])
        names += column_names(effect, robot)
        fine = fine or rated
    return Extension(
        robot,
        tuple(taken),
        np.concatenate([np.zeros(0), *scales]),
        tuple(name for effect in taken for name in column_names(effect, robot)),
        tuple(left_out),
        fine,
    )


def _draw(
    robot: Robot, base: BaseParameters, weighting: Weighting, duration: float
) -> _RandomStates:
    states = robot.draw_states(_STATES, _SEED)
    y = Regressor(robot).evaluate(*states)[:, :, base.selection]
    y = y * weighting.rows[:, None] * weighting.columns
    return _RandomStates(np.linspace(0.0, duration, _STATES), *states, y.reshape(-1, base.rank))


def _size(matrix: Array) -> Array:
    """Root mean square (k,) of columns, all rows of a sample counted as one."""
    return np.sqrt(np.sum(matrix**2, axis=0) / _STATES)


def _evaluated(
    robot: Robot, effect: Effect, drawn: _RandomStates, weighting: Weighting
) -> tuple[Array, bool]:
    """Weighted columns on the random states, and whether they ask for time derivatives."""
    columns = EffectColumns(robot, (effect,))
    seen = columns.evaluate(drawn.times, drawn.q, drawn.v, drawn.a)
    try:
        effect.columns(_WithoutRates(**vars(seen.signals)))
    except _AskedForRate:
        return drawn.weighted(seen.columns, weighting.rows), True
    return drawn.weighted(seen.columns, weighting.rows), False


def why_not_planned(effect: Effect, robot: Robot) -> str:
    """Why the effect has no columns for a planned motion; empty if it has."""
    if not effect.excitable:
        return effect.why_not_excitable or "it has no columns for a planned motion"
    if effect.runs:
        return f"it is present in recorded runs only ({', '.join(effect.runs)})"
    measured = set(robot.rows.tolist())
    if not any(int(robot.moved[j]) in measured for j in effect.rows(robot.n)):
        return "none of its joints is a measured row (robot.rows)"
    if effect.scope == "robot" and measured - set(robot.moved.tolist()):
        return "its share of the wrench at the base is not modelled (robot.rows)"
    return ""


def _absorbed(columns: Array, known: Array, names: list[str]) -> str:
    """Which of the known columns make up one of `columns`; empty if all are new."""
    size, known_size = _size(columns), np.maximum(_size(known), 1e-300)
    both = np.hstack([known / known_size, columns / size])
    for index in range(columns.shape[1]):
        at = known.shape[1] + index
        share, _, _, _ = lstsq(both[:, :at], both[:, at])
        left = both[:, at] - both[:, :at] @ share
        if np.linalg.norm(left) < _NEW * np.linalg.norm(both[:, at]):
            most = [i for i in np.argsort(-np.abs(share))[:3] if abs(share[i]) > 0.01]
            return f"collinear with {', '.join(names[i] for i in most)}"
    return ""


def in_words(effect: Effect, robot: Robot) -> str:
    """Kind and joints."""
    return f"{effect.kind} on {', '.join(robot.joint_names[j] for j in effect.joints)}"
