"""Motions in, measured data out: the whole simulation as one function."""

import hashlib
import shlex
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Effect, Signals
from excite_cli.errors import ConfigError, nearest
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.measurement.run_identity import RunId
from excite_cli.robot.model import Array, Robot
from excite_cli.shown.answer import Shown
from excite_cli.simulation.base_sensors import Instruments
from excite_cli.simulation.build import Build, assemble, make, true_inertias
from excite_cli.simulation.controller import (
    Reference,
    TrackingControl,
    compensated,
    control_instants,
    gains_of,
    reference_of,
)
from excite_cli.simulation.ground_truth import PlantedEffect, sized
from excite_cli.simulation.mujoco_model import Plant, silent_engine
from excite_cli.simulation.planned_motion import Planned
from excite_cli.simulation.play import MotorRecord, play
from excite_cli.simulation.set_point_control import SetPointControl
from excite_cli.simulation.settings import SimulationSettings

# From what happened to what is recorded: encoder counts, drive speeds, noisy torques.

_SPEED_FILTER = 100.0  # Hz, of the drive's own speed


def record(
    build: Build,
    played: MotorRecord,
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


def _torques(build: Build, played: MotorRecord, t: Array, settings: SimulationSettings) -> Array:
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


def _sensed(build: Build, played: MotorRecord) -> Array:
    """Torque (N, n) where it is measured: behind the rotor of a soft transmission, unless said."""
    period = float(played.t[1] - played.t[0])
    tau = played.tau.copy()
    for j, transmission in build.soft.items():
        if not transmission.sensed_before:
            gained = np.diff(played.v[:, j], append=played.v[-1:, j]) / period
            tau[:, j] -= transmission.rotor * gained
    return tau


def _drive_speeds(played: MotorRecord, settings: SimulationSettings) -> Array:
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


Progress = Callable[[str, int], None]
_FIRST_DAY = 1.7e9  # s from 1970: when a simulated campaign with pauses begins


@dataclass(frozen=True)
class Truth:
    """What the simulated robot is: inertias φ (10·n_bodies,) and all its effects.

    `joint_names` (n,) and which of them slide (n,). `drive`: the law of a drive that follows set
    points, as plain data; None where a controller of torques led the robot.
    """

    phi: Array = field(repr=False)
    effects: tuple[PlantedEffect, ...]
    joint_names: tuple[str, ...]
    sliding: NDArray[np.bool_]
    drive: dict[str, Any] | None = None

    def record(self) -> dict[str, object]:
        """As plain data."""
        return {
            "effects": [each.record(self.joint_names, self.sliding) for each in self.effects],
            "phi": self.phi.tolist(),
            **({} if self.drive is None else {"drive": self.drive}),
        }


@dataclass(frozen=True, repr=False)
class Simulation(Shown):
    """Recorded runs, the truth behind them, and each run's RMS tracking error (n,) [rad; m].

    `lag`: of a robot that follows set points, the largest distance (n,) [rad; m] to the newest
    one in each run. Such a robot measures no torque: those of its runs are NaN.
    """

    dataset: Dataset
    truth: Truth
    tracking: dict[str, Array]
    lag: dict[str, Array] = field(default_factory=dict)

    @property
    def farthest(self) -> tuple[str, int, float]:
        """Run, joint (its place) and size of the largest `lag` [rad; m]."""
        run = max(self.lag, key=lambda name: float(self.lag[name].max()))
        joint = int(np.argmax(self.lag[run]))
        return run, joint, float(self.lag[run][joint])


def takes_of(motions: Sequence[Planned], repeat: int) -> dict[str, tuple[str, ...]]:
    """Names of the recordings of each motion, by its name."""
    if repeat == 1:
        return {motion.name: (motion.name,) for motion in motions}
    count = range(1, repeat + 1)
    return {m.name: tuple(f"{m.name}_take_{k}" for k in count) for m in motions}


def simulate(
    robot: Robot,
    motions: Sequence[Planned],
    settings: SimulationSettings = SimulationSettings(),
    effects: Sequence[PlantedEffect] = (),
    declared: Sequence[Effect] = (),
    instruments: Instruments | None = None,
    progress: Progress = lambda text, done: None,
) -> Simulation:
    """Play `motions` on a robot that differs from the model, and record them.

    `effects` are in the robot as they are; `declared` ones get sizes of their own. The same
    arguments give the same numbers. Of a robot with a base that moves, `instruments` measure that.

    Raises
    ------
    ConfigError, RobotError, MissingExtraError
        The request cannot be met, the robot cannot be simulated, MuJoCo is missing.
    """
    if settings.periods > 1 and not all(motion.periodic for motion in motions):
        raise ConfigError("periods: only periodic motions (family: fourier) can go on.")
    if settings.drive is not None and robot.base_joints:
        raise ConfigError(
            "--control position: only robots on a fixed base are simulated so. Leave robot.base "
            "out of the config, or --control position."
        )
    settings.require_room(motion.duration for motion in motions)
    phi = true_inertias(robot, settings.inertia_error, settings.seed)
    for effect in (*declared, *(each.effect for each in effects)):
        _require_column(effect, settings)
    planted = (*sized(robot, declared, settings.seed, settings.covariates), *effects)
    runs: list[Run] = []
    tracking: dict[str, Array] = {}
    with silent_engine():
        takes = takes_of(motions, settings.repeat)
        start = 0.0
        for motion in motions:
            names = takes[motion.name]
            taken = _takes(robot, phi, motion, names, settings, planted, start, instruments)
            for run, error in taken:
                progress(run.name, len(runs))
                runs.append(run)
                tracking[run.name] = error
                start = _next_start(run, settings)
    dataset = Dataset(robot.joint_names[robot.base_joints :], tuple(runs), ("simulated",))
    drive, lag = None, {}
    if settings.drive is not None:
        limit = settings.drive.limits(_of_motors(robot, settings))
        limited = limit if np.isfinite(limit).any() else None
        drive = settings.drive.record(robot.joint_names, limited)
        lag = {run.name: np.abs(run.extra["q_cmd"] - run.q).max(axis=0) for run in runs}
    truth = Truth(phi, planted, robot.joint_names, robot.sliding, drive)
    return Simulation(dataset, truth, tracking, lag)


def _of_motors(robot: Robot, settings: SimulationSettings) -> Array:
    """Torques (n,) at which motors stop; infinite where they do not."""
    return robot.limits.effort if settings.torque_limits else np.full(robot.n, np.inf)


def _dated(effect: Effect) -> bool:
    """Whether it is not the same in two takes that differ only in when they begin."""
    return effect.of_campaign or bool(effect.covariate)


def _require_column(effect: Effect, settings: SimulationSettings) -> None:
    names = [each.name for each in settings.covariates]
    if effect.covariate and effect.covariate not in names:
        column = shlex.quote(f"{effect.covariate}=25,end:45,time_constant:600")
        raise ConfigError(
            f"{effect.kind} follows '{effect.covariate}', a column that the simulated log does not "
            f"have.{nearest(effect.covariate, names)} Give it: --covariate "
            f"{column}, or leave the effect out "
            "(--no-declared)."
        )


def _takes(
    robot: Robot,
    phi: Array,
    motion: Planned,
    names: Sequence[str],
    settings: SimulationSettings,
    planted: Sequence[PlantedEffect],
    start: float,
    instruments: Instruments | None,
) -> Iterator[tuple[Run, Array]]:
    """Every take of one motion with its tracking error; the channel `q_ref` is the motion itself.

    Takes with the same effects differ in what is recorded, not in what happens. The first begins at
    `start` [s] on the campaign's clock.
    """
    duration = settings.periods * motion.duration
    end = duration + 2.0 / settings.rate
    t = control_instants(-settings.lead_in, end, settings.control_rate)
    reference = reference_of(robot, motion, t)
    played: dict[tuple[float, ...], MotorRecord] = {}
    for name in names:
        run_id = RunId(name)
        build = assemble(robot, phi, run_id, planted, start, settings.covariates)
        build.clip = np.minimum(build.clip, _of_motors(robot, settings))
        if settings.drive is not None:
            build.clip = settings.drive.limits(build.clip)
        present = [p.effect.active(run_id) for p in planted]
        dated = any(_dated(p.effect) for p, here in zip(planted, present, strict=True) if here)
        active = (*present, start if dated else 0.0)
        if active not in played:
            plant = make(build, settings.physics_step)
            played[active] = _played(build, plant, motion, reference, settings)
        # Noise of its own for every run and motion, in this file and in others of the same robot.
        numbers = [settings.seed, 2, _number(name.encode()), _number(motion.number)]
        rng = np.random.default_rng(numbers)
        run = record(build, played[active], duration, settings, rng)
        if instruments is not None:
            run = instruments.logged(robot, run, build.gravity, rng)
        epoch = _FIRST_DAY + start if settings.pause else None
        if settings.drive is None:
            extra = {"q_ref": motion.states(run.t)[0]}
        else:  # such robots report positions alone
            run = replace(run, tau=np.full_like(run.tau, np.nan), dq=None)
            extra = settings.drive.recorded(settings.drive.sent_for(motion, robot), run.t)
        extra |= {s.name: s.recorded(start + run.t, rng) for s in settings.covariates}
        run = replace(run, extra={**run.extra, **extra}, start=start, epoch=epoch)
        start = _next_start(run, settings)
        yield run, _tracking_error(reference, played[active], duration)[robot.base_joints :]


def _played(
    build: Build, plant: Plant, motion: Planned, reference: Reference, settings: SimulationSettings
) -> MotorRecord:
    """One motion, led by a drive that follows set points or by the controller of torques."""
    if settings.drive is not None:
        sent = settings.drive.sent_for(motion, build.robot)
        drive = SetPointControl(settings.drive, build, sent, reference.t, settings.encoder)
        return play(build, plant, reference, drive)
    gains = gains_of(build, plant, reference, settings.bandwidth)
    followed = compensated(build, reference, settings.compensation)
    return play(build, plant, followed, TrackingControl(followed, gains, build.clip))


def _next_start(run: Run, settings: SimulationSettings) -> float:
    """When the next recording begins, on the campaign's clock [s]."""
    return run.start + run.duration + settings.pause


def _number(data: bytes) -> int:
    """A number of the run, so that its noise does not depend on the other runs."""
    return int.from_bytes(hashlib.sha256(data).digest()[:4], "big")


def _tracking_error(reference: Reference, played: MotorRecord, duration: float) -> Array:
    inside = (reference.t >= 0.0) & (reference.t <= duration)
    return np.sqrt(np.mean((reference.q - played.q)[inside] ** 2, axis=0))
