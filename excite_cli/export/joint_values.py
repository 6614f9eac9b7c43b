"""Numbers of an identified model that actuators of simulators are made of, joint by joint."""

from dataclasses import dataclass

import numpy as np

from excite_cli.export.drive import Drive
from excite_cli.export.exported import in_words
from excite_cli.export.mjcf import joint_parts
from excite_cli.export.mjcf_actuators import held_by_actuators
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.robot.model import Array, Robot


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
    beside = [effect for effect in left if not held_by_actuators(effect)]
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
