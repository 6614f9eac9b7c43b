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

from excite_cli.dynamics.regressor import InverseDynamics, standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody, robot_with
from excite_cli.dynamics.spatial_adjoint import SpatialAdjoint
from excite_cli.effects.base import Cotangents, Effect, Signals
from excite_cli.effects.sign import sign_of_width
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
                for order, direct in enumerate((found.q, found.v, found.a)):
                    if direct is not None:
                        total[order] += direct
                for cotangent in (found.load, found.torque):
                    if cotangent is not None:
                        by_torque += cotangent
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
