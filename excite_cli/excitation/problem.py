"""A `Spec` made concrete: robot, base parameters, trajectory, criterion, constraints, grids."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from excite_cli.config.spec import Spec
from excite_cli.constraints.base import Array, Constraint
from excite_cli.constraints.catalogue import build_constraints
from excite_cli.criteria.base import Criterion
from excite_cli.criteria.catalogue import build_criterion
from excite_cli.errors import ConfigError
from excite_cli.excitation.objective import Objective
from excite_cli.excitation.stack import Stack
from excite_cli.excitation.weighting import Weighting, build_weighting
from excite_cli.robot.base_parameters import BaseParameters, find_base_parameters
from excite_cli.robot.forward_kinematics import BatchKinematics
from excite_cli.robot.model import Robot, build_robot
from excite_cli.robot.states import States
from excite_cli.trajectory.base import Basis, Trajectory
from excite_cli.trajectory.catalogue import build_trajectory


@dataclass(frozen=True)
class Problem:
    """Everything that is fixed while motions are sought."""

    spec: Spec
    robot: Robot
    base: BaseParameters
    trajectory: Trajectory
    criterion: Criterion
    weighting: Weighting
    constraints: tuple[Constraint, ...]
    cost_basis: Basis
    constraint_basis: Basis
    kinematics: BatchKinematics

    @property
    def variables(self) -> int:
        """Number of coefficients of one motion."""
        return self.trajectory.n_coefficients * self.robot.n

    def objective(self, stack: Stack | None = None) -> Objective:
        """The cost of one motion on top of `stack`."""
        return Objective(self.robot, self.base, self.weighting, self.cost_basis, stack)

    def states(self, coefficients: Array, basis: Basis | None = None) -> States:
        """Joint states on the constraint grid, or on `basis`."""
        return States(self.kinematics, *(basis or self.constraint_basis).states(coefficients))

    def still(self, q: Array) -> Array:
        """Coefficients of standing at `q` (n,)."""
        return self.trajectory.constant(q)


def build_problem(spec: Spec, relative_to: Path | None = None) -> Problem:
    """Resolve `spec`; paths in it start from `relative_to`.

    Raises
    ------
    ConfigError, RobotError
        What the spec asks for does not fit the robot.
    """
    robot = build_robot(spec.robot, relative_to)
    trajectory = build_trajectory(spec.trajectory)
    cost, grid = spec.sampling.cost, spec.sampling.constraints
    for name, section in (("cost", cost), ("constraints", grid)):
        if (section.samples - 1) * section.step > trajectory.duration * (1 + 1e-5):
            raise ConfigError(
                f"sampling.{name}: {section.samples} samples every {section.step:g} s last longer "
                f"than the trajectory ({trajectory.duration:g} s). Take fewer samples or a "
                "smaller step."
            )
    base = find_base_parameters(robot)
    if cost.samples * len(robot.rows) < base.rank:
        raise ConfigError(
            f"sampling.cost: {cost.samples} samples of {len(robot.rows)} rows cannot show "
            f"{base.rank} base parameters. Take at least "
            f"{-(-base.rank // len(robot.rows))} samples."
        )
    return Problem(
        spec=spec,
        robot=robot,
        base=base,
        trajectory=trajectory,
        criterion=build_criterion(spec.criterion),
        weighting=build_weighting(spec.criterion, robot, base),
        constraints=build_constraints(spec.constraints, robot),
        cost_basis=trajectory.basis(np.arange(cost.samples, dtype=float) * cost.step),
        constraint_basis=trajectory.basis(np.arange(grid.samples, dtype=float) * grid.step),
        kinematics=BatchKinematics(robot),
    )
