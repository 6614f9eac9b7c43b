"""How a base moved: its six coordinates from an estimator's pose or from an inertial unit.

The coordinates are those of `BASE_JOINTS`: the root's displacement along its axes at the reference,
then yaw, pitch and roll from there. What an inertial unit is integrated to drifts; a robot that
stands comes back, so that polynomials are taken off.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from scipy.fft import dct, idct
from scipy.integrate import cumulative_trapezoid
from scipy.spatial.transform import Rotation

from excite_cli.config.wrench_spec import BaseStateSpec, ImuSpec
from excite_cli.errors import ConfigError, FileError
from excite_cli.measurement.base_channel import of_base_state
from excite_cli.measurement.dataset import Array, Run
from excite_cli.measurement.wrench_channels import channel_of
from excite_cli.robot.base_joints import BASE_JOINTS
from excite_cli.robot.link_frame import link_frame
from excite_cli.robot.model import Robot

# Readings of an inertial unit without what is only its noise.
#
# A unit's noise enters every column of the base's rows: 0.02 m/s² is the weight of a humanoid times
# 0.002. Columns with noise make sizes too small (errors in variables), and a base that hardly moves
# seems to have forces of its own: a slow campaign of a standing humanoid was given gains of −5 ± 1
# % on its base's rows that nobody had put in. The expectation of a signal s with spectrum S, seen
# with white noise of spectrum N, is Wiener's estimate: every frequency times S / (S + N). Columns
# made of an expectation keep sizes unbiased (regression calibration; Carroll et al., Measurement
# Error in Nonlinear Models, chapter 4).

_SEGMENT = 4.0  # s of the spectra that are averaged
_FLOOR_FROM = 0.3  # of the rate: nothing of a standing robot's motion is there
_BEYOND = 4.0  # standard deviations of a spectrum


def denoised(x: Array, step: float) -> Array:
    """Wiener's estimate (T, k) of the signals in `x` (T, k), sampled every `step` s.

    The noise's spectrum is the median of that beyond 0.3 of the rate, taken for white. Where a unit
    filters its own readings nothing is left there, and nothing is taken off. Means stay.
    """
    from scipy.signal import welch  # takes a second to import

    mean = x.mean(axis=0)
    length = min(len(x), max(16, round(_SEGMENT / step)))
    frequency, power = welch(x - mean, 1.0 / step, nperseg=length, axis=0)
    floor = np.median(power[frequency > _FLOOR_FROM / step], axis=0)
    power[0] = power[1]  # the means are off
    # A mean of K segments' spectra scatters by 1/√K: what is within that of the floor is noise.
    heard = power > floor * (1.0 + _BEYOND / np.sqrt(2 * len(x) // length - 1))
    gain = np.where(heard, 1.0 - floor / np.maximum(power, 1e-300), 0.0)
    # Of a series that goes on mirrored, so that its ends do not jump.
    terms = dct(x - mean, axis=0, norm="ortho")
    at = np.arange(len(x)) / (2.0 * len(x) * step)
    shares = np.stack([np.interp(at, frequency, each) for each in gain.T], axis=1)
    return np.asarray(mean + idct(shares * terms, axis=0, norm="ortho"))


_SLOWEST = 4.0  # s, of a swing of the base that is told from drift
_FARTHEST = 1.2  # rad: how far a base may pitch from its reference


@dataclass(frozen=True)
class BaseState:
    """Coordinates (T, 6) [m, rad]; `lean` [rad]: of the mean specific force from the reference's.

    `lean` is None where nothing measured it.
    """

    q: Array
    lean: Array | None = None


def base_state(robot: Robot, run: Run, spec: BaseStateSpec) -> BaseState:
    """How the base of `robot` (that of the data) moved in `run`.

    Raises
    ------
    FileError
        A channel is missing, of another width, or not finite; the base turned too far.
    ConfigError
        The unit's link is unknown or moves in the base.
    """
    measured = [channel_of(run, channel) for channel in of_base_state(spec)]
    if spec.imu is not None:
        found = _from_imu(robot, run, spec.imu, np.hstack(measured))
    elif measured:
        found = BaseState(_from_pose(robot, measured[0]))
    else:
        found = BaseState(np.zeros((len(run.t), len(BASE_JOINTS))))
    if np.abs(found.q[:, 4]).max(initial=0.0) > _FARTHEST:
        raise FileError(
            f"run '{run.label}': the base pitches by {np.abs(found.q[:, 4]).max():.2f} rad from "
            f"robot.base_orientation; up to {_FARTHEST} can be distinguished from yaw and roll. "
            "Give the orientation in which it stands."
        )
    return found


def reference_rotation(robot: Robot) -> Array:
    """Axes (3, 3) of the base at its reference in the world."""
    return np.asarray(robot.model.jointPlacements[1].rotation)


def _from_pose(robot: Robot, pose: Array) -> Array:
    reference = reference_rotation(robot)
    turned = Rotation.from_matrix(reference.T) * Rotation.from_quat(pose[:, 3:])
    moved = (pose[:, :3] - pose[:, :3].mean(axis=0)) @ reference
    return np.column_stack([moved, np.unwrap(turned.as_euler("ZYX"), axis=0)])


def _from_imu(robot: Robot, run: Run, spec: ImuSpec, readings: Array) -> BaseState:
    """A base that stands: what turns and moves comes back, constants are the sensors'."""
    rotation, lever = unit_on_base(robot, spec.link)
    rate, force = np.split(denoised(readings, run.step), 2, axis=1)
    rate, force = rate @ rotation.T, force @ rotation.T
    turned = _integrated(rate - rate.mean(axis=0), run.step)
    angles = _without_drift(turned.as_euler("ZYX"), 1)
    spin = np.gradient(rate, run.step, axis=0)
    force = force - np.cross(spin, lever) - np.cross(rate, np.cross(rate, lever))
    gravity = reference_rotation(robot).T @ np.asarray(robot.model.gravity.linear)
    specific = Rotation.from_euler("ZYX", angles).apply(force)
    lean = _turn(specific.mean(axis=0), -gravity)
    speed = _integral(specific - specific.mean(axis=0), run.step)
    moved = _without_drift(_integral(speed, run.step), 2 + round(run.duration / _SLOWEST))
    return BaseState(np.column_stack([moved, angles]), lean)


def unit_on_base(robot: Robot, link: str | None) -> tuple[Array, Array]:
    """Rotation (3, 3) and place (3,) of the unit in the root."""
    if link is None:
        return np.eye(3), np.zeros(3)
    frame = link_frame(robot, link, "measurement.base.imu.link")
    if frame.joint != len(BASE_JOINTS) - 1:
        raise ConfigError(
            f"measurement.base.imu.link: '{link}' moves in the base, with joint "
            f"'{robot.joint_names[frame.joint]}'. Name a link of the base."
        )
    return frame.rotation, frame.translation


def _integrated(rate: Array, step: float) -> Rotation:
    """Orientations from rates (T, 3) in axes of the body, by their means between samples."""
    turns = Rotation.from_rotvec(0.5 * (rate[1:] + rate[:-1]) * step).as_matrix()
    found = np.empty((len(rate), 3, 3))
    found[0] = np.eye(3)
    for k, turn in enumerate(turns):
        found[k + 1] = found[k] @ turn
    return Rotation.from_matrix(found)


def _integral(x: Array, step: float) -> Array:
    return np.asarray(cumulative_trapezoid(x, dx=step, axis=0, initial=0.0))


def _without_drift(x: Array, degree: int) -> Array:
    """Without the polynomial of that degree."""
    at = np.linspace(-1.0, 1.0, len(x))
    fitted = legendre.legfit(at, x, min(degree, len(x) - 1))
    return x - legendre.legval(at, fitted).T


def _turn(a: Array, b: Array) -> Array:
    """Rotation vector (3,) [rad] that turns the direction of `a` into that of `b`."""
    axis = np.cross(a, b)
    size = float(np.linalg.norm(axis))
    if size == 0.0:
        return np.zeros(3)
    return np.asarray(axis / size * np.arctan2(size, float(a @ b)))
