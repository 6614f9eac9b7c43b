"""A `Spec` made concrete: robot, base parameters, trajectory, criterion, constraints, grids."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from excite_cli.config.constraints_spec import ConstraintsSpec
from excite_cli.config.spec import Spec
from excite_cli.config.trajectory_spec import GridSpec, SamplingSpec
from excite_cli.constraints.base import Array, Constraint
from excite_cli.constraints.catalogue import build_constraints
from excite_cli.criteria.base import Criterion
from excite_cli.criteria.catalogue import build_criterion
from excite_cli.dynamics.base_parameters import BaseParameters, find_base_parameters
from excite_cli.dynamics.forward_kinematics import BatchKinematics, States
from excite_cli.dynamics.uncertain_inertias import (
    FitKnowledge,
    InertiaUncertainty,
    inertia_uncertainty,
)
from excite_cli.dynamics.whole_robot import load_parameters
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import declared_effects
from excite_cli.errors import ConfigError
from excite_cli.excitation.boundary import Boundary, build_boundary
from excite_cli.excitation.discrimination import Discrimination, Separation
from excite_cli.excitation.effect_columns import Extension, extend
from excite_cli.excitation.objective import Objective, Stack
from excite_cli.excitation.prediction import PredictedTorques, Prediction, build_prediction
from excite_cli.excitation.weighting import (
    Weighting,
    build_weighting,
    reference_rows,
    torque_metric,
)
from excite_cli.robot.mesh_paths import without_unusable
from excite_cli.robot.model import Robot, build_robot
from excite_cli.shown.answer import Shown
from excite_cli.trajectory.base import Basis, Trajectory, with_freedom
from excite_cli.trajectory.catalogue import build_trajectory

# Instants of the cost and of the constraints, filled in from the trajectory where not given.

# With two to a coefficient, a motion is shaped to its instants: TALOS' arms have 5.15 on them and
# 5.56 on twenty times as many; with four 5.20 on both.
_COST_SAMPLES, _PER_COEFFICIENT = 40, 4
_CONSTRAINT_STEP, _FEWEST, _MOST = 0.02, 100, 1000
_ROUNDING = 1e-5
_LONGEST = 3600.0
_MOST_VALUES = 2_000_000  # samples times coefficients of a joint


def with_sampling(spec: Spec, trajectory: Trajectory) -> Spec:
    """`spec` with all samples and steps given.

    Raises
    ------
    ConfigError
        Samples last longer than the trajectory, or constraint samples leave a part of it out.
    """
    duration = trajectory.duration
    if duration > _LONGEST:
        raise ConfigError(
            f"trajectory: {duration:g} s is longer than the {_LONGEST:g} s that are allowed. Take "
            "a higher base_frequency, or several motions."
        )
    usual = max(_COST_SAMPLES, _PER_COEFFICIENT * trajectory.n_coefficients)
    cost = _filled(spec.sampling.cost, usual, duration)
    usual = int(np.clip(round(duration / _CONSTRAINT_STEP), _FEWEST, _MOST))
    grid = _filled(spec.sampling.constraints, usual, duration)
    for name, section in (("cost", cost), ("constraints", grid)):
        samples, step = _both(section)
        if samples * trajectory.n_coefficients > _MOST_VALUES:
            raise ConfigError(
                f"sampling.{name}: {samples:,} samples of {trajectory.n_coefficients} coefficients "
                f"are more than fits in memory with all that is computed of them (up to "
                f"{_MOST_VALUES:,}). Take fewer samples or a larger step."
            )
        if (samples - 1) * step > duration * (1 + _ROUNDING):
            raise ConfigError(
                f"sampling.{name}: {samples} samples every {step:g} s last longer than the "
                f"trajectory ({duration:g} s). Take fewer samples or a smaller step."
            )
    samples, step = _both(grid)
    if samples * step < duration * (1 - _ROUNDING):
        raise ConfigError(
            f"sampling.constraints: {samples} samples every {step:g} s cover {samples * step:g} s "
            f"of a trajectory of {duration:g} s; the constraints would not hold in the remaining "
            "time. Take more samples or a larger step, or leave one of the two out."
        )
    sampling = SamplingSpec(cost=cost, constraints=grid)
    return spec.model_copy(update={"sampling": sampling})


def instants(grid: GridSpec) -> Array:
    """Times (samples,) [s] of a grid that `with_sampling` has filled."""
    samples, step = _both(grid)
    return np.arange(samples, dtype=float) * step


def _both(grid: GridSpec) -> tuple[int, float]:
    assert grid.samples is not None
    assert grid.step is not None
    return grid.samples, grid.step


def _filled(grid: GridSpec, usual: int, duration: float) -> GridSpec:
    samples, step = grid.samples, grid.step
    if samples is None:
        samples = usual if step is None else max(2, math.ceil(duration / step - _ROUNDING))
    step = step if step is not None else duration / samples
    return GridSpec.model_construct(samples=samples, step=step)


@dataclass(frozen=True, repr=False)
class Problem(Shown):
    """Everything that is fixed while motions are sought.

    `extension` holds the effects whose columns stand beside the base regressor. With a
    `separation` a motion is sought that tells effects apart, and `extension` has the rivals too.
    With a `prediction` motions are planned for the torques of the user's work; `work`: its states
    q, v, a (N, n), where `task` names a file. Relative paths of `spec` start from `folder`, where
    `file` lies if it was read from one.
    """

    spec: Spec
    robot: Robot
    base: BaseParameters
    trajectory: Trajectory
    boundary: Boundary
    criterion: Criterion
    weighting: Weighting
    constraints: tuple[Constraint, ...]
    cost_basis: Basis
    constraint_basis: Basis
    kinematics: BatchKinematics
    extension: Extension
    separation: Separation | None = None
    metric: Array | None = None
    prediction: Prediction | None = None
    work: tuple[Array, Array, Array] | None = None
    folder: Path = Path()
    file: Path | None = None

    @property
    def variables(self) -> int:
        """Number of coefficients of one motion."""
        return self.trajectory.n_coefficients * self.robot.n

    @property
    def columns(self) -> int:
        """Number of columns of the regressor: base parameters, then those of effects."""
        return self.base.rank + len(self.extension.names)

    @property
    def column_words(self) -> tuple[str, ...]:
        """Every column in words, base parameters first."""
        return (*self.base.in_words(), *self.extension.names)

    @property
    def column_scales(self) -> Array:
        """Scale of every column, base parameters first."""
        return np.concatenate([self.weighting.columns, self.extension.scales])

    @property
    def restarts(self) -> int:
        """Starts of a motion."""
        return self.spec.optimizer.restarts or self.criterion.restarts

    @property
    def tolerance(self) -> float:
        """Change of the (logarithmic) criterion over 8 iterations that ends a start."""
        return self.spec.optimizer.tolerance or self.criterion.tolerance

    def objective(self, stack: Stack | None = None) -> Objective:
        """The cost of one motion on top of `stack`."""
        parts = (self.robot, self.base, self.weighting, self.cost_basis, stack, self.extension)
        if self.separation is None:
            if self.prediction is not None:
                return PredictedTorques(*parts, prediction=self.prediction)
            return Objective(*parts, metric=self.metric)
        return Discrimination(*parts, separation=self.separation)

    def states(self, coefficients: Array, basis: Basis | None = None) -> States:
        """Joint states on the constraint grid, or on `basis`."""
        return States(self.kinematics, *(basis or self.constraint_basis).orders(coefficients))

    def still(self, q: Array) -> Array:
        """Coefficients of standing at `q` (n,)."""
        return self.trajectory.constant(q)


def build_problem(
    spec: Spec,
    relative_to: Path | None = None,
    fit: FitKnowledge | None = None,
    work: tuple[Array, Array, Array] | None = None,
    possible: Sequence[Effect] | None = None,
) -> Problem:
    """Resolve `spec`; paths in it start from `relative_to`.

    `fit`: what the file named by `uncertainty.fit` knows; `work`: states q, v, a (N, n) of the log
    or plan that `task` names; `possible`: effects that the robot may have, in place of those that
    `task` says.

    The regressor is extended by the effects that `spec.effects` lists. The friction of the URDF's
    <dynamics> belongs to the declared model of identification, but not to the regressor of a
    motion unless it is listed: the paper's problem is about inertial parameters. Where an effect
    needs time derivatives, the cost is taken on the constraint grid, its rows weighted so that the
    motion counts as much as before.

    Of a load (`criterion.of`), the regressor has the ten columns of the link that carries it.

    Raises
    ------
    ConfigError, RobotError
        What the spec asks for does not fit the robot.
    """
    robot = with_shapes(build_robot(spec.robot, relative_to), spec.constraints)
    free = with_freedom(spec.trajectory, acceleration_bounds(spec, robot))
    spec = spec.model_copy(update={"trajectory": free})
    trajectory = build_trajectory(spec.trajectory)
    spec = with_sampling(spec, trajectory)
    cost, grid = instants(spec.sampling.cost), instants(spec.sampling.constraints)
    of_load = spec.criterion.of == "load"
    own = find_base_parameters(robot)
    base = load_parameters(robot, spec.criterion.load_link) if of_load else own
    weighting = build_weighting(spec.criterion, robot, base)
    effects = declared_effects(spec.effects, robot) if spec.effects and not of_load else ()
    extension = extend(robot, base, weighting, effects, trajectory.duration)
    criterion, prediction = build_criterion(spec.criterion), None
    if criterion.of_work and not of_load:
        bounds = acceleration_bounds(spec, robot)
        prediction = build_prediction(
            spec,
            robot,
            base,
            effects,
            bounds,
            trajectory.duration,
            len(cost),
            work,
            possible=possible,
        )
        weighting, extension = prediction.weighting, prediction.extension
    columns = base.rank + len(extension.names)
    if len(cost) * len(robot.rows) < columns and prediction is None:
        beside = f" and {len(extension.names)} of effects" if extension.names else ""
        raise ConfigError(
            f"sampling.cost: {len(cost)} samples of {len(robot.rows)} rows cannot show "
            f"{base.rank} base parameters{beside}. Take at least "
            f"{-(-columns // len(robot.rows))} samples."
        )
    if columns == 1 and criterion.compares_columns:
        raise ConfigError(
            "criterion.kind: this robot has one base parameter, so its condition number is always "
            "1. Take log_det or sigma_min."
        )
    metric = None
    if criterion.of_torques and prediction is None:
        metric = _metric(spec, robot, base, weighting, extension)
    problem = Problem(
        spec=spec,
        robot=robot,
        base=base,
        trajectory=trajectory,
        boundary=build_boundary(spec.trajectory, robot, trajectory),
        criterion=criterion,
        weighting=weighting,
        constraints=build_constraints(
            spec.constraints, robot, _uncertainty(spec, robot, own, fit), spec.measurement
        ),
        cost_basis=trajectory.basis(cost),
        constraint_basis=trajectory.basis(grid),
        kinematics=BatchKinematics(robot),
        extension=extension,
        metric=metric,
        prediction=prediction,
        work=work,
        folder=(relative_to or Path()).resolve(),
    )
    return on_fine_grid(problem) if extension.fine else problem


def with_shapes(robot: Robot, spec: ConstraintsSpec) -> Robot:
    """The robot with the shapes that its constraints look at."""
    apart = spec.self_collision
    if apart is None:
        return robot
    described = without_unusable(robot.description, apart.without_shapes)
    return replace(robot, description=described, visual_shapes=apart.shapes == "visual")


def acceleration_bounds(spec: Spec, robot: Robot) -> Array:
    """Bounds (n,) on the accelerations of joints, infinite where there is none."""
    bounds, limits = spec.constraints.joint_limits, robot.limits.acceleration
    if bounds is None or bounds.acceleration is None:
        return limits
    return np.asarray(np.minimum(limits, bounds.acceleration))


def _metric(
    spec: Spec, robot: Robot, base: BaseParameters, weighting: Weighting, extension: Extension
) -> Array:
    rows = reference_rows(robot, base, acceleration_bounds(spec, robot), weighting.rows)
    return torque_metric(rows, np.concatenate([weighting.columns, extension.scales]))


def _uncertainty(
    spec: Spec, robot: Robot, base: BaseParameters, fit: FitKnowledge | None
) -> InertiaUncertainty | None:
    if spec.uncertainty is None:
        return None
    if spec.uncertainty.fit is not None and fit is None:
        raise ConfigError(f"uncertainty.fit: {spec.uncertainty.fit} was not read for this command.")
    return inertia_uncertainty(spec.uncertainty, robot, base, fit)


def on_fine_grid(problem: Problem) -> Problem:
    """The problem with its cost on the constraint grid, every motion counting as much as before."""
    return with_cost_on(problem, problem.constraint_basis)


def with_cost_on(problem: Problem, fine: Basis) -> Problem:
    """The problem with its cost on the instants of `fine`, a motion counting as much as before."""
    share = np.sqrt(len(problem.cost_basis.times) / len(fine.times))
    weighting = problem.weighting
    weighted = replace(
        weighting,
        rows=weighting.rows * share,
        row_name=weighting.row_name if weighting.row_name != "none" else "even",
    )
    return replace(problem, cost_basis=fine, weighting=weighted)


def predicting(
    problem: Problem, kinds: Sequence[str] = (), possible: Sequence[Effect] | None = None
) -> Problem:
    """The problem with its prediction, in which these kinds of effects are possible, too.

    Made for another criterion, or without one of them, it gets a prediction beside that, with the
    effects `possible` in place of the usual ones.
    """
    there = {effect.kind for effect in problem.extension.effects}
    if problem.prediction is not None and there.issuperset(kinds):
        return problem
    made = build_prediction(
        problem.spec,
        problem.robot,
        problem.base,
        [] if problem.prediction is not None else problem.extension.effects,
        acceleration_bounds(problem.spec, problem.robot),
        problem.trajectory.duration,
        len(problem.cost_basis.times),
        problem.work,
        kinds,
        possible,
    )
    wide = replace(
        problem,
        weighting=made.weighting,
        extension=made.extension,
        prediction=made,
        separation=None,
        metric=None,
    )
    return on_fine_grid(wide) if made.extension.fine else wide
