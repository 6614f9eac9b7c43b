"""Torques from which a controller subtracted gravity, made whole again with the URDF's."""

from dataclasses import replace

import numpy as np

from excite_cli.dynamics.inverse_dynamics import InverseDynamics
from excite_cli.measurement.dataset import Dataset
from excite_cli.robot.model import Robot


def with_gravity(robot: Robot, data: Dataset) -> Dataset:
    """The data with the torque of the URDF's gravity at the recorded positions added.

    Right where the controller's model is the URDF; what its masses are off by, the torque is.
    """
    dynamics = InverseDynamics(robot)
    runs = []
    for run in data.runs:
        rest = np.zeros_like(run.q)
        # Rounding is that of what was recorded: the sum comes in no steps.
        runs.append(replace(run, tau=run.tau + dynamics.torques(run.q, rest, rest)))
    return replace(data, runs=tuple(runs))
