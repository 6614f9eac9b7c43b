"""An identified model in use: the torque that it predicts, its friction, its slopes."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, overload

import numpy as np

from excite_cli.api.arguments import checked
from excite_cli.api.model_exports import for_simulators
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Effect, Signals
from excite_cli.errors import ConfigError
from excite_cli.export.drive import drive_of
from excite_cli.export.engines import pinocchio_model
from excite_cli.export.exported import in_words
from excite_cli.export.mjcf import held_by_actuators, joint_parts, mjcf
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.regression import Series
from excite_cli.identification.stored_model import StoredModel
from excite_cli.robot.model import Array
from excite_cli.scoring.validity import Trust
from excite_cli.shown.answer import Shown, show
from excite_cli.shown.note import Level, Note, Tell, log_note
from excite_cli.simulation.mujoco_model import load_mujoco, silent_engine
from excite_cli.store.model_file import consistent_model, read_model


@dataclass(frozen=True, repr=False)
class Model(Shown):
    """A stored model: what it was made of (`made`), and what it says of any motion.

    States are arrays (T, n), or (n,) for a single one, in the order of `joint_names` [rad, rad/s,
    rad/s²; m for sliding joints]; torques [N·m] (N). Effects that only some recordings had (a
    payload, a contact) are left out of it, and are `left_out`.
    """

    made: StoredModel

    @classmethod
    def load(cls, path: str | Path) -> "Model":
        """Read a model: a fit, a diagnosis, or a config that `excite diagnose --apply` wrote.

        Raises
        ------
        FileError
            The file is missing, is none of these, or was made with another robot.
        ConfigError, RobotError
            The config cannot be, or has no values for the effects that it declares.

        Examples
        --------
        >>> len(Model.load("configs/smoke.yaml").joint_names)
        5
        """
        return load_model(path)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """The moved joints, in the order of all arrays."""
        return self.made.robot.joint_names

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects that are in its torque."""
        return self._standing.effects

    @property
    def left_out(self) -> tuple[Effect, ...]:
        """Effects of single recordings."""
        return self.made.model.of_single_runs

    @property
    def consistent(self) -> "Model":
        """The same of bodies that can be, which engines ask for."""
        found = consistent_model(self.made)
        return Model(replace(self.made, model=found, consistent=found))

    def pinocchio(self, tell: Tell = log_note) -> Any:
        """A `pin.Model` with these inertias, what is carried, gravity, and rotors as `armature`.

        `pin.rnea` of it is `torque` but for effects that Pinocchio has no part for: `tell` hears of
        them. A floating base is free. Least squares alone finds bodies that cannot be, for which
        forward dynamics fails: take `consistent`.
        """
        found, left = pinocchio_model(self.made.robot, self._standing)
        if words := in_words(left, self.joint_names):
            tell(Note(Level.WARNING, f"pin.rnea leaves out: {words}. Model.torque has all"))
        return found

    def to_mjmodel(self, tell: Tell = log_note) -> Any:
        """A `mujoco.MjModel`: that of `excite export --format mjcf`, without a file.

        Bodies are those of `consistent`; `frictionloss` is a constraint of MuJoCo's, also in its
        inverse dynamics. What MuJoCo cannot hold is approximated or left out: `tell` hears of it.

        Raises
        ------
        MissingExtraError, RobotError
            MuJoCo is not installed; it refuses a body.
        """
        robot, drive = self.made.robot, drive_of(self.made.spec, self.joint_names)
        simple, lost = for_simulators(self.made, "mjcf")
        exported = mjcf(robot, simple, drive)
        beside = joint_parts(robot, simple)[1]
        left = [effect for effect in beside if not held_by_actuators(effect, drive)]
        for note in (*lost, *exported.notes):
            tell(Note(Level.WARNING if lost or left else Level.NOTE, note))
        with silent_engine():
            return load_mujoco().MjModel.from_xml_string(exported.text)

    @property
    def _standing(self) -> IdentifiedModel:
        """The model without effects of single recordings."""
        return self.made.model.without(self.left_out)

    @overload
    def torque(
        self,
        q: Array,
        v: Array,
        a: Array,
        t: Array | None = None,
        covariates: Mapping[str, Array] | None = None,
        start: float = 0.0,
        *,
        std: Literal[False] = False,
    ) -> Array: ...

    @overload
    def torque(
        self,
        q: Array,
        v: Array,
        a: Array,
        t: Array | None = None,
        covariates: Mapping[str, Array] | None = None,
        start: float = 0.0,
        *,
        std: Literal[True],
    ) -> tuple[Array, Array]: ...

    def torque(
        self,
        q: Array,
        v: Array,
        a: Array,
        t: Array | None = None,
        covariates: Mapping[str, Array] | None = None,
        start: float = 0.0,
        *,
        std: bool = False,
    ) -> Array | tuple[Array, Array]:
        """τ of states: rigid bodies and all effects, as the error table has it.

        `t` (T,) [s], equidistant, makes them a series; memory of friction, elastic gears, delays
        and drift need one. `covariates` (T,) are the columns of the log that effects follow, by
        name; `start` is the campaign's time at t = 0 [s], for friction that changes over it.

        With `std` also the standard deviation, shaped as τ [N·m] (N), by which a torque measured in
        that state would differ: noise, parameters and effects that the model lacks, larger outside
        the speeds and loads of its data (`scoring/validity.py`). NaN of joints without data.

        Raises
        ------
        ConfigError
            Shapes do not fit; an effect needs `t` or a column that is not given; `std` of a model
            that does not say what it left of its own data.
        """
        series, single = self._series(q, v, a, t, covariates, start)
        found = self._standing.predicted(self.made.robot, series)
        torque = found.torque[0] if single else found.torque
        if not std:
            return torque
        deviation = self._trust.deviation(series, found)
        return torque, deviation[0] if single else deviation

    @cached_property
    def _trust(self) -> Trust:
        """Where its torque is how exact; ConfigError where it keeps no residual of its own data."""
        return Trust(self.made)

    def friction(self, q: Array, v: Array, load: Array | None = None) -> Array:
        """Torque of the effects that follow the speed: friction in all its forms.

        `load` [N·m] (N) is what the gears carry, by default gravity's torque at q.
        """
        q, v = np.asarray(q, dtype=float), np.asarray(v, dtype=float)
        series, single = self._series(q, v, np.zeros_like(q), None, None, 0.0, check=False)
        robot, model = self.made.robot, self._standing
        body = RigidBody(robot, model.phi + model.carried(robot), series.q, 0 * series.v, series.a)
        carried = (
            body.load if load is None else np.asarray(load, dtype=float).reshape(series.q.shape)
        )
        signals = Signals(series.t, series.q, series.v, series.a, carried, carried, body)
        total = np.zeros_like(series.q)
        for effect, values in model.by_effect:
            if effect.is_friction:
                total += effect.torque(signals, values)
        return total[0] if single else total

    def pull_back(
        self,
        weights: Array,
        q: Array,
        v: Array,
        a: Array,
        t: Array | None = None,
        covariates: Mapping[str, Array] | None = None,
        start: float = 0.0,
    ) -> tuple[Array, Array, Array]:
        """Derivatives by q, v and a, each (T, n), of Σ weights ∘ τ; weights (T, n), exact.

        Raises
        ------
        ConfigError
            As `torque`; or an effect has no derivatives (backlash, contact).
        """
        series, single = self._series(q, v, a, t, covariates, start)
        w = np.asarray(weights, dtype=float).reshape(series.q.shape)
        flat = [
            effect.kind
            for effect in self.effects
            if type(effect).pull_back is Effect.pull_back and not effect.carried
        ]
        if flat:
            raise ConfigError(f"no derivatives: {', '.join(dict.fromkeys(flat))} has none.")
        found = self._standing.pull_back(self.made.robot, series, w)
        return tuple(each[0] if single else each for each in found)  # type: ignore[return-value]

    def derivatives(self, q: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """∂τ/∂q, ∂τ/∂v, ∂τ/∂a of states, each (T, n, n) with rows of τ, exact.

        Raises
        ------
        ConfigError
            As `pull_back`; or an effect looks at other instants, which `pull_back` knows.
        """
        n, single = len(self.joint_names), np.ndim(q) == 1
        q, v, a = (np.atleast_2d(np.asarray(x, dtype=float)) for x in (q, v, a))
        found = np.empty((3, len(q), n, n))
        for j in range(n):
            weights = np.zeros_like(q)
            weights[:, j] = 1.0
            found[:, :, j] = self.pull_back(weights, q, v, a)
        by_q, by_v, by_a = found[:, 0] if single else found
        return by_q, by_v, by_a

    def _series(
        self,
        q: Array,
        v: Array,
        a: Array,
        t: Array | None,
        covariates: Mapping[str, Array] | None,
        start: float,
        check: bool = True,
    ) -> tuple[Series, bool]:
        n, single = len(self.joint_names), np.ndim(q) == 1
        q, v, a = (np.atleast_2d(np.asarray(x, dtype=float)) for x in (q, v, a))
        if q.ndim != 2 or not (q.shape == v.shape == a.shape) or q.shape[1] != n:
            raise ConfigError(
                f"q, v and a have shapes {q.shape}, {v.shape}, {a.shape}. Give (T, {n}) each, or "
                f"({n},): {', '.join(self.joint_names)}."
            )
        columns = {name: np.atleast_1d(x).astype(float) for name, x in (covariates or {}).items()}
        if check:
            self._require(t, columns, len(q))
        times = np.arange(len(q), dtype=float) if t is None else np.asarray(t, dtype=float)
        return Series(times, q, v, a, start=start, covariates=columns), single

    def _require(self, t: Array | None, columns: Mapping[str, Array], count: int) -> None:
        over_time = [effect.kind for effect in self.effects if effect.over_time]
        if t is None and over_time:
            raise ConfigError(
                f"{', '.join(dict.fromkeys(over_time))} depends on other instants. Give a series "
                "and its times: t (T,) in s."
            )
        if t is not None and np.shape(t) != (count,):
            raise ConfigError(
                f"t has shape {np.shape(t)}. Give the time of every state: ({count},)."
            )
        step = np.diff(t) if t is not None else np.ones(1)
        if len(step) and not (step[0] > 0 and np.allclose(step, step[0], rtol=1e-3)):
            raise ConfigError("t is not equidistant, or does not grow. Resample the series.")
        for effect in self.effects:
            if effect.covariate and columns.get(effect.covariate, np.zeros(0)).shape != (count,):
                raise ConfigError(
                    f"{effect.kind} follows the column '{effect.covariate}': give it in "
                    f"covariates, ({count},)."
                )


@checked()
def load_model(path: str | Path) -> Model:
    """As `Model.load`."""
    return Model(read_model(Path(path)))


show(
    Model,
    lambda model: f"{model.made.robot.name}: {len(model.effects)} effects, from {model.made.path}",
    lambda model: [],
)
