"""A `Spec` made concrete: robot, base parameters, trajectory, criterion, constraints, grids."""

from dataclasses import dataclass
from pathlib import Path

from excite_cli.config.spec import Spec
from excite_cli.constraints.base import Array, Constraint
from excite_cli.constraints.catalogue import build_constraints
from excite_cli.criteria.base import Criterion
from excite_cli.criteria.catalogue import build_criterion
from excite_cli.errors import ConfigError
from excite_cli.excitation.objective import Objective
from excite_cli.excitation.sampling import instants, with_sampling
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
    spec = with_sampling(spec, trajectory)
    cost, grid = instants(spec.sampling.cost), instants(spec.sampling.constraints)
    base = find_base_parameters(robot)
    if len(cost) * len(robot.rows) < base.rank:
        raise ConfigError(
            f"sampling.cost: {len(cost)} samples of {len(robot.rows)} rows cannot show "
            f"{base.rank} base parameters. Take at least "
            f"{-(-base.rank // len(robot.rows))} samples."
        )
    if base.rank == 1 and "condition" in spec.criterion.kind:
        raise ConfigError(
            "criterion.kind: this robot has one base parameter, so its condition number is always "
            "1. Take log_det or sigma_min."
        )
    return Problem(
        spec=spec,
        robot=robot,
        base=base,
        trajectory=trajectory,
        criterion=build_criterion(spec.criterion),
        weighting=build_weighting(spec.criterion, robot, base),
        constraints=build_constraints(spec.constraints, robot),
        cost_basis=trajectory.basis(cost),
        constraint_basis=trajectory.basis(grid),
        kinematics=BatchKinematics(robot),
    )
