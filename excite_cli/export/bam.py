"""Parameters of BAM (Better Actuator Models, Rhoban): a servo's friction by its models M1 to M4.

    τ_f = b |v| + f + f_s exp(−|v/v_s|^α) + k_l |τ_external − τ_motor|

M1 has `friction_viscous` b and `friction_base` f; M2 adds the Stribeck term (α = 2 here), M3 the
term of the load, M4 both. BAM's gear carries τ_external − τ_motor, which is twice the load where
the motor holds it, so that `load_friction_base` is half the ratio of load-dependent friction here.
The drive is BAM's `unitree_go1`, a law in N·m; its `kp` and `damping` are set by the log there, and
stand here beside the parameters. Of several joints the file has one set of parameters each.
"""

import json
from typing import Any

import numpy as np

from excite_cli.effects.base import Effect
from excite_cli.export.exported import ModelText, in_words
from excite_cli.export.joint_values import JointValues
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.robot.model import Array, Robot

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
    if stribeck is not None:
        found |= {
            "friction_stribeck": stribeck[1],
            "dtheta_stribeck": float(stribeck[0].shape["stribeck_speed"]),
            "alpha": _EXPONENT,
        }
    if load is not None:
        found["load_friction_base"] = 0.5 * load[1]
        if stribeck is not None:
            found["load_friction_stribeck"] = 0.0
    name = {(False, False): "m1", (True, False): "m2", (False, True): "m3", (True, True): "m4"}
    return {
        "model": name[stribeck is not None, load is not None],
        **found,
        "kp": float(drive.kp[j]),
        "damping": float(drive.kd[j]),
    }
