"""All constraints by their key in the YAML file, and how each is built from what stands there."""

import inspect
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from excite_cli.config.constraints_spec import (
    ConstraintsSpec,
    ContactSpec,
    DiscSpec,
    JointLimitsSpec,
    KeepOutSpec,
    PolygonSpec,
    SelfCollisionSpec,
    SurroundingsSpec,
    TorqueSpec,
)
from excite_cli.constraints.balance import Balance
from excite_cli.constraints.base import Array, Constraint
from excite_cli.constraints.ground_contact import Ground, GroundContact, ZeroMomentPoint
from excite_cli.constraints.joint_bound import JointBound
from excite_cli.constraints.joint_torque import JointTorque
from excite_cli.constraints.keep_out import build_keep_out
from excite_cli.constraints.mesh_clearance import KEPT, MeshClearance
from excite_cli.constraints.motor_limits import MotorBound, MotorTorque
from excite_cli.constraints.obstacle_clearance import Surroundings
from excite_cli.constraints.self_collision import SelfCollision
from excite_cli.constraints.standing import Standing
from excite_cli.constraints.support_polygon import support_polygon
from excite_cli.dynamics.center_of_mass import CenterOfMass
from excite_cli.dynamics.forward_kinematics import BatchKinematics, States
from excite_cli.dynamics.uncertain_inertias import InertiaUncertainty
from excite_cli.errors import ConfigError, nearest
from excite_cli.geometry.capsules import fit_capsules
from excite_cli.geometry.collision_pairs import choose_pairs
from excite_cli.geometry.obstacle_pairs import choose_obstacle_pairs, ignored_pairs
from excite_cli.geometry.obstacles import build_obstacles
from excite_cli.geometry.pair_tables import mesh_tables, require_tabled
from excite_cli.measurement.motors import Motors
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.model import Robot


@dataclass(frozen=True)
class Setting:
    """What every constraint of a problem is built for."""

    spec: ConstraintsSpec
    robot: Robot
    uncertainty: InertiaUncertainty | None = None

    @property
    def bounded(self) -> bool:
        """Whether positions are kept: only then what they never bring near may be left out."""
        return self.spec.joint_limits is not None and self.spec.joint_limits.position

    @cached_property
    def capsules(self) -> tuple[Capsule, ...]:
        """Those of self-collision and of surroundings.

        A link that is told from its neighbours in one of the two has one of its own in both.
        """
        around, own = self.spec.surroundings, self.spec.self_collision
        apart = {link for link, _ in ignored_pairs(self.robot, around)} if around else ()
        return fit_capsules(self.robot, own or SelfCollisionSpec(), apart)


def build_constraints(
    spec: ConstraintsSpec, robot: Robot, uncertainty: InertiaUncertainty | None = None
) -> tuple[Constraint, ...]:
    """All constraints that `spec` asks for, joint bounds first.

    Torque, balance and contact hold for every inertia that `uncertainty` admits; without it, for
    those of the URDF.

    Raises
    ------
    ConfigError
        A limit is requested that the robot does not have and the file does not give, or one of
        `own` is not in the catalogue, or has settings that do not fit.
    """
    setting = Setting(spec, robot, uncertainty)
    found: list[Constraint] = []
    for key, build in CONSTRAINTS.items():
        given = getattr(spec, key)
        if given is not None:
            found += build(given, setting)
    found += [_own(name, given, robot) for name, given in spec.own.items()]
    if spec.any_speed:
        found += [Standing(each) for each in found if each.of_forces]
    return tuple(found)


def _own(name: str, given: dict[str, float], robot: Robot) -> Constraint:
    where = f"constraints.own.{name}"
    if name not in OWN:
        known = ", ".join(OWN) or "none; a line in excite_cli/constraints/catalogue.py adds one"
        raise ConfigError(
            f"{where}: there is no constraint of this name.{nearest(name, OWN)} Known: {known}."
        )
    build = OWN[name]
    try:
        settings = inspect.signature(build).bind(robot, **given)
    except TypeError as error:
        _, *allowed = inspect.signature(build).parameters
        raise ConfigError(f"{where}: {error}. Settings: {', '.join(allowed)}.") from error
    return build(*settings.args, **settings.kwargs)


def _self_collision(spec: SelfCollisionSpec, setting: Setting) -> Iterable[Constraint]:
    robot, capsules = setting.robot, setting.capsules
    pairs = choose_pairs(robot, capsules, spec, bounded=setting.bounded)
    require_tabled(robot, capsules, spec.by_meshes)
    tables = mesh_tables(robot, capsules, pairs, spec.ignore)
    meshes = [MeshClearance(tables, min(KEPT, spec.margin))] if tables else []
    if not pairs.checked:
        return meshes
    tabled = tuple((table.first, table.second) for each in meshes for table in each.tables)
    return [SelfCollision(robot, capsules, pairs, spec.margin, tabled), *meshes]


def _surroundings(spec: SurroundingsSpec, setting: Setting) -> Iterable[Constraint]:
    robot, capsules, obstacles = setting.robot, setting.capsules, build_obstacles(spec)
    pairs = choose_obstacle_pairs(robot, capsules, obstacles, spec, setting.bounded)
    return [Surroundings(robot, capsules, obstacles, pairs)] if pairs.checked else []


def _keep_out(spec: dict[str, KeepOutSpec], setting: Setting) -> Iterable[Constraint]:
    constraint = build_keep_out(spec, setting.robot)
    return [] if constraint is None else [constraint]


def _joint_bounds(spec: JointLimitsSpec, setting: Setting) -> Iterable[Constraint]:
    robot = setting.robot
    found: list[Constraint] = []
    limits, names = robot.limits, robot.joint_names
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
    of_motors = [] if robot.motors is None else _motor_bounds(spec, robot.motors)
    return [bound for bound in (*found, *of_motors) if bound.labels]


def _motor_bounds(spec: JointLimitsSpec, motors: Motors) -> Iterable[Constraint]:
    """As those of joints, for motors that drive several."""
    if spec.position:
        yield MotorBound(motors, 0, *motors.ranges())
    if spec.velocity is not False:
        speed = spec.scale * motors.bounds("velocity")
        yield MotorBound(motors, 1, -speed, speed)
    acceleration = motors.bounds("acceleration")
    yield MotorBound(motors, 2, -acceleration, acceleration)


def _torque(spec: TorqueSpec, setting: Setting) -> Iterable[Constraint]:
    robot = setting.robot
    of_motors = np.full(robot.n, np.inf)
    if robot.motors is not None:
        of_motors = spec.scale * robot.motors.bounds("effort")
    found: list[Constraint] = []
    if np.isfinite(of_motors).any():
        found.append(MotorTorque(robot, of_motors, setting.uncertainty))
    if not found and not np.isfinite(robot.limits.effort).any():
        raise ConfigError(
            "constraints.torque: the URDF gives no effort limits; give robot.limits.<joint>.effort."
        )
    if np.isfinite(robot.limits.effort).any():
        found.insert(0, JointTorque(robot, spec.scale * robot.limits.effort, setting.uncertainty))
    return found


def _balance(spec: DiscSpec | PolygonSpec, setting: Setting) -> Iterable[Constraint]:
    robot, uncertainty = setting.robot, setting.uncertainty
    if isinstance(spec, PolygonSpec):
        return [Balance.polygon(robot, np.array(spec.vertices), spec.margin, uncertainty)]
    if spec.center == "posture":
        center = posture_center_of_mass(robot)
    else:
        center = np.array(spec.center, dtype=float)
    return [Balance.disc(robot, center, spec.radius, uncertainty)]


def _contact(spec: ContactSpec, setting: Setting) -> Iterable[Constraint]:
    robot = setting.robot
    ground = Ground.under(robot, setting.uncertainty)
    if ground.weight <= 0:
        raise ConfigError(
            "constraints.contact: gravity does not press this robot on the ground. It needs a mass "
            "and robot.gravity with a negative z; leave contact out for what is not on the ground."
        )
    found: list[Constraint] = []
    center = None
    if spec.vertices is not None:
        feet = np.array(spec.vertices, dtype=float)
        support = support_polygon(feet, spec.margin, "constraints.contact")
        found.append(ZeroMomentPoint(ground, support, spec.height, feet))
        center = support.center
    if center is None:
        center = posture_center_of_mass(robot)
    found.append(GroundContact(ground, center, spec.friction, spec.torsion, spec.min_load))
    return found


def posture_center_of_mass(robot: Robot) -> Array:
    """World x, y of the centre of mass at the posture (2,)."""
    still = np.zeros((1, robot.n))
    states = States(BatchKinematics(robot), robot.posture[None], still, still)
    return CenterOfMass(robot).position(states)[0, :2]


# By key of `ConstraintsSpec`, in the order in which a problem has them.
CONSTRAINTS: dict[str, Callable[[Any, Setting], Iterable[Constraint]]] = {
    "joint_limits": _joint_bounds,
    "torque": _torque,
    "balance": _balance,
    "contact": _contact,
    "self_collision": _self_collision,
    "surroundings": _surroundings,
    "keep_out": _keep_out,
}
# One's own by name, called with the robot and the numbers under `constraints.own.<name>`.
OWN: dict[str, Callable[..., Constraint]] = {}
