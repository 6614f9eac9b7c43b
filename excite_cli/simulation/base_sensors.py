"""What sensors of a standing robot hold: wrenches that it gets from the ground, its base's motion.

The simulated base is held by springs of the ground through its six joints. What they give is shared
out among the declared sensors, as even soles would; the torque of joints between a sensor and the
base is what it is with the wrench acting there.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from excite_cli.base_link.state import reference_rotation, unit_on_base
from excite_cli.base_link.wrench_rows import frames_of, sign_of
from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.config.wrench_spec import ImuSpec
from excite_cli.dynamics.contact_frames import contact_jacobians, readings
from excite_cli.measurement.base_channel import of_base_state, of_imu, of_wrench
from excite_cli.measurement.dataset import Array, Run
from excite_cli.robot.model import Robot
from excite_cli.simulation.settings import SimulationSettings

_LEVER = 0.1  # m: a sole gives way to a moment as to a force at this lever


@dataclass(frozen=True)
class Instruments:
    """What measures the base, as a config declares it, and with which noise."""

    measurement: MeasurementSpec
    settings: SimulationSettings

    def logged(self, robot: Robot, run: Run, gravity: Array, rng: np.random.Generator) -> Run:
        """The run without the joints of the base, their sensors' channels among `extra`.

        `gravity` (3,) is that of the simulated world, whatever the model says.
        """
        count, settings = robot.base_joints, self.settings
        tau = run.tau[:, count:].copy()
        sensors = frames_of(robot, self.measurement.wrench)
        scale = np.tile([1.0, 1.0, 1.0, _LEVER, _LEVER, _LEVER], len(sensors))
        wrenches = np.empty((len(run.t), len(sensors), 6))
        for t, parts in enumerate(contact_jacobians(robot, sensors, run.q)):
            stacked = np.vstack(parts)
            base, joints = stacked[:, :count], stacked[:, count:]
            shared = scale * np.linalg.lstsq(base.T * scale, run.tau[t, :count], rcond=None)[0]
            tau[t] -= joints.T @ shared
            wrenches[t] = shared.reshape(-1, 6)
        noise = np.repeat([settings.force_noise, settings.moment_noise], 3)
        extra = dict(run.extra)
        for k, spec in enumerate(self.measurement.wrench):
            held = wrenches[:, k] + noise * rng.normal(size=wrenches[:, k].shape)
            extra[of_wrench(spec).name] = sign_of(spec) * held
        moves = self.measurement.base
        if moves.imu is not None:
            extra |= self._unit(robot, run, moves.imu, gravity, rng)
        else:
            extra |= {channel.name: _pose(robot, run) for channel in of_base_state(moves)}
        dq = None if run.dq is None else run.dq[:, count:]
        return replace(run, q=run.q[:, count:], dq=dq, tau=tau, extra=extra)

    def _unit(
        self, robot: Robot, run: Run, spec: ImuSpec, gravity: Array, rng: np.random.Generator
    ) -> dict[str, Array]:
        """Rates and specific forces of the unit, with noise."""
        spline = CubicSpline(run.t, run.q)
        states = run.q, spline(run.t, 1), spline(run.t, 2)
        place = unit_on_base(robot, spec.link)
        rates, forces = readings(robot, robot.base_joints - 1, place, states, gravity)
        settings = self.settings
        rates = rates + settings.rate_noise * rng.normal(size=rates.shape)
        forces = forces + settings.acceleration_noise * rng.normal(size=forces.shape)
        both = np.hstack([rates, forces])
        names = [channel.name for channel in of_imu(spec)]
        return dict(zip(names, np.split(both, len(names), axis=1), strict=True))


def _pose(robot: Robot, run: Run) -> Array:
    reference = reference_rotation(robot)
    turned = Rotation.from_matrix(reference) * Rotation.from_euler("ZYX", run.q[:, 3:6])
    return np.column_stack([run.q[:, :3] @ reference.T, turned.as_quat()])
