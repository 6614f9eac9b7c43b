"""What is not given of the law of position-controlled drives: its delay, limits, and gains.

The law's torque must be that of the textbook's model. With e(d) the distance of set points from
positions, when these act d later, Y φ the rigid bodies, F f viscous and Coulomb friction, offset
and rotor of every joint,

    kp_j e_j(d) + kd_j ė_j(d) = (Y φ)_j + F_j f_j + noise_j.

*Delay.* At given gains φ and f follow linearly, friction and rotors not negative: a torque that
comes later looks like less of a rotor. d minimises Σ_j n_j log RSS_j(d) / 2, its standard deviation
is that of leaving out a tenth of the time each (jackknife). That of when a set point comes between
two samples is told with it (`hold_std`).

*Limits.* A drive that saturates at L gives clip(τ_j, ±L). L minimises what the textbook's model
leaves of that torque, as a share of it, over quantiles of |τ_j|; it is taken if the share falls to
half.

*Gains.* All of kp, φ and f times one factor fit as well, so the noise is taken to be one of e, and
what the description says of its masses (`inertial_prior`, 30 %) tells the factor:

    min over φ, f, κ = log kp of  Σ_j n_j log ‖e_j − ((Y φ)_j + F_j f_j) exp(−κ_j)‖ + prior(φ, κ)

(`drive_gains`), n_j the samples that count, fewer than there are where what is left varies slowly,
and the gains taken to be in proportion to the joints' largest torques within a factor of 1.8 (one
standard deviation): of a joint that carries little, friction and rotor take up what its gain would
be.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import hypot
from typing import Any

import numpy as np
from scipy.linalg import block_diag, qr
from scipy.optimize import lsq_linear, minimize_scalar

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.config.spec import Spec
from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.pseudo_inertia import UNSURE, inertial_prior
from excite_cli.dynamics.regressor import PARAMETERS_PER_BODY, standard_parameters
from excite_cli.effects.catalogue import EVERYDAY, EVERYDAY_FRICTION, catalogue
from excite_cli.effects.judgement import half_of
from excite_cli.identification.drive_gains import Gains, fit_gains
from excite_cli.identification.prepare import prepare_all, smoothed
from excite_cli.identification.processing import choose_processing
from excite_cli.identification.regression import build_regression
from excite_cli.measurement.dataset import Array, Dataset, Finding, Run
from excite_cli.measurement.torque_sources.command import Command, DriveLaw, hold_std, law_of
from excite_cli.robot.model import Robot

# What is used of long recordings: a delay and gains are known to a per mille by then.
_SECONDS = 120.0
_LONGEST = 0.06  # s: buses take 4 to 20 ms, a slow radio or a vision loop thrice as much
_GRID = 2e-3  # s
_PARTS = 10  # of the time, of which each is left out once
_NEAR = 1e-3  # s around the best delay, for the curvature
# One standard deviation of gains that were found: as far as the fit may move masses, or as they
# are known, up to a factor of two.
_GAIN_STD = (0.3, 1.0)
_ROUNDS = 2  # of delay and gains, or limits, in turn
# Limits that are tried: quantiles of a joint's torque by the law, 1 last: none. A fifth of what the
# description says and more: friction that is all of a joint's torque is no limit (Go2's calves).
_SHARES = np.array([0.3, 0.5, 0.6, 0.7, 0.8, 0.87, 0.92, 0.96, 0.98, 1.0])
_LEAST_LIMIT = 0.2
_SATURATED = 0.5  # of the share that is left of a joint without a limit
_FEWEST = 20  # usable samples of a joint
_DRIVEN = 0.2  # rad off its set point at which a drive gives its joint's largest torque, usually


@dataclass(frozen=True)
class FoundLaw:
    """The law, with one standard deviation of its delay [s] and of log kp (n,); None if told.

    `saturated`: joints, among the driven ones, with a limit that was found.
    """

    law: DriveLaw
    delay_std: float | None
    gain_std: Array | None
    saturated: tuple[int, ...] = ()

    def told(self, spec: Spec, joints: Sequence[str]) -> Spec:
        """The config that says so; gains that were found are as uncertain as masses are."""
        measured = spec.measurement
        numbers: dict[str, Any] = {"delay": float(f"{self.law.delay:.4g}")}
        if measured.command.limit is None:  # {}: there is none
            finite = np.isfinite(self.law.limit)
            each = zip(joints, self.law.limit, finite, strict=True)
            numbers["limit"] = {name: float(f"{x:.4g}") for name, x, there in each if there}
        if self.gain_std is not None:
            kp = {name: float(f"{x:.4g}") for name, x in zip(joints, self.law.kp, strict=True)}
            numbers["kp"] = kp
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
        for j in self.saturated:
            limit = float(f"{self.law.limit[j]:.4g}")
            text = (
                f"the drive of {joints[j]} saturates at {limit:g} N·m, less than its set points "
                f"ask for (measurement.command.limit: {{{joints[j]}: {limit:g}}})"
            )
            key = {"measurement.command.limit": {joints[j]: limit}}
            found.append(Finding("drive_limit", "warning", text, joints=(joints[j],), settings=key))
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
    """Whether the config leaves a delay, limits or gains of the drives to the data."""
    told = spec.command.kp, spec.command.delay, spec.command.limit
    return spec.torque == Command.name and None in told


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
    rows, hold = _Rows(robot, base, runs, spec), max(map(hold_std, runs))
    if told.kp is not None:
        law, deviation, told_delay = given, 0.0, told.delay is not None
        saturated: tuple[int, ...] = ()
        for _ in range(_ROUNDS):
            if not told_delay:
                delay, deviation = rows.delay(law)
                law = replace(law, delay=delay, delay_std=deviation)
            limit = rows.limits(law) if told.limit is None and not saturated else law.limit
            saturated = tuple(map(int, np.flatnonzero(np.isfinite(limit) & np.isinf(given.limit))))
            if not saturated:
                break
            law = replace(law, limit=limit)
        return FoundLaw(law, None if told_delay else hypot(deviation, hold), None, saturated)
    # Without kp, kd beside it would be of another size: viscous friction takes it up.
    law = replace(given, kd=np.zeros_like(given.kd), limit=np.full_like(given.limit, np.inf))
    law = replace(law, kp=rows.first_gains(law))
    for _ in range(_ROUNDS if told.delay is None else 1):
        if told.delay is None:
            delay, deviation = rows.delay(law)
            law = replace(law, delay=delay, delay_std=deviation)
        kp, half = rows.gains(law)
        law = replace(law, kp=kp, gain_half=half)
    by_samples = None if told.delay is not None else hypot(law.delay_std, hold)
    gain_std = np.sqrt(np.square(half).sum(axis=1))
    return FoundLaw(replace(law, kd=given.kd, limit=given.limit), by_samples, gain_std)


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

    def limits(self, law: DriveLaw) -> Array:
        """Limits (n,) [N·m] of drives, those of the law and any that the data show."""
        free = self.torque(law)
        fit = self._bounded(1.0 / self._noise(self._bounded(np.ones(self._robot.n))(free)))
        found = law.limit.copy()
        for k in np.flatnonzero(np.isinf(law.limit)):
            j = self._first + int(k)
            sizes = np.abs(np.concatenate([law.torque(run)[:, j] for run in self._runs]))
            least = _LEAST_LIMIT * float(self._robot.limits.effort[j])
            grid = np.quantile(sizes, _SHARES)
            grid = grid[grid > (least if np.isfinite(least) else 0.0)]
            if self._usable[:, j].sum() < _FEWEST or len(grid) < 2:
                continue

            def rest(limit: float, k: int = int(k), j: int = j) -> float:
                """Share of the joint's torque that is left."""
                limits = np.where(np.arange(len(law.limit)) == k, limit, law.limit)
                tau = self.torque(replace(law, limit=limits))
                return float(np.std(fit(tau)[:, j]) / np.std(tau[self._usable[:, j], j]))

            errors = [rest(limit) for limit in grid]
            best = int(np.argmin(errors))
            if errors[best] > _SATURATED * errors[-1]:
                continue
            limit = minimize_scalar(
                rest,
                bounds=(grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]),
                method="bounded",
                options={"xatol": 1e-4 * grid[best]},
            ).x
            found[k] = float(limit)
        return found

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
        usual = self._usual()
        ratio = np.nanmedian(kp / usual) if np.isfinite(kp).any() else 1.0
        return np.where(np.isfinite(kp), kp, ratio * usual)

    def _usual(self) -> Array:
        """kp (n,) with which the largest torque of each joint goes with `_DRIVEN`."""
        limits = self._robot.limits.effort[self._first :]
        return np.where(np.isfinite(limits) & (limits > 0.0), limits, 1.0) / _DRIVEN

    def gains(self, law: DriveLaw) -> tuple[Array, Array]:
        """kp (n,) [N·m/rad], and H (n, n) with the covariance H Hᵀ of its logarithm."""
        errors = self.torque(law)[:, self._first :] / law.kp
        joints, prior = self._compact(errors), self._prior()
        usual = np.log(self._usual())
        found = fit_gains(joints, self._start(law.kp), prior, usual)
        found = fit_gains(joints, found, prior, usual, self._correlation(errors, found))
        return np.exp(found.kappa), found.half

    def _start(self, kp: Array) -> "Gains":
        theta = np.zeros(self._columns.shape[2])
        theta[: self._base.rank] = self._base.mapping @ standard_parameters(self._robot)
        return Gains(theta, np.log(kp), np.zeros((len(kp), len(kp))))

    def _prior(self) -> tuple[Array, Array]:
        """Of the description, whose bodies are off as a whole as much as each figure beside it.

        With independent figures alone a scale of all would be surer than masses of bodies are.
        """
        phi = standard_parameters(self._robot)
        prior = inertial_prior(self._robot, phi, UNSURE)
        bodies = UNSURE * block_diag(*phi.reshape(-1, PARAMETERS_PER_BODY))  # (bodies, P)
        half = self._base.mapping @ np.column_stack([np.diag(prior.std), bodies.T])
        whiten = np.linalg.inv(half_of(half @ half.T))
        return np.asarray(whiten), np.asarray(whiten @ self._base.mapping @ phi)

    def _compact(self, errors: Array) -> list[tuple[Array, int]]:
        """Of each joint the triangle of [columns, e], which says as much, and its rows."""
        found = []
        for k, j in enumerate(range(self._first, self._robot.n)):
            rows = self._usable[:, j]
            block = np.column_stack([self._columns[rows, j], errors[rows, k]])
            found.append((qr(block, mode="r")[0][: block.shape[1]], max(int(rows.sum()), 1)))
        return found

    def _correlation(self, errors: Array, found: "Gains") -> Array:
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
