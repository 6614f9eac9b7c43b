"""A model inside Pinocchio, in this process."""

from typing import Any

import numpy as np

from excite_cli.dynamics.rigid_body import robot_with
from excite_cli.effects.base import Effect
from excite_cli.effects.mechanism import MjcfParts
from excite_cli.export.mjcf import joint_parts
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.robot.model import Array, Robot


def pinocchio_model(robot: Robot, model: IdentifiedModel) -> tuple[Any, list[Effect]]:
    """A `pin.Model` of bodies, gravity and rotors, and the effects whose torque it lacks."""
    parts, _ = joint_parts(robot, model)
    found = robot_with(robot, model.phi + model.carried(robot))
    found.gravity.linear = parts.gravity
    rotors = np.zeros(found.nv)
    for joint, own in zip(robot.model_joints, parts.joints, strict=True):
        rotors[found.joints[joint].idx_v] = own.get("armature", 0.0)
    found.armature = rotors
    return found, [each for each, values in model.by_effect if not _within(robot, each, values)]


def _within(robot: Robot, effect: Effect, values: Array) -> bool:
    """Whether a body, a rotor or the way of gravity is all that the effect is."""
    parts = MjcfParts([{} for _ in range(robot.n)], np.array(robot.model.gravity.linear))
    held = effect.carried or effect.put_into_mjcf(parts, values)
    return held and not parts.tendons and all({*own} <= {"armature"} for own in parts.joints)
