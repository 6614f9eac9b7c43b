"""From what happened to what is recorded: encoder counts, drive speeds, noisy torques."""

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Signals
from excite_cli.measurement.dataset import Run
from excite_cli.robot.model import Array
from excite_cli.simulation.build import Build
from excite_cli.simulation.play import Played
from excite_cli.simulation.settings import SimulationSettings

_SPEED_FILTER = 100.0  # Hz, of the drive's own speed


def record(
    build: Build,
    played: Played,
    duration: float,
    settings: SimulationSettings,
    rng: np.random.Generator,
) -> Run:
    """The run as its file holds it.

    Torque is the mean of what the motor gave in the sampling interval around the instant: it lags
    nothing. Speeds are those of the drive, from encoder counts through a first-order filter.
    """
    t = np.arange(int(np.floor(duration * settings.rate * (1 + 1e-9)))) / settings.rate
    q = CubicSpline(played.t, played.q)(t) + build.position_offset
    speeds = _drive_speeds(played, settings)
    dq = np.column_stack([np.interp(t, played.t, column) for column in speeds.T])
    tau = _torques(build, played, t, settings)
    rms = np.sqrt(np.mean(tau**2, axis=0))
    sharpness, level = build.reading.T
    tau = (1.0 + build.gain) * (tau + sharpness * (np.clip(tau, -level, level) - tau))
    tau = tau + _other_defects(build, t, q, tau) + build.offset
    base = build.robot.base_joints  # its instruments are others (`base_sensors.py`)
    rms[:base] = 0.0
    tau = tau + settings.torque_noise * rms * _noise(tau.shape, settings.noise_correlation, rng)
    counted = np.hstack([q[:, :base], _counted(q[:, base:], settings.encoder)])
    return Run(build.run.name, t, counted, tau, dq)


def _torques(build: Build, played: Played, t: Array, settings: SimulationSettings) -> Array:
    """Mean torque (T, n) over the interval around t − delay."""
    period = float(played.t[1] - played.t[0])
    # The engine pairs a torque with the positions at its instant as central differences see them:
    # it counts from half a physics step before.
    edges = np.append(played.t, played.t[-1] + period) - 0.5 * played.step
    total = np.vstack([np.zeros(build.robot.n), np.cumsum(_sensed(build, played) * period, axis=0)])
    half = 0.5 / settings.rate
    tau = np.empty((len(t), build.robot.n))
    for j in range(build.robot.n):
        middle = t - build.delay[j]
        upper, lower = (np.interp(middle + side * half, edges, total[:, j]) for side in (1, -1))
        tau[:, j] = (upper - lower) / (2 * half)
    return tau


def _sensed(build: Build, played: Played) -> Array:
    """Torque (N, n) where it is measured: behind the rotor of a soft transmission, unless said."""
    period = float(played.t[1] - played.t[0])
    tau = played.tau.copy()
    for j, transmission in build.soft.items():
        if not transmission.sensed_before:
            gained = np.diff(played.v[:, j], append=played.v[-1:, j]) / period
            tau[:, j] -= transmission.rotor * gained
    return tau


def _drive_speeds(played: Played, settings: SimulationSettings) -> Array:
    period = float(played.t[1] - played.t[0])
    counted = _counted(played.q, settings.encoder)
    raw = np.diff(counted, axis=0, prepend=counted[:1]) / period
    keep = np.exp(-2 * np.pi * _SPEED_FILTER * period)
    filtered, _ = lfilter([1 - keep], [1, -keep], raw, axis=0, zi=keep * raw[1:2])
    return filtered


def _other_defects(build: Build, t: Array, q: Array, tau: Array) -> Array:
    """What data defects add that have no mechanism of their own."""
    if not build.recorded:
        return np.zeros_like(tau)
    spline = CubicSpline(t, q)
    v, a = spline(t, 1), spline(t, 2)
    body = RigidBody(build.robot, build.phi, q, v, a)
    covariates = build.covariates(t)
    signals = Signals(t, q, v, a, tau, tau, body, build.run, build.start, covariates)
    return np.sum([p.effect.torque(signals, p.values) for p in build.recorded], axis=0)


def _noise(shape: tuple[int, ...], correlation: float, rng: np.random.Generator) -> Array:
    """Unit variance, correlated from sample to sample."""
    white = rng.normal(size=shape)
    if correlation == 0.0:
        return white
    white[1:] *= np.sqrt(1.0 - correlation**2)
    return lfilter([1.0], [1.0, -correlation], white, axis=0)


def _counted(q: Array, step: float) -> Array:
    return np.round(q / step) * step if step > 0.0 else q
