"""Actuators of an exported MuJoCo model whose robot follows position set points.

    force = clip(k_p (ctrl − q) − k_v v, ±limit)

is `<position>` with `kp`, `kv` and `forcerange`; where the law is off by a constant, `<general>`
with the same coefficients and that constant. The set point acts after `delay`, if the installed
MuJoCo knows that; else the delay stands in a comment and as the number `command_delay`.
"""

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from math import ceil, isfinite

from excite_cli.effects.base import Effect
from excite_cli.export.drive import Drive
from excite_cli.export.exported import number

# s: a delay is usually a multiple of the physics step; rounding must not make it a step more.
_ROUNDING = 1e-7
_SHORTEST_STEP = 5e-4  # s: a physics step for which the history of set points is long enough


def held_by_actuators(effect: Effect) -> bool:
    """Whether the actuators' coefficients hold it."""
    return effect.kind in ("torque_gain", "torque_offset") and not effect.runs


def add_actuators(root: ElementTree.Element, joint_names: Sequence[str], drive: Drive) -> list[str]:
    """An actuator for each joint, named after it; sentences for who uses the file."""
    delayed = drive.delay > 0.0 and _knows_delays()
    actuators = ElementTree.SubElement(root, "actuator")
    for j, name in enumerate(joint_names):
        kp, kd, bias = float(drive.kp[j]), float(drive.kd[j]), float(drive.bias[j])
        settings = {"name": name, "joint": name}
        if bias == 0.0:
            kind, law = "position", {"kp": number(kp), "kv": number(kd)}
        else:
            numbers = " ".join(map(number, (bias, -kp, -kd)))
            kind, law = "general", {"biastype": "affine", "gainprm": number(kp), "biasprm": numbers}
        settings.update(law)
        limit = float(drive.limit[j])
        if isfinite(limit):
            settings.update(forcelimited="true", forcerange=f"{number(-limit)} {number(limit)}")
        if delayed:
            history = ceil(drive.delay / _SHORTEST_STEP) + 1
            late = round(max(drive.delay - _ROUNDING, _ROUNDING), 9)
            settings.update(delay=number(late), nsample=str(history), interp="zoh")
        ElementTree.SubElement(actuators, kind, settings)
    if drive.delay > 0.0 and not delayed:
        text = f" A set point acts {number(drive.delay)} s after it was sent: delay ctrl by that. "
        root.insert(list(root).index(actuators), ElementTree.Comment(text))
        custom = ElementTree.SubElement(root, "custom")
        numeric = {"name": "command_delay", "data": number(drive.delay)}
        ElementTree.SubElement(custom, "numeric", numeric)
        return [
            f"this version of MuJoCo has no delays: delay ctrl by {drive.delay:g} s yourself "
            "(numeric command_delay)"
        ]
    if delayed:
        return [
            f"actuators delay ctrl by {drive.delay:g} s: with physics steps of "
            f"{1e3 * _SHORTEST_STEP:g} ms or more; nsample is the history of a finer one"
        ]
    return []


def _knows_delays() -> bool:
    """Whether the installed MuJoCo has actuators with a delay; so it is if it is not installed."""
    if find_spec("mujoco") is None:
        return True
    return hasattr(import_module("mujoco").MjModel, "actuator_delay")
