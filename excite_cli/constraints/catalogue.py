"""All constraints by their key in the YAML file, and those that a config asks for."""

import inspect
from collections import Counter
from collections.abc import Collection, Iterable, Mapping

from excite_cli.config.constraints_spec import ConstraintsSpec
from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.constraints.base import Constraint
from excite_cli.constraints.setting import Setting
from excite_cli.constraints.standing import Standing
from excite_cli.dynamics.uncertain_inertias import InertiaUncertainty
from excite_cli.errors import ConfigError
from excite_cli.registry import Registry
from excite_cli.robot.model import Robot

_SECTIONS = frozenset(ConstraintsSpec.model_fields)


def _flaw(found: type[Constraint], known: Collection[str]) -> str:
    """What is wrong with the name of a constraint of a package; empty if nothing is."""
    return f"'{found.name}' is a key of `constraints`." if found.name in _SECTIONS else ""


CONSTRAINTS: Registry[Constraint] = Registry(
    "constraint",
    "excite.constraints",
    Constraint,
    {
        "joint_limits": "joint_bound:JointBound",
        "torque": "joint_torque:JointTorque",
        "tracking_error": "tracking_error:TrackingError",
        "balance": "balance:Balance",
        "contact": "ground_contact:GroundContact",
        "self_collision": "self_collision:SelfCollision",
        "surroundings": "obstacle_clearance:Surroundings",
        "keep_out": "keep_out:KeepOut",
    },
    flaw_in=_flaw,
)


def own_constraints() -> Mapping[str, type[Constraint]]:
    """Those without a section of their own in the YAML: they stand under `constraints.own`."""
    return {name: each for name, each in CONSTRAINTS.members.items() if name not in _SECTIONS}


def settings_of(constraint: type[Constraint]) -> list[inspect.Parameter]:
    """What `constraints.own.<name>` may set: what it is built with beside the robot."""
    return list(inspect.signature(constraint).parameters.values())[1:]


def build_constraints(
    spec: ConstraintsSpec,
    robot: Robot,
    uncertainty: InertiaUncertainty | None = None,
    measurement: MeasurementSpec = MeasurementSpec(),
) -> tuple[Constraint, ...]:
    """All constraints that `spec` asks for, joint bounds first.

    Torque, balance and contact hold for every inertia that `uncertainty` admits; without it, for
    those of the URDF. Limits of drives that follow set points are those of `measurement`.

    Raises
    ------
    ConfigError
        A limit is requested that the robot does not have and the file does not give, or one of
        `own` is not in the catalogue, or has settings that do not fit.
    """
    setting = Setting(spec, robot, uncertainty, measurement)
    found: list[Constraint] = []
    for key, member in CONSTRAINTS.members.items():
        given = getattr(spec, key) if key in _SECTIONS else None
        if given is not None:
            found += member.build(given, setting)
    for name, numbers in spec.own.items():
        found += _own(name, numbers, setting)
    if spec.any_speed:
        found += [Standing(each) for each in found if each.of_forces]
    for name, count in Counter(each.name for each in found).items():
        if count > 1:
            raise ConfigError(f"constraints: {count} are called '{name}'. Rename that of `own`.")
    return tuple(found)


def _own(name: str, given: dict[str, float], setting: Setting) -> Iterable[Constraint]:
    where = f"constraints.own.{name}"
    known = own_constraints()
    found = CONSTRAINTS.named(name, where, tuple(known))
    try:
        inspect.signature(found).bind(setting.robot, **given)
    except TypeError as error:
        allowed = ", ".join(each.name for each in settings_of(found))
        raise ConfigError(f"{where}: {error}. Settings: {allowed}.") from error
    return found.build(given, setting)
