"""Actuators of an identified robot for Isaac Lab and mjlab (Python), and for BAM (JSON).

Isaac Lab: `DelayedPDActuatorCfg`, or `ImplicitActuatorCfg` where set points act at once; its
`friction` and `dynamic_friction` are efforts from Isaac Sim 5 on. mjlab (1.3 or later):
`BuiltinPositionActuatorCfg`, one for each joint, since its numbers are those of a group. Both count
delays in physics steps, whose length the user of the file says.
"""

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from excite_cli.effects.base import Effect
from excite_cli.export.drive import Drive
from excite_cli.export.exported import ModelText, in_words
from excite_cli.export.mjcf import held_by_actuators, joint_parts
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.robot.model import Array, Robot

# Numbers of an identified model that actuators of simulators are made of, joint by joint.


@dataclass(frozen=True)
class JointValues:
    """Of every joint (n,): the `drive` as it is, and what is beside it.

    `armature` [kg·m²], `damping` [N·m·s/rad], `friction` [N·m] (kg, N·s/m, N of sliding joints).
    `notes`: what is in none of them.
    """

    names: tuple[str, ...]
    drive: Drive
    armature: Array
    damping: Array
    friction: Array
    notes: tuple[str, ...] = ()


def joint_values(robot: Robot, model: IdentifiedModel, drive: Drive) -> JointValues:
    """The numbers of `model`, whose robot follows set points by `drive`."""
    parts, left = joint_parts(robot, model)
    armature, damping, friction = (
        np.array([joint.get(name, 0.0) for joint in parts.joints])
        for name in ("armature", "damping", "frictionloss")
    )
    corrected = drive.corrected(model)
    notes = []
    beside = [effect for effect in left if not held_by_actuators(effect, drive)]
    if beside:
        words = in_words(beside, robot.joint_names)
        notes.append(f"not in it: {words}. The file of parameters, and C, hold that")
    for j, joint in enumerate(parts.joints):
        more = sorted(set(joint) - {"armature", "damping", "frictionloss"})
        if more:
            name = robot.joint_names[j]
            notes.append(f"not in it: {', '.join(more)} of {name}. --format mjcf has it")
    if np.any(corrected.bias):
        biased = [n for n, b in zip(robot.joint_names, corrected.bias, strict=True) if b]
        notes.append(f"not in it: offsets of the drives' torque at {', '.join(biased)}")
    return JointValues(robot.joint_names, corrected, armature, damping, friction, tuple(notes))


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


# Parameters of BAM (Better Actuator Models, Rhoban): a servo's friction by its models M1 to M4.
#
#     τ_f = b |v| + f + f_s exp(−|v/v_s|^α) + k_l |τ_external − τ_motor|
#
# M1 has `friction_viscous` b and `friction_base` f; M2 adds the Stribeck term (α = 2 here), M3
# the term of the load, M4 both. BAM's gear carries τ_external − τ_motor, which is twice the load
# where the motor holds it, so that `load_friction_base` is half the ratio of load-dependent
# friction here. The drive is BAM's `unitree_go1`, a law in N·m; its `kp` and `damping` are set by
# the log there, and stand here beside the parameters. Of several joints the file has one set of
# parameters each.

_HELD = ("viscous_friction", "coulomb_friction", "stribeck_friction", "load_dependent_friction")
_UNLIMITED = 1e6  # N·m
_EXPONENT = 2.0  # of Stribeck friction


def holds(effect: Effect, values: Array) -> bool:
    """Whether BAM has a term for this friction."""
    return effect.kind in _HELD and bool(np.all(values >= 0.0))


def bam(robot: Robot, model: IdentifiedModel, values: JointValues) -> ModelText:
    """The JSON text: of one joint its parameters, of several {joint: parameters}."""
    found = {name: _of_joint(model, values, j) for j, name in enumerate(values.names)}
    tree: Any = found if len(found) > 1 else next(iter(found.values()))
    left = [
        effect
        for effect, own in model.by_effect
        if not (holds(effect, own) or effect.kind in ("armature", "torque_gain") or effect.carried)
    ]
    notes = [f"BAM cannot hold: {in_words(left, robot.joint_names)}"] if left else []
    if len(found) > 1:
        notes.append("one set for each joint: bam.model.load_model_from_dict(data[joint])")
    return ModelText(json.dumps(tree, indent=2, ensure_ascii=False) + "\n", tuple(notes))


def _of_joint(model: IdentifiedModel, values: JointValues, j: int) -> dict[str, Any]:
    own: dict[str, tuple[Effect, float]] = {
        effect.kind: (effect, float(numbers[0]))
        for effect, numbers in model.by_effect
        if effect.joints == (j,) and not effect.runs and effect.kind in _HELD
    }
    drive = values.drive
    limit = float(drive.limit[j])
    found: dict[str, Any] = {
        "actuator": "unitree_go1",
        "ratio": 1.0,
        "max_torque": limit if np.isfinite(limit) else _UNLIMITED,
        "armature": float(values.armature[j]),
        "q_offset": 0.0,
        "command_delay": drive.delay,
        "friction_base": own["coulomb_friction"][1] if "coulomb_friction" in own else 0.0,
        "friction_viscous": own["viscous_friction"][1] if "viscous_friction" in own else 0.0,
    }
    stribeck, load = own.get("stribeck_friction"), own.get("load_dependent_friction")
    by_load = stribeck is not None and stribeck[0].shape.get("load_power") == 1.0
    if stribeck is not None:
        found |= {
            "friction_stribeck": 0.0 if by_load else stribeck[1],
            "dtheta_stribeck": float(stribeck[0].shape["stribeck_speed"]),
            "alpha": _EXPONENT,
        }
    carried = load is not None or by_load
    if carried:
        found["load_friction_base"] = 0.5 * load[1] if load is not None else 0.0
        if stribeck is not None:
            found["load_friction_stribeck"] = 0.5 * stribeck[1] if by_load else 0.0
    name = {(False, False): "m1", (True, False): "m2", (False, True): "m3", (True, True): "m4"}
    return {
        "model": name[stribeck is not None, carried],
        **found,
        "kp": float(drive.kp[j]),
        "damping": float(drive.kd[j]),
    }
