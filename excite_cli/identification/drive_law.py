"""What nobody told of the law of position-controlled drives: its delay, and its gains.

The law's torque must be that of the textbook's model. With e(d) the distance of set points from
positions, when these act d later, Y φ the rigid bodies, F f viscous and Coulomb friction, offset
and rotor of every joint,

    kp_j e_j(d) + kd_j ė_j(d) = (Y φ)_j + F_j f_j + noise_j.

*Delay.* At given gains φ and f follow linearly, friction and rotors not negative: a torque that
comes later looks like less of a rotor. d minimises Σ_j n_j log RSS_j(d) / 2, its standard deviation
is that of leaving out a tenth of the time each (jackknife).

*Gains.* All of kp, φ and f times one factor fit as well, so the noise is taken to be one of e, and
what the description says of its masses (`inertial_prior`, 30 %) tells the factor:

    min over φ, f, κ = log kp of  Σ_j n_j log ‖e_j − ((Y φ)_j + F_j f_j) exp(−κ_j)‖ + prior(φ),

n_j the samples that count, fewer than there are where what is left varies slowly, and the drives'
gains taken to be within a factor of 1.6 of each other (one standard deviation): of a joint that
carries little, friction and rotor take up what its gain would be.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import qr
from scipy.optimize import lsq_linear, minimize_scalar

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.config.spec import Spec
from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.pseudo_inertia import UNSURE, inertial_prior
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.catalogue import EVERYDAY, EVERYDAY_FRICTION, catalogue
from excite_cli.identification.prepare import prepare_all, smoothed
from excite_cli.identification.processing import choose_processing
from excite_cli.identification.regression import build_regression
from excite_cli.measurement.dataset import Array, Dataset, Finding, Run
from excite_cli.measurement.torque_sources.command import Command, DriveLaw, law_of
from excite_cli.robot.model import Robot

# What is used of long recordings: a delay and gains are known to a per mille by then.
_SECONDS = 120.0
_LONGEST = 0.06  # s: buses take 4 to 20 ms, a slow radio or a vision loop thrice as much
_GRID = 2e-3  # s
_PARTS = 10  # of the time, of which each is left out once
_NEAR = 1e-3  # s around the best delay, for the curvature
_STEPS, _SETTLED = 30, 1e-4  # of Gauss and Newton; in log kp
# One standard deviation of gains that were found: as far as the fit may move masses, or as they
# are known, up to a factor of two.
_GAIN_STD = (0.3, 1.0)
_ALIKE = 0.5  # of log kp, one standard deviation: drives of a robot are of a few sizes
_ROUNDS = 2  # of delay and gains in turn
_DRIVEN = 0.2  # rad off its set point at which a drive gives its joint's largest torque, usually


@dataclass(frozen=True)
class FoundLaw:
    """The law, with one standard deviation of its delay [s] and of log kp (n,); None if told."""

    law: DriveLaw
    delay_std: float | None
    gain_std: Array | None

    def told(self, spec: Spec, joints: Sequence[str]) -> Spec:
        """The config that says so; gains that were found are as uncertain as masses are."""
        measured = spec.measurement
        numbers = {"delay": float(f"{self.law.delay:.4g}")}
        if self.gain_std is not None:
            kp = {name: float(f"{x:.4g}") for name, x in zip(joints, self.law.kp, strict=True)}
            numbers["kp"] = kp  # type: ignore[assignment]
        command = measured.command.model_copy(update=numbers)
        identification = spec.identification
        if self.gain_std is not None and identification.gain_std is None:
            std = float(np.clip(self.gain_std.max(), *_GAIN_STD))
            identification = identification.model_copy(update={"gain_std": float(f"{std:.2g}")})
        return spec.model_copy(
            update={
                "measurement": measured.model_copy(update={"command": command}),
                "identification": identification,
            }
        )

    def findings(self, joints: Sequence[str]) -> list[Finding]:
        """What was found, and the keys that say so."""
        found = []
        if self.delay_std is not None:
            text = (
                f"set points act {1e3 * self.law.delay:.1f} ± {1e3 * self.delay_std:.1f} ms after "
                f"they were recorded (measurement.command.delay: {self.law.delay:.4g})"
            )
            settings = {"measurement.command.delay": float(f"{self.law.delay:.4g}")}
            found.append(Finding("command_delay", "note", text, settings=settings))
        if self.gain_std is not None:
            each = [
                f"{name} {kp:.3g} ± {kp * std:.2g}"
                for name, kp, std in zip(joints, self.law.kp, self.gain_std, strict=True)
            ]
            text = (
                f"gains kp of the drives [N·m/rad] were found: {', '.join(each)}. Their scale is "
                "that of the URDF's masses; if they are known, give them (measurement.command.kp)"
            )
            kp = {name: float(f"{x:.4g}") for name, x in zip(joints, self.law.kp, strict=True)}
            settings_of_kp = {"measurement.command.kp": kp}
            found.append(Finding("drive_gains", "note", text, settings=settings_of_kp))
        return found


def is_sought(spec: MeasurementSpec) -> bool:
    """Whether the config leaves a delay or gains of the drives to the data."""
    return spec.torque == Command.name and None in (spec.command.kp, spec.command.delay)


def with_law(data: Dataset, old: DriveLaw, new: DriveLaw) -> Dataset:
    """The data with torques by another law."""
    return replace(data, runs=tuple(_by(run, old, new) for run in data.runs))


def _by(run: Run, old: DriveLaw, new: DriveLaw) -> Run:
    """What else was added to the torques stays (a weight that a controller took off)."""
    tau = run.tau + np.nan_to_num(new.torque(run) - old.torque(run))
    return replace(run, tau=tau, torque_step=None, law=new)


def find_law(robot: Robot, base: BaseParameters, runs: Sequence[Run], spec: Spec) -> FoundLaw:
    """The law of the drives in `runs`, with what the config leaves open.

    Raises
    ------
    FileError
        A run is too short.
    """
    told = spec.measurement.command
    given = law_of(spec.measurement, robot.joint_names[robot.base_joints :])
    rows = _Rows(robot, base, runs, spec)
    if told.kp is not None:
        delay, deviation = rows.delay(given)
        return FoundLaw(replace(given, delay=delay), deviation, None)
    # Without kp, kd beside it would be of another size: viscous friction takes it up.
    law = replace(given, kd=np.zeros_like(given.kd), limit=np.full_like(given.limit, np.inf))
    law = replace(law, kp=rows.first_gains(law))
    delay_std = None
    for _ in range(_ROUNDS if told.delay is None else 1):
        if told.delay is None:
            delay, delay_std = rows.delay(law)
            law = replace(law, delay=delay)
        kp, gain_std = rows.gains(law)
        law = replace(law, kp=kp)
    return FoundLaw(replace(law, kd=given.kd, limit=given.limit), delay_std, gain_std)


class _Rows:
    """Columns of the textbook's model in some runs, beside which laws are tried."""

    def __init__(self, robot: Robot, base: BaseParameters, runs: Sequence[Run], spec: Spec) -> None:
        self._robot, self._base = robot, base
        self._runs = _first(runs)
        processing = choose_processing(
            self._runs, spec.measurement.filter, spec.diagnosis.moving_speed
        )
        self._prepared = prepare_all(self._runs, processing)
        self._runs = [replace(run, q=smoothed(run, processing)) for run in self._runs]
        kinds = [catalogue()[name] for name in (*EVERYDAY_FRICTION, *EVERYDAY)]
        effects = [kind(place) for kind in kinds for place in kind.places(robot)]
        found = build_regression(robot, base, effects, self._prepared)
        self._columns = np.concatenate([run.columns for run in found.runs])
        self._usable = np.concatenate([run.usable for run in self._prepared])
        self._first = robot.base_joints
        bounds = [0.0 if p.nonnegative else -np.inf for e in effects for p in e.parameters]
        self._lower = np.array([*np.full(base.rank, -np.inf), *bounds])
        part = np.concatenate(
            [np.linspace(0, _PARTS, len(run.tau), endpoint=False) for run in self._prepared]
        )
        self._part = part.astype(int)

    def torque(self, law: DriveLaw) -> Array:
        """Averages (M, n) of the law's torque in the instants of the columns."""
        found = []
        for run, prepared in zip(self._runs, self._prepared, strict=True):
            tau = law.torque(run)
            at = [np.interp(prepared.t, run.t, column) for column in tau.T]
            found.append(prepared.averaged_for_fit(np.stack(at, axis=1)))
        return np.concatenate(found)

    def delay(self, law: DriveLaw) -> tuple[float, float]:
        """The delay [s] with which the textbook's model fits best, and its standard deviation."""
        weights = np.ones(self._robot.n)
        grid = np.arange(0.0, _LONGEST + 0.5 * _GRID, _GRID)
        best = law.delay
        for _ in range(2):  # weights once more, for the noise that the first delay leaves
            fit = self._bounded(weights)

            def left(d: float, fit: Callable[[Array], Array] = fit) -> Array:
                return fit(self.torque(replace(law, delay=max(float(d), 0.0))))

            costs = [self._cost(left(d)) for d in grid]
            k = int(np.argmin(costs))
            found = minimize_scalar(
                lambda d, left=left: self._cost(left(d)),
                bounds=(max(grid[k] - _GRID, 0.0), grid[k] + _GRID),
                method="bounded",
                options={"xatol": 2e-5},
            )
            best = float(found.x) if found.fun < costs[k] else float(grid[k])
            weights = 1.0 / self._noise(left(best))
            grid = best + _GRID * np.arange(-2, 3)
            grid = grid[grid >= 0.0]
        squares = np.stack([np.square(left(best + d)) for d in (-_NEAR, 0.0, _NEAR)])
        squares *= np.square(weights)
        minima = [_vertex(squares[:, self._part != k].sum(axis=(1, 2))) for k in range(_PARTS)]
        return best, max(float(_NEAR * np.sqrt(np.var(minima) * (_PARTS - 1))), 1e-5)

    def _noise(self, left: Array) -> Array:
        """RMS (n,) of what is left of each joint; 1 where nothing is."""
        rms = np.sqrt(np.square(left).sum(axis=0) / self._usable.sum(axis=0).clip(1))
        return np.where(rms > 0.0, rms, 1.0)

    def _cost(self, left: Array) -> float:
        """Σ_j n_j log of what is left (M, n)."""
        return float(self._usable.sum(axis=0) @ np.log(self._noise(left)))

    def _bounded(self, weights: Array) -> Callable[[Array], Array]:
        """What torques (M, n) leave beside the columns; friction and rotors are not negative."""
        scale = weights * self._usable
        shape = self._columns.shape
        columns = (self._columns * scale[:, :, None]).reshape(-1, shape[2])
        whiten, target = self._prior()
        known = np.zeros((len(whiten), shape[2]))
        known[:, : len(whiten)] = whiten
        q, r = np.linalg.qr(np.concatenate([columns, known]))
        size = np.maximum(np.linalg.norm(r, axis=0), 1e-30)

        def left(tau: Array) -> Array:
            y = np.concatenate([(tau * scale).ravel(), target])
            x = lsq_linear(r / size, q.T @ y, bounds=(self._lower, np.inf)).x / size
            return np.asarray((tau - self._columns @ x) * self._usable)

        return left

    def first_gains(self, law: DriveLaw) -> Array:
        """kp (n,) with which every joint's torque is that of the description and some friction."""
        errors, cad = self.torque(replace(law, kp=np.ones_like(law.kp))), self._described()
        found = []
        for j in range(self._first, self._robot.n):
            rows = self._usable[:, j]
            own = self._friction(j)[rows]
            beside = np.column_stack([cad[rows, j], own])
            slope = np.linalg.lstsq(beside, errors[rows, j], rcond=None)[0][0] if rows.any() else 0
            found.append(1.0 / slope if slope > 0.0 else np.nan)
        kp = np.array(found)
        limits = self._robot.limits.effort[self._first :]
        usual = np.where(np.isfinite(limits) & (limits > 0.0), limits, 1.0) / _DRIVEN
        ratio = np.nanmedian(kp / usual) if np.isfinite(kp).any() else 1.0
        return np.where(np.isfinite(kp), kp, ratio * usual)

    def gains(self, law: DriveLaw) -> tuple[Array, Array]:
        """kp (n,) [N·m/rad] and the standard deviations (n,) of its logarithm."""
        errors = self.torque(law)[:, self._first :] / law.kp
        joints, prior = self._compact(errors), self._prior()
        found = _fit_gains(joints, self._start(law.kp), prior)
        found = _fit_gains(joints, found, prior, self._correlation(errors, found))
        return np.exp(found.kappa), found.std

    def _start(self, kp: Array) -> "_Gains":
        theta = np.zeros(self._columns.shape[2])
        theta[: self._base.rank] = self._base.mapping @ standard_parameters(self._robot)
        return _Gains(theta, np.log(kp), np.zeros_like(kp))

    def _prior(self) -> tuple[Array, Array]:
        prior = inertial_prior(self._robot, standard_parameters(self._robot), UNSURE)
        return prior.on_base(self._base)

    def _compact(self, errors: Array) -> list[tuple[Array, int]]:
        """Of each joint the triangle of [columns, e], which says as much, and its rows."""
        found = []
        for k, j in enumerate(range(self._first, self._robot.n)):
            rows = self._usable[:, j]
            block = np.column_stack([self._columns[rows, j], errors[rows, k]])
            found.append((qr(block, mode="r")[0][: block.shape[1]], max(int(rows.sum()), 1)))
        return found

    def _correlation(self, errors: Array, found: "_Gains") -> Array:
        """Samples (n,) that count as one, since what is left varies more slowly than noise."""
        lasting = []
        for k, j in enumerate(range(self._first, self._robot.n)):
            rows = self._usable[:, j]
            left = errors[rows, k] - self._columns[rows, j] @ found.theta * np.exp(-found.kappa[k])
            total = float(left @ left)
            if total <= 0.0:
                lasting.append(1.0)
                continue
            power, lag = 1.0, 1
            while lag < len(left) // 4 and (rho := float(left[lag:] @ left[:-lag]) / total) > 0.05:
                power, lag = power + 2.0 * rho, lag + 1
            lasting.append(power)
        return np.array(lasting)

    def _described(self) -> Array:
        """Torque (M, n) of the description's bodies."""
        phi = self._base.mapping @ standard_parameters(self._robot)
        return np.asarray(self._columns[:, :, : self._base.rank] @ phi)

    def _friction(self, j: int) -> Array:
        """Columns of joint j that are not the bodies', those that it has."""
        own = self._columns[:, j, self._base.rank :]
        return np.asarray(own[:, np.abs(own).max(axis=0) > 0.0])


@dataclass(frozen=True)
class _Gains:
    """Parameters theta (p,) of the textbook's model, κ = log kp (n,) and its deviations (n,)."""

    theta: Array
    kappa: Array
    std: Array


def _fit_gains(
    joints: Sequence[tuple[Array, int]],
    start: _Gains,
    prior: tuple[Array, Array],
    lasting: Array | None = None,
) -> _Gains:
    """The minimum over φ, f and κ by Gauss and Newton, steps halved until they lead down."""
    n, rank, (whiten, target) = len(joints), len(prior[1]), prior
    width = len(start.theta)
    counts = np.array([m for _, m in joints]) / (1.0 if lasting is None else lasting)
    alike = (np.eye(n) - 1.0 / n) / _ALIKE

    def noise(x: Array) -> Array:
        left = [np.linalg.norm(_left(own, x[:width], x[width + k])) for k, (own, _) in each]
        return np.array(left) / np.sqrt([m for _, m in joints]) + 1e-12

    def unlikely(x: Array) -> float:
        off = whiten @ x[:rank] - target
        return float(0.5 * off @ off)

    def cost(x: Array) -> float:
        differ = alike @ x[width:]
        return float(counts @ np.log(noise(x))) + unlikely(x) + 0.5 * float(differ @ differ)

    each = list(enumerate(joints))
    x = np.concatenate([start.theta, start.kappa])
    for _ in range(_STEPS):
        weights = np.sqrt(counts / [m for _, m in joints]) / noise(x)
        matrix, right = [], []
        for k, (own, _) in each:
            slope = own[:, :width] * np.exp(-x[width + k])
            block = np.zeros((len(own), width + n))
            block[:, :width], block[:, width + k] = slope, -slope @ x[:width]
            matrix.append(block * weights[k])
            right.append(_left(own, x[:width], x[width + k]) * weights[k])
        known = np.zeros((rank + n, width + n))
        known[:rank, :rank], known[rank:, width:] = whiten, alike
        a = np.concatenate([*matrix, known])
        b = np.concatenate([*right, target - whiten @ x[:rank], -alike @ x[width:]])
        scale = np.maximum(np.linalg.norm(a, axis=0), 1e-30)
        change = np.linalg.lstsq(a / scale, b, rcond=1e-10)[0] / scale
        before, share = cost(x), 1.0
        while cost(x + share * change) > before and share > 1e-3:
            share *= 0.5
        x = x + share * change
        if float(np.abs(change[width:]).max()) < _SETTLED or share <= 1e-3:
            break
    inverse = np.linalg.pinv((a / scale).T @ (a / scale), hermitian=True)
    std = np.sqrt(np.diag(inverse))[width:] / scale[width:]
    return _Gains(x[:width], x[width:], std)


def _left(own: Array, theta: Array, kappa: float) -> Array:
    """What a joint's [columns, e] leave."""
    return np.asarray(own[:, -1] - own[:, :-1] @ theta * np.exp(-kappa))


def _first(runs: Sequence[Run]) -> list[Run]:
    """Runs of two minutes in all, the last one cut."""
    kept, left = [], _SECONDS
    for run in runs:
        if left <= 0.0:
            break
        kept.append(run if run.duration <= left else run.cut(0, int(left / run.step)))
        left -= run.duration
    return kept


def _vertex(costs: Array) -> float:
    """Where the parabola through costs (3,) at -1, 0, 1 is least."""
    bend = costs[0] - 2.0 * costs[1] + costs[2]
    return float(0.5 * (costs[0] - costs[2]) / bend) if bend > 0.0 else 0.0
