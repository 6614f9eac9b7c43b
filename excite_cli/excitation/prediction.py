"""How well torques of the user's work will be predicted: before, and after, motions.

Unknown are the base parameters φ_B (r,), and parameters β (k,) of effects: those that are declared,
and those that a robot may have. Before any motion, with noise σ_j of the torque of row j,

    φ_B ~ N(φ_URDF, X Σ Xᵀ),    Σ = diag (0.3 · scale)² (`dynamics/pseudo_inertia.py`),
    β_p ~ N(0, s_p²),           s_p such that the effect has a share of its joint's usual torque.

In units of these deviations z the columns are C = diag(1/σ) [Y_B D, columns · s], and after motions

    cov z = M⁻¹,    M = RᵀR + Σ_motions CᵀC,    R: of the prior, ‖R z‖².

Of a torque of the work, with the row y in the same units, the variance is y M⁻¹ yᵀ in units of the
noise. Its mean over the rows Φ (N, r + k) of all states of the work is tr(M⁻¹ W), W = ΦᵀΦ / N; the
criterion minimises it (Chaloner and Verdinelli 1995, Bayesian I-optimality). With W = VᵀV and
B = M⁻¹ Vᵀ it is Σ d_k, d = diag(V B), and its derivative with respect to C is −2 C B Bᵀ. So with
σ_k = d_k^(−½) and the vectors b_k / d_k in place of the singular vectors the gradient is that of
all criteria (Eq. 45), and nothing is decomposed but M. Directions that no motion shows need no cut:
the prior bounds them.

A motion has `rate` independent samples a second, however many instants its cost is taken at.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, cho_factor, cho_solve

from excite_cli.config.spec import Spec
from excite_cli.config.trajectory_spec import TaskSpec
from excite_cli.criteria.base import condition_number, singular_values
from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.pseudo_inertia import UNSURE, inertial_prior
from excite_cli.dynamics.regressor import Regressor, standard_parameters
from excite_cli.effects.base import Effect, Tier
from excite_cli.effects.catalogue import EVERYDAY, EVERYDAY_FRICTION, catalogue, kind_named, shows
from excite_cli.errors import ConfigError, nearest
from excite_cli.excitation.effect_columns import Extension, extend, why_not_planned
from excite_cli.excitation.objective import Objective, Spectrum, Stack
from excite_cli.excitation.weighting import Weighting, state_bounds
from excite_cli.robot.model import Array, Robot

# Share of a joint's usual torque that an effect may well have: of what every robot has, and of the
# others. Of four real arms friction is 20 to 60 % of the torque, what else was found 2 to 15 %.
_EVERYDAY_SHARE, _SHARE = 0.3, 0.1
# Usual torque of a joint that carries next to nothing, as a share of its effort limit: friction of
# a UR10's wrists is 1 to 2 N·m, of 54, and their URDF's inertias make 0.1 N·m.
_OF_EFFORT = 0.05
# Noise of a torque: a share of the joint's usual torque. Real logs have 0.5 to 5 %.
NOISE = 0.02
_LEAST = 1e-3  # of the largest usual torque, where neither is known
_RARE = 10.0  # `Effect.prior_cost` [χ²] of what one robot in a hundred has
_STATES = 500
_NOTHING = 1e-14  # of the largest d
_States = tuple[Array, Array, Array]


@dataclass(frozen=True)
class Prediction:
    """What is unknown, in units of prior deviations, and which torques are to be predicted.

    `weighting`: 1/noise of the rows of a cost instant, and deviations of base parameters;
    `extension`: declared effects, then those that the robot may have, scaled by their deviations;
    `prior` R (c, c); `work` Φ (N, c), c = r + k; `usual` (R,): usual torque of a row [N·m, N];
    `declared`: how many of the effects the model has; `noise` (R,): of the usual torque, the noise
    of a sample; `shares` (k,): of it, what an effect with the prior
    deviation makes.
    """

    weighting: Weighting
    extension: Extension
    prior: Array
    work: Array
    usual: Array
    noise: Array
    shares: Array
    declared: int = 0

    @property
    def rank(self) -> int:
        """r: base parameters come first."""
        return len(self.weighting.columns)

    @cached_property
    def first_columns(self) -> NDArray[np.intp]:
        """The column of every effect's first parameter."""
        slices = self.extension.columns().slices
        return np.array([self.rank + part.start for part in slices], dtype=np.intp)

    @cached_property
    def root(self) -> Array:
        """V (m, c), VᵀV = W."""
        return np.asarray(np.linalg.qr(self.work / np.sqrt(len(self.work)), mode="r"))

    def information(self, factor: Array) -> Array:
        """M (c, c) after motions whose stacked rows have the triangular `factor` (c, c)."""
        return np.asarray(factor.T @ factor + self.prior.T @ self.prior)

    def deviation(self, factor: Array) -> float:
        """RMS standard deviation of the torques of the work, in units of the noise of a sample."""
        solved = np.linalg.solve(self.information(factor), self.work.T)
        return float(np.sqrt(np.mean(np.sum(self.work * solved.T, axis=1))))


class PredictedTorques(Objective):
    """Variance of the torques of the work in place of the singular values; see the module."""

    must_show_all = False  # what no motion shows is bounded by the prior

    def __init__(self, *parts: Any, prediction: Prediction) -> None:
        super().__init__(*parts)
        self.prediction = prediction
        self._known = self._gram_0 + prediction.prior.T @ prediction.prior

    def spectrum(self, block: Array) -> Spectrum:
        """d^(−½), and b / d as columns of `right`."""
        return self._of(block.T @ block + self._known)

    def _of(self, information: Array) -> Spectrum:
        root = self.prediction.root
        b = cho_solve(cho_factor(information, overwrite_a=True), root.T)
        d = np.einsum("mc,cm->m", root, b)
        shown = d > _NOTHING * d.max()
        return Spectrum(d[shown] ** -0.5, b[:, shown] / d[shown], of_torques=True)

    def earlier(self) -> Array:
        """d^(−½) of the prior and the earlier data."""
        return self._of(self._known.copy()).sigma

    def added_to(self, stack: Stack, coefficients: Array) -> Stack:
        """With the rows of the base regressor as they are, too."""
        block = self.block(coefficients)
        return stack.with_rows(block, self._plain_rows(block))

    def figures_of(self, grams: Array) -> Array:
        """Predicted deviations (N,)."""
        root, prior = self.prediction.root, self.prediction.prior
        covariances = np.linalg.solve(grams + prior.T @ prior, root.T)
        return np.asarray(np.sqrt(np.einsum("mc,ncm->n", root, covariances)))

    def deviation_with(self, stack: Stack) -> float | None:
        """RMS standard deviation of the torques of the work, in units of the noise of a sample."""
        return self.prediction.deviation(stack.factor)

    def own_condition_number(self, coefficients: Array) -> float:
        """Of the base regressor as it is, as the criterion `condition_number` takes it."""
        return condition_number(singular_values(self._plain_rows(self.block(coefficients))))

    def stacked_condition_number(self, coefficients: Array) -> float:
        """The same with all earlier motions that were planned."""
        own, earlier = self._plain_rows(self.block(coefficients)), self.stack.plain
        return condition_number(
            singular_values(own if earlier is None else np.vstack([earlier, own]))
        )

    def _plain_rows(self, block: Array) -> Array:
        """Unweighted and unscaled columns (T·R, r) of the base parameters.

        On other instants than those of the cost a motion counts as much as on these.
        """
        rows = block.reshape(-1, len(self.weighting.rows), self.size)[:, :, : self.base.rank]
        rows = rows / self.prediction.weighting.rows[:, None] / self.weighting.columns
        return rows.reshape(-1, self.base.rank)


def build_prediction(
    spec: Spec,
    robot: Robot,
    base: BaseParameters,
    declared: Sequence[Effect],
    accelerations: Array,
    duration: float,
    instants: int,
    work: _States | None = None,
    more: Sequence[str] = (),
    possible: Sequence[Effect] | None = None,
) -> Prediction:
    """The prediction for motions of `duration` [s] whose cost is taken at so many `instants`.

    accelerations: bounds (n,), infinite where there is none; work: q, v, a (N, n) of the log or
    the plan that `spec.task` names; without it states of the region are drawn; more: kinds that
    the robot may have beside those of `spec.task`; possible: in place of all these, the effects
    that it may have.

    Raises
    ------
    ConfigError
        `task` names a joint or a kind of effect that there is not.
    """
    lower, upper = state_bounds(robot, accelerations)
    rng = np.random.default_rng(0)
    drawn = _split(rng.uniform(lower, upper, (_STATES, len(lower))))
    phi = standard_parameters(robot)
    usual = _usual_torque(robot, base, phi, drawn)
    noise = _noise(spec, robot, usual)
    deviations = inertial_prior(robot, phi, UNSURE).base_std(base)
    deviations = np.maximum(deviations, 1e-9 * deviations.max())
    rows = np.sqrt(spec.task.rate * duration / instants) / noise
    weighting = Weighting(rows, deviations, "1/noise", "prior deviation")
    if possible is None:
        possible = _possible(spec.task, robot, declared, more)
    effects = (*declared, *possible)
    extension = extend(robot, base, weighting, effects, duration, absorbed_too=True)
    shares = _shares(extension)
    sizes = _size_of_usual(extension, drawn, usual)
    extension = replace(extension, scales=shares * sizes)
    whiten, _ = inertial_prior(robot, phi, UNSURE).on_base(base)
    prior = block_diag(whiten * deviations, np.eye(len(extension.scales)))
    if work is None:
        region = _region(spec.task, robot, lower, upper)
        work = _split(np.random.default_rng(1).uniform(*region, (_STATES, len(lower))))
    y = Regressor(robot).evaluate(*work)[:, :, base.selection] * deviations
    seen = extension.columns().evaluate(np.arange(float(len(work[0]))), *work)
    both = np.concatenate([y, seen.columns * extension.scales], axis=2) / noise[:, None]
    rows_of_work = both.reshape(-1, both.shape[2])
    count = sum(effect in declared for effect in extension.effects)
    return Prediction(
        weighting, extension, prior, rows_of_work, usual, noise / usual, shares, count
    )


def _split(states: Array) -> _States:
    q, v, a = np.split(states, 3, axis=1)
    return q, v, a


def _usual_torque(robot: Robot, base: BaseParameters, phi: Array, states: _States) -> Array:
    """RMS (R,) of the torque of every row at these states, by inertias or by effort limits."""
    y = Regressor(robot).evaluate(*states)[:, :, base.selection]
    rms = np.sqrt(np.mean(np.square(y @ (base.mapping @ phi)), axis=0))
    efforts = dict(zip(robot.joint_names, robot.limits.effort, strict=True))
    limits = np.array([efforts.get(row, np.inf) for row in robot.row_names])
    least = np.where(np.isfinite(limits), _OF_EFFORT * limits, _LEAST * float(rms.max()))
    return np.maximum(rms, np.maximum(least, 1e-9))


def _noise(spec: Spec, robot: Robot, usual: Array) -> Array:
    """Standard deviation (R,) of the torque noise: 1/`criterion.row_weights`, or the usual one."""
    weights, noise = spec.criterion.row_weights, NOISE * usual
    if not isinstance(weights, str):
        for k, name in enumerate(robot.row_names):
            noise[k] = 1.0 / weights[name] if name in weights else noise[k]
    return np.asarray(noise)


def _possible(
    task: TaskSpec, robot: Robot, declared: Sequence[Effect], more: Sequence[str]
) -> list[Effect]:
    """Effects that the robot may have beside the `declared` ones, each in its usual shape."""
    usual, asked = task.effects, {*more, *(() if task.effects == "auto" else task.effects)}
    if task.effects == "auto":
        usual = tuple(k for k, kind in catalogue().items() if may_be_planned_for(kind, robot))
    there, found = {effect.place for effect in declared}, []
    for name in dict.fromkeys((*usual, *more)):
        kind = kind_named(name, "task.effects")
        shape, _ = kind.planted(0.0, {})
        effects = [kind(place, shape) for place in kind.places(robot)]
        reasons = [why_not_planned(each, robot) for each in effects]
        if effects and all(reasons) and name in asked:
            raise ConfigError(f"{name}: no planned motion shows it: {reasons[0]}.")
        found += [
            each
            for each, reason in zip(effects, reasons, strict=True)
            if not reason and each.place not in there and shows(each, robot)
        ]
    return found


def may_be_planned_for(kind: type[Effect], robot: Robot) -> bool:
    """Whether many robots have it, and the state of one joint says all of its columns.

    Of these nothing but the motion decides how well they will be known.
    """
    return (
        kind.scope == "joint"
        and kind.excitable
        and kind.tier < Tier.LAST
        and kind.prior_cost < _RARE
        and not (kind.carried or kind.over_time or kind.per_run or kind.of_campaign)
        and not (kind.follows_covariate or kind.changes_of or kind.is_searched())
        and all(kind(place).rows(robot.n) == place for place in kind.places(robot)[:1])
    )


def _shares(extension: Extension) -> Array:
    """Share (k,) of its joint's usual torque that an effect may well have."""
    everyday = {*EVERYDAY_FRICTION, *EVERYDAY}
    return np.array(
        [
            _EVERYDAY_SHARE if effect.kind in everyday else _SHARE
            for effect in extension.effects
            for _ in effect.parameters
        ]
    )


def _size_of_usual(extension: Extension, states: _States, usual: Array) -> Array:
    """Value (k,) of every parameter that makes the usual torque of its row, RMS at these states."""
    seen = extension.columns().evaluate(np.arange(float(len(states[0]))), *states)
    rms = np.sqrt(np.mean(np.square(seen.columns), axis=0)) / usual[:, None]  # (R, k)
    return np.asarray(1.0 / rms.max(axis=0, initial=0.0))


def _region(task: TaskSpec, robot: Robot, lower: Array, upper: Array) -> tuple[Array, Array]:
    """Bounds (3 n,) of the states of the work, within those of the robot."""
    n, low, high = robot.n, lower.copy(), upper.copy()
    for name, (first, last) in task.position.items():
        if name not in robot.joint_names:
            raise ConfigError(
                f"task.position: no moved joint '{name}'.{nearest(name, robot.joint_names)} "
                f"Moved joints: {', '.join(robot.joint_names)}."
            )
        j = robot.joint_names.index(name)
        if not first <= last:
            raise ConfigError(f"task.position.{name}: {first:g} is above {last:g}; swap them.")
        low[j], high[j] = np.clip([first, last], lower[j], upper[j])
    low[n : 2 * n] *= task.speed
    high[n : 2 * n] *= task.speed
    low[2 * n :] *= task.acceleration
    high[2 * n :] *= task.acceleration
    return low, high
