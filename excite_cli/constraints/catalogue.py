"""From the YAML section to the constraints of a robot."""

import numpy as np

from excite_cli.config.constraints_spec import (
    ConstraintsSpec,
    DiscSpec,
    JointLimitsSpec,
    PolygonSpec,
)
from excite_cli.constraints.balance import Balance
from excite_cli.constraints.base import Array, Constraint
from excite_cli.constraints.joint_bound import JointBound
from excite_cli.constraints.joint_torque import JointTorque
from excite_cli.constraints.self_collision import SelfCollision
from excite_cli.errors import ConfigError
from excite_cli.robot.capsules import fit_capsules
from excite_cli.robot.center_of_mass import CenterOfMass
from excite_cli.robot.collision_pairs import choose_pairs
from excite_cli.robot.forward_kinematics import BatchKinematics
from excite_cli.robot.model import Robot
from excite_cli.robot.states import States


def build_constraints(spec: ConstraintsSpec, robot: Robot) -> tuple[Constraint, ...]:
    """All constraints that `spec` asks for, joint bounds first.

    Raises
    ------
    ConfigError
        A limit is asked for that the robot does not have and the file does not give.
    """
    found: list[Constraint] = []
    if spec.joint_limits is not None:
        found += _joint_bounds(spec.joint_limits, robot)
    if spec.torque is not None:
        found.append(_torque(spec.torque.scale, robot))
    if spec.balance is not None:
        found.append(_balance(spec.balance, robot))
    if spec.self_collision is not None:
        capsules = fit_capsules(robot, spec.self_collision)
        pairs = choose_pairs(robot, capsules, spec.self_collision)
        if pairs.checked:
            margin = spec.self_collision.margin
            found.append(SelfCollision(robot, capsules, pairs, margin))
    return tuple(found)


def _joint_bounds(spec: JointLimitsSpec, robot: Robot) -> list[Constraint]:
    limits, names = robot.limits, robot.joint_names
    found: list[Constraint] = []
    if spec.position:
        lower = limits.lower + spec.position_margin
        upper = limits.upper - spec.position_margin
        crossed = [n for n, low, high in zip(names, lower, upper, strict=True) if low >= high]
        if crossed:
            raise ConfigError(
                f"constraints.joint_limits.position_margin: {spec.position_margin:g} leaves no "
                f"range for {', '.join(crossed)}."
            )
        found.append(JointBound.between(0, lower, upper, robot))
    if spec.velocity is not False:
        given = None if spec.velocity is True else float(spec.velocity)
        speed = limits.velocity if given is None else np.minimum(limits.velocity, given)
        speed = spec.scale * speed
        found.append(JointBound.between(1, -speed, speed, robot))
    acceleration = limits.acceleration
    if spec.acceleration is not None:
        acceleration = np.minimum(acceleration, spec.acceleration)
    found.append(JointBound.between(2, -acceleration, acceleration, robot))
    return [bound for bound in found if bound.labels]


def _torque(scale: float, robot: Robot) -> Constraint:
    if not np.isfinite(robot.limits.effort).any():
        raise ConfigError(
            "constraints.torque: the URDF gives no effort limits; give robot.limits.<joint>.effort."
        )
    return JointTorque(robot, scale * robot.limits.effort)


def _balance(spec: DiscSpec | PolygonSpec, robot: Robot) -> Constraint:
    if isinstance(spec, PolygonSpec):
        return Balance.polygon(robot, np.array(spec.vertices), spec.margin)
    if spec.center == "posture":
        center = posture_center_of_mass(robot)
    else:
        center = np.array(spec.center, dtype=float)
    return Balance.disc(robot, center, spec.radius)


def posture_center_of_mass(robot: Robot) -> Array:
    """World x, y of the centre of mass at the posture (2,)."""
    still = np.zeros((1, robot.n))
    states = States(BatchKinematics(robot), robot.posture[None], still, still)
    return CenterOfMass(robot).position(states)[0, :2]
