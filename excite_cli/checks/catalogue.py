"""All checks by the name of their row, in the order of the table of `excite inspect`."""

from excite_cli.checks.base import Check
from excite_cli.checks.bodies import ImpossibleBodies
from excite_cli.checks.column_order import ColumnOrder
from excite_cli.checks.gravity_direction import GravityDirection
from excite_cli.checks.gravity_subtracted import GravitySubtracted
from excite_cli.checks.joint_sign import PositionSign, TorqueSign
from excite_cli.checks.joint_zero import JointZero
from excite_cli.checks.position_unit import PositionUnit
from excite_cli.checks.setup_check import SetupCheck
from excite_cli.checks.solids import MisfitSolids
from excite_cli.checks.time_scale import Clock, TorqueLag
from excite_cli.checks.tool import Tool
from excite_cli.checks.torque_unit import TorqueUnit
from excite_cli.checks.two_sides import UnequalHalves
from excite_cli.checks.zero_limits import ZeroLimits
from excite_cli.registry import Registry

CHECKS: Registry[Check] = Registry(
    "check",
    "excite.checks",
    Check,
    (
        ImpossibleBodies,
        MisfitSolids,
        UnequalHalves,
        ZeroLimits,
        GravityDirection,
        JointZero,
        PositionSign,
        TorqueSign,
        ColumnOrder,
        TorqueUnit,
        PositionUnit,
        GravitySubtracted,
        Clock,
        TorqueLag,
        Tool,
    ),
)


def description_checks() -> list[Check]:
    """Those that look at the robot alone."""
    return [found() for found in CHECKS.members.values() if found.of_description]


def setup_checks() -> list[SetupCheck]:
    """Those whose mistakes are sought together."""
    return [found() for found in CHECKS.members.values() if issubclass(found, SetupCheck)]


def log_checks() -> list[Check]:
    """Those that look at the log by themselves."""
    return [
        found()
        for found in CHECKS.members.values()
        if not (found.of_description or issubclass(found, SetupCheck))
    ]
