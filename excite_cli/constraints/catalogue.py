"""From the YAML section to the constraints of a robot."""

import numpy as np

from excite_cli.config.constraints_spec import (
    ConstraintsSpec,
    ContactSpec,
    DiscSpec,
    JointLimitsSpec,
    KeepOutSpec,
    PolygonSpec,
    SelfCollisionSpec,
)
from excite_cli.constraints.balance import Balance
from excite_cli.constraints.base import Array, Constraint
from excite_cli.constraints.ground_contact import Contact, Ground, ZeroMomentPoint
from excite_cli.constraints.joint_bound import JointBound
from excite_cli.constraints.joint_torque import JointTorque
from excite_cli.constraints.keep_out import build_keep_out
from excite_cli.constraints.mesh_clearance import KEPT, MeshClearance
from excite_cli.constraints.obstacle_clearance import Surroundings
from excite_cli.constraints.self_collision import SelfCollision
from excite_cli.constraints.support_polygon import support_polygon
from excite_cli.dynamics.center_of_mass import CenterOfMass
from excite_cli.dynamics.forward_kinematics import BatchKinematics
from excite_cli.dynamics.states import States
from excite_cli.dynamics.uncertain_inertias import InertiaUncertainty
from excite_cli.errors import ConfigError
from excite_cli.geometry.capsules import fit_capsules
from excite_cli.geometry.collision_pairs import choose_pairs
from excite_cli.geometry.obstacle_pairs import choose_obstacle_pairs, ignored_pairs
from excite_cli.geometry.obstacles import build_obstacles
from excite_cli.geometry.pair_tables import mesh_tables, require_tabled
from excite_cli.robot.model import Robot


def build_constraints(
    spec: ConstraintsSpec, robot: Robot, uncertainty: InertiaUncertainty | None = None
) -> tuple[Constraint, ...]:
    """All constraints that `spec` asks for, joint bounds first.

    Torque, balance and contact hold for every inertia that `uncertainty` admits; without it, for
    those of the URDF.

    Raises
    ------
    ConfigError
        A limit is asked for that the robot does not have and the file does not give.
    """
    found: list[Constraint] = []
    if spec.joint_limits is not None:
        found += _joint_bounds(spec.joint_limits, robot)
    if spec.torque is not None:
        found.append(_torque(spec.torque.scale, robot, uncertainty))
    if spec.balance is not None:
        found.append(_balance(spec.balance, robot, uncertainty))
    if spec.contact is not None:
        found += _contact(spec.contact, robot, uncertainty)
    found += _distances(spec, robot)
    if spec.keep_out:
        found += _keep_out(spec.keep_out, robot)
    return tuple(found)


def _distances(spec: ConstraintsSpec, robot: Robot) -> list[Constraint]:
    """Capsules against each other and against what stands around the robot."""
    found: list[Constraint] = []
    around, own = spec.surroundings, spec.self_collision
    if around is None and own is None:
        return found
    # What no position within the limits brings near is left out only if the limits are kept.
    bounded = spec.joint_limits is not None and spec.joint_limits.position
    # A link that is told from its neighbours in one of the two has a capsule of its own in both.
    apart = {link for link, _ in ignored_pairs(robot, around)} if around is not None else ()
    capsules = fit_capsules(robot, own or SelfCollisionSpec(), apart)
    if own is not None:
        pairs = choose_pairs(robot, capsules, own, bounded=bounded)
        if pairs.checked:
            found.append(SelfCollision(robot, capsules, pairs, own.margin))
        require_tabled(robot, capsules, own.by_meshes)
        tables = mesh_tables(robot, capsules, pairs, own.ignore)
        if tables:
            found.append(MeshClearance(tables, min(KEPT, own.margin)))
    if around is not None:
        obstacles = build_obstacles(around)
        beside = choose_obstacle_pairs(robot, capsules, obstacles, around, bounded)
        if beside.checked:
            found.append(Surroundings(robot, capsules, obstacles, beside))
    return found


def _keep_out(spec: dict[str, KeepOutSpec], robot: Robot) -> list[Constraint]:
    constraint = build_keep_out(spec, robot)
    return [] if constraint is None else [constraint]


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


def _torque(scale: float, robot: Robot, uncertainty: InertiaUncertainty | None) -> Constraint:
    if not np.isfinite(robot.limits.effort).any():
        raise ConfigError(
            "constraints.torque: the URDF gives no effort limits; give robot.limits.<joint>.effort."
        )
    return JointTorque(robot, scale * robot.limits.effort, uncertainty)


def _balance(
    spec: DiscSpec | PolygonSpec, robot: Robot, uncertainty: InertiaUncertainty | None
) -> Constraint:
    if isinstance(spec, PolygonSpec):
        return Balance.polygon(robot, np.array(spec.vertices), spec.margin, uncertainty)
    if spec.center == "posture":
        center = posture_center_of_mass(robot)
    else:
        center = np.array(spec.center, dtype=float)
    return Balance.disc(robot, center, spec.radius, uncertainty)


def _contact(
    spec: ContactSpec, robot: Robot, uncertainty: InertiaUncertainty | None
) -> list[Constraint]:
    ground = Ground.under(robot, uncertainty)
    if ground.weight <= 0:
        raise ConfigError(
            "constraints.contact: gravity does not press this robot on the ground. It needs a mass "
            "and robot.gravity with a negative z; leave contact out for what is not on the ground."
        )
    found: list[Constraint] = []
    center = None
    if spec.vertices is not None:
        support = support_polygon(np.array(spec.vertices), spec.margin, "constraints.contact")
        found.append(ZeroMomentPoint(ground, support, spec.height))
        center = support.center
    if center is None:
        center = posture_center_of_mass(robot)
    found.append(Contact(ground, center, spec.friction, spec.torsion, spec.min_load))
    return found


def posture_center_of_mass(robot: Robot) -> Array:
    """World x, y of the centre of mass at the posture (2,)."""
    still = np.zeros((1, robot.n))
    states = States(BatchKinematics(robot), robot.posture[None], still, still)
    return CenterOfMass(robot).position(states)[0, :2]
