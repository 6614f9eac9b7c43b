"""Models of robots that follow set points, without a file."""

from typing import Any

import numpy as np

from excite_cli.config.data_spec import DriveLawSpec, EffectSpec
from excite_cli.config.load_spec import parse_spec
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.config.spec import Spec
from excite_cli.effects.catalogue import declared_effects
from excite_cli.export.drive import Drive
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.robot.model import Robot, build_robot
from excite_cli.simulation.build import true_inertias

KP = np.array([200.0, 400.0, 150.0, 20.0, 20.0, 10.0])
KD = np.array([10.0, 20.0, 5.0, 1.0, 1.0, 0.5])
LIMIT = np.array([300.0, 300.0, 100.0, np.inf, 30.0, 20.0])


def ur10() -> Robot:
    return build_robot(RobotSpec(urdf="example-robot-data:ur10"))


def drive(delay: float = 0.0) -> Drive:
    return Drive(KP, KD, LIMIT, np.zeros(6), delay)


def identified(
    robot: Robot, *specs: EffectSpec, numbers: tuple[float, ...] = ()
) -> IdentifiedModel:
    """Other inertias than the URDF's, and effects with `numbers`, by default 0.1 each."""
    effects = declared_effects(specs, robot)
    count = sum(len(effect.parameters) for effect in effects)
    values = np.array(numbers) if numbers else np.full(count, 0.1)
    return IdentifiedModel(true_inertias(robot, 0.2, seed=2), effects, values)


def spec_with(command: Any, torque: str = "command") -> Spec:
    """A config of a robot whose torque is the law of its drives."""
    spec = parse_spec("robot: {urdf: 'example-robot-data:ur10'}", "a test")
    changed = {"torque": torque, "command": DriveLawSpec(**command)}
    measurement = spec.measurement.model_copy(update=changed)
    return spec.model_copy(update={"measurement": measurement})
