"""Short simulations of an arm, and what its rigid bodies say about the recorded torque."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.catalogue import kind_named
from excite_cli.measurement.dataset import Run
from excite_cli.robot.model import Array, Robot, build_robot
from excite_cli.simulation.ground_truth import PlantedEffect, plant
from excite_cli.simulation.planned_motion import PlannedMotion
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import Simulation, simulate
from excite_cli.trajectory.fourier import FourierTrajectory

# Perfect instruments: what is left then is the robot's.
IDEAL = SimulationSettings(torque_noise=0.0, encoder=0.0, lead_in=0.5)
ELBOW = 2
SECONDS = 4.0


def arm() -> Robot:
    """The UR10; its elbow carries about 25 N·m here."""
    return build_robot(RobotSpec(urdf="example-robot-data:ur10"))


def drawn(
    robot: Robot, name: str, seed: int, seconds: float, size: ArrayLike, middle: ArrayLike
) -> PlannedMotion:
    """Three harmonics about `middle` (n), with coefficients of the deviation `size` (n)."""
    trajectory = FourierTrajectory(3, 2 * np.pi / seconds)
    shape = (trajectory.n_coefficients, robot.n)
    coefficients = np.asarray(size) * np.random.default_rng(seed).normal(size=shape)
    coefficients[-1] = middle
    return PlannedMotion(name, trajectory, coefficients)


def motion(robot: Robot, seed: int = 0, name: str = "motion_1") -> PlannedMotion:
    """A lively motion of three harmonics."""
    middle = [0.3, -1.0, 1.0, -0.5, 0.7, 0.2][: robot.n]
    return drawn(robot, name, seed, SECONDS, 0.15, middle)


def about_posture(robot: Robot, name: str, seed: int, seconds: float) -> PlannedMotion:
    """The same of any robot with a posture: 0.15 rad, 0.015 m."""
    size = np.where(robot.sliding, 0.015, 0.15)
    return drawn(robot, name, seed, seconds, size, robot.posture)


def planted(kind: str, joints: tuple[int, ...], value: float, **others: float) -> PlantedEffect:
    return plant(kind_named(kind), joints, value, others)


def played(
    robot: Robot, *effects: PlantedEffect, settings: SimulationSettings = IDEAL, **changes: object
) -> Simulation:
    settings = replace(settings, **changes)  # type: ignore[arg-type]
    return simulate(robot, [motion(robot)], settings, effects)


def states(run: Run) -> tuple[Array, Array, Array]:
    """q, v, a of a run with perfect encoders."""
    spline = CubicSpline(run.t, run.q)
    return run.q, spline(run.t, 1), spline(run.t, 2)


def beyond_rigid(robot: Robot, simulation: Simulation, run: int = 0) -> Array:
    """Recorded torque less that of the true rigid bodies, borders left out."""
    record = simulation.dataset.runs[run]
    body = RigidBody(robot, simulation.truth.phi, *states(record))
    return inner(record.tau - body.load)


def inner(x: Array) -> Array:
    """Without the ends, where a spline's derivatives are poor."""
    return x[20:-20]


def rms(x: Array) -> Array:
    return np.sqrt(np.mean(np.asarray(x) ** 2, axis=0))


def slipping(run: Run, joint: int, least: float = 0.01) -> Array:
    """Samples at which a joint surely moves, and does so two samples before and after."""
    speed = np.abs(states(run)[1][:, joint]) > least
    return inner(np.convolve(speed, np.ones(5), "same") > 4.5)
