"""Actuators of an identified robot as Python for Isaac Lab and mjlab.

Isaac Lab: `DelayedPDActuatorCfg`, or `ImplicitActuatorCfg` where set points act at once; its
`friction` and `dynamic_friction` are efforts from Isaac Sim 5 on. mjlab (1.3 or later):
`BuiltinPositionActuatorCfg`, one for each joint, since its numbers are those of a group. Both count
delays in physics steps, whose length the user of the file says.
"""

import re
from collections.abc import Sequence

import numpy as np

from excite_cli.export.exported import ModelText
from excite_cli.export.joint_values import JointValues
from excite_cli.robot.model import Array

_PHYSICS_STEP = 0.005  # s: the default of both


def isaaclab(robot_name: str, values: JointValues) -> ModelText:
    """A module with `ACTUATORS`, for `ArticulationCfg(actuators=ACTUATORS)`."""
    drive, names = values.drive, values.names
    delayed = drive.delay > 0.0
    kind = "DelayedPDActuatorCfg" if delayed else "ImplicitActuatorCfg"
    fields = [
        ("joint_names_expr", _list([re.escape(name) for name in names])),
        ("stiffness", _mapping(names, drive.kp)),
        ("damping", _mapping(names, drive.kd)),
        ("armature", _mapping(names, values.armature)),
        ("friction", _mapping(names, values.friction)),
        ("dynamic_friction", _mapping(names, values.friction)),
        ("viscous_friction", _mapping(names, values.damping)),
    ]
    if np.isfinite(drive.limit).any():
        limit = "effort_limit" if delayed else "effort_limit_sim"
        fields.append((limit, _mapping(names, drive.limit)))
    if delayed:
        fields += [("min_delay", "math.floor(LAG)"), ("max_delay", "math.ceil(LAG)")]
    body = "".join(f"        {name}={text},\n" for name, text in fields)
    return ModelText(
        _head(
            robot_name,
            "Isaac Lab 2.2 or later: ArticulationCfg(actuators=ACTUATORS)",
            "Friction is in N·m (N), as Isaac Sim takes it from version 5 on.",
        )
        + ("import math\n\n" if delayed else "")
        + f"from isaaclab.actuators import {kind}\n\n"
        + (_lag(drive.delay) if delayed else "")
        + f'ACTUATORS = {{\n    "drives": {kind}(\n{body}    ),\n}}\n',
        values.notes,
    )


def mjlab(robot_name: str, values: JointValues) -> ModelText:
    """A module with `ACTUATORS`, for `EntityArticulationInfoCfg(actuators=ACTUATORS)`."""
    drive = values.drive
    delayed = drive.delay > 0.0
    entries = []
    for j, name in enumerate(values.names):
        numbers = {
            "stiffness": drive.kp[j], "damping": drive.kd[j], "armature": values.armature[j],
            "frictionloss": values.friction[j], "viscous_damping": values.damping[j],
        }  # fmt: skip
        if np.isfinite(drive.limit[j]):
            numbers["effort_limit"] = drive.limit[j]
        fields = [f"target_names_expr=({re.escape(name)!r},)"]
        fields += [f"{key}={_number(value)}" for key, value in numbers.items()]
        if delayed:
            fields += ["delay_min_lag=math.floor(LAG)", "delay_max_lag=math.ceil(LAG)"]
        body = "".join(f"        {field},\n" for field in fields)
        entries.append(f"    BuiltinPositionActuatorCfg(\n{body}    ),\n")
    return ModelText(
        _head(
            robot_name,
            "mjlab 1.3 or later: EntityArticulationInfoCfg(actuators=ACTUATORS)",
            "Of a file of `--format mjcf` remove <actuator>, which mjlab adds from here.",
        )
        + ("import math\n\n" if delayed else "")
        + "from mjlab.actuator import BuiltinPositionActuatorCfg\n\n"
        + (_lag(drive.delay) if delayed else "")
        + f"ACTUATORS = (\n{''.join(entries)})\n",
        values.notes,
    )


def _head(robot_name: str, use: str, more: str) -> str:
    name = robot_name.replace("\\", "").replace('"', "")
    units = "Units: N·m/rad, N·m·s/rad, kg·m², N·m, s (N/m, N·s/m, kg, N of sliding joints)."
    return f'"""Actuators of {name}, identified by excite.\n\n{use}.\n{more}\n{units}\n"""\n\n'


def _lag(delay: float) -> str:
    return (
        f"PHYSICS_STEP = {_PHYSICS_STEP}  # s: that of your simulation\n"
        f"DELAY = {_number(delay)}  # s: from sending a set point until it acts\n"
        "LAG = round(DELAY / PHYSICS_STEP, 6)\n\n"
    )


def _number(value: float) -> str:
    return f"{float(value) + 0.0:.6g}"


def _list(names: Sequence[str]) -> str:
    return "[" + ", ".join(map(repr, names)) + "]"


def _mapping(names: Sequence[str], values: Array) -> str:
    """By joint, or one number where it is the same for all."""
    known = [(re.escape(n), x) for n, x in zip(names, values, strict=True) if np.isfinite(x)]
    if len(known) == len(names) and len({_number(x) for _, x in known}) == 1:
        return _number(known[0][1])
    return "{" + ", ".join(f"{name!r}: {_number(x)}" for name, x in known) + "}"
