"""All checks by the name of their row, in the order of the table of `excite inspect`."""

from excite_cli.checks.base import Check, DescriptionCheck
from excite_cli.checks.setup_check import SetupCheck
from excite_cli.registry import Registry

CHECKS: Registry[Check] = Registry(
    "check",
    "excite.checks",
    Check,
    {
        "bodies of the description": "bodies:ImpossibleBodies",
        "masses and shapes of links": "solids:MisfitSolids",
        "left-right symmetry": "two_sides:UnequalHalves",
        "limits of the description": "zero_limits:ZeroLimits",
        "direction of gravity": "gravity_direction:GravityDirection",
        "zero of every joint": "joint_zero:JointZero",
        "signs of positions": "joint_sign:PositionSign",
        "signs of torques": "joint_sign:TorqueSign",
        "order of columns": "column_order:ColumnOrder",
        "coupling of motors": "coupled_motors:CoupledMotors",
        "unit of torques": "torque_unit:TorqueUnit",
        "unit of positions": "position_unit:PositionUnit",
        "gravity left in the torques": "gravity_subtracted:GravitySubtracted",
        "clock": "time_scale:Clock",
        "delay of torques": "time_scale:TorqueLag",
        "tool or load": "tool:Tool",
    },
)


def description_checks() -> list[DescriptionCheck]:
    """Those that look at the robot alone."""
    return [each for each in _every() if isinstance(each, DescriptionCheck)]


def setup_checks() -> list[SetupCheck]:
    """Those whose mistakes are sought together."""
    return [each for each in _every() if isinstance(each, SetupCheck)]


def log_checks() -> list[Check]:
    """Those that look at the log by themselves."""
    return [each for each in _every() if not isinstance(each, DescriptionCheck | SetupCheck)]


def _every() -> list[Check]:
    return [found() for found in CHECKS.members.values()]
