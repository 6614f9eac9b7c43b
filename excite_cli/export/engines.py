"""A model inside an engine that runs in this process: Pinocchio, and MuJoCo by way of its MJCF."""

from typing import Any

import numpy as np

from excite_cli.dynamics.rigid_body import robot_with
from excite_cli.effects.base import Effect
from excite_cli.effects.mechanism import MjcfParts
from excite_cli.export.mjcf import joint_parts
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.robot.model import Array, Robot
from excite_cli.simulation.mujoco_model import load_mujoco, silent_engine


def pinocchio_model(robot: Robot, model: IdentifiedModel) -> tuple[Any, list[Effect]]:
    """A `pin.Model` with the model's inertias, and the effects whose torque `pin.rnea` lacks.

    It has what the robot carries, gravity as the base stands, and rotors as `armature`; `damping`
    and `friction` are numbers in it that Pinocchio's inverse dynamics does not look at.
    """
    parts, _ = joint_parts(robot, model)
    found = robot_with(robot, model.phi + model.carried(robot))
    found.gravity.linear = parts.gravity
    at = [found.joints[joint].idx_v for joint in robot.model_joints]
    for name, told in (
        ("armature", "armature"),
        ("damping", "damping"),
        ("upperDryFrictionLimit", "frictionloss"),
        ("lowerDryFrictionLimit", "frictionloss"),
    ):
        values = np.zeros(found.nv)
        values[at] = [own.get(told, 0.0) for own in parts.joints]
        setattr(found, name, -values if name.startswith("lower") else values)
    left = [effect for effect, values in model.by_effect if not _in_rnea(robot, effect, values)]
    return found, left


def _in_rnea(robot: Robot, effect: Effect, values: Array) -> bool:
    """Whether a body, a rotor or the way of gravity is all that the effect is."""
    parts = MjcfParts([{} for _ in range(robot.n)], np.array(robot.model.gravity.linear))
    if effect.carried:
        return not effect.runs
    held = not effect.runs and effect.put_into_mjcf(parts, values)
    return held and not parts.tendons and all({*own} <= {"armature"} for own in parts.joints)


def mujoco_model(text: str) -> Any:
    """A `mujoco.MjModel` of an MJCF.

    Raises
    ------
    MissingExtraError
        MuJoCo is not installed.
    """
    with silent_engine():
        return load_mujoco().MjModel.from_xml_string(text)
