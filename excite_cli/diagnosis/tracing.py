"""The loop around the search: noise model, columns that follow the torque, and effects agree.

Noise is estimated with the effects in that are found so far (a residual that still holds a strong
slow effect looks like noise with a long memory and hides it); columns that look at the torque of
the model follow the fit. Every pass searches from the declared model anew, until a pass finds what
the pass before it found.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from excite_cli.config.data_spec import DiagnosisSpec
from excite_cli.diagnosis.candidates import Candidate, possible_effects, with_columns
from excite_cli.diagnosis.evidence import Evidence
from excite_cli.diagnosis.noise_model import NoiseModel, fit_noise
from excite_cli.diagnosis.placebo import inflation_of
from excite_cli.diagnosis.refinement import shapes_around
from excite_cli.diagnosis.search import LAST_TIER, Rules, Search
from excite_cli.diagnosis.training import KeptInertias, TrainingData
from excite_cli.effects.base import Effect, Signals
from excite_cli.identification.prepare import PreparedRun
from excite_cli.identification.prior import inertial_prior
from excite_cli.identification.regression import effect_columns
from excite_cli.robot.base_parameters import BaseParameters
from excite_cli.robot.model import Array, Robot
from excite_cli.robot.regressor import standard_parameters
from excite_cli.robot.rigid_body import RigidBody

_PASSES = 6
_SETTLED = 1e-3  # change of the residual energy from pass to pass
# Noise is what is left with all of these in, needed or not: many robots have them, and none of
# them must be taken for noise with a long memory.
_USUAL = (
    "viscous_friction", "coulomb_friction", "nonlinear_viscous_friction", "torque_offset",
    "armature", "load_dependent_friction", "spring", "coupled_friction", "torque_gain",
    "base_tilt", "encoder_offset", "payload",
)  # fmt: skip

_BOUNDED = (
    "encoder_offset", "torque_delay", "base_tilt", "torque_gain",
)  # fmt: skip
_BEYOND = 1.0  # times the upper end of the usual range
_SHORTEST_DELAY = 1.5e-3  # s, of one joint alone: less is friction that lags a little
_OBVIOUS, _PLAIN_TO_SEE = 8, 0.1
# What `split` adds to the name of a run for a part of it.
_PART = re.compile(r" (?:[^ ]+-[^ ]+ s|\((?:first|second) half\))$")
# Effects whose parameter is one by their nature, with the range in which it is believed.
_WHOLE, _LEAST, _MOST = ("torque_saturation", "backlash"), 0.6, 1.5

Progress = Callable[[str, int], None]


@dataclass(frozen=True)
class Model:
    """What is known before: robot, declared effects, a prior on the inertias or none."""

    robot: Robot
    base: BaseParameters
    declared: tuple[Effect, ...]
    prior: KeptInertias | None


@dataclass(frozen=True)
class Traced:
    """The outcome: training data, candidates, noise, the finished search, the chosen candidates."""

    data: TrainingData
    candidates: tuple[Candidate, ...]
    noise: NoiseModel
    search: Search
    chosen: tuple[int, ...]
    phi: Array
    signals: tuple[Signals, ...]
    levels: Array
    inflation: float

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects that were found."""
        return tuple(self.candidates[i].effect for i in self.chosen)


def full_inertias(model: Model, parameters: Array) -> Array:
    """Full φ (P,) nearest to the URDF's that agrees with the fitted inertial parameters."""
    cad = standard_parameters(model.robot)
    if model.prior is not None:
        return np.asarray(model.prior.mean + parameters[: len(cad)])
    nearest = inertial_prior(model.robot, cad, 1.0)
    return nearest.completed(model.base, parameters[: model.base.rank])


def trace(
    model: Model,
    spec: DiagnosisSpec,
    prepared: Callable[[Sequence[tuple[int, int, float]]], list[PreparedRun]],
    folds: Sequence[int],
    run_names: Sequence[str],
    progress: Progress,
) -> Traced:
    """Find the effects that `model` lacks.

    `prepared` gives the training parts, for coupled joints (j, k, s) that were found.
    """
    coupled = _coupled(model.declared)
    runs = prepared(coupled)
    bodies = [_Body(model, run) for run in runs]
    fit = _first_fit(model, folds, bodies)
    traced: Traced | None = None
    for attempt in range(_PASSES):
        traced = _one_pass(model, spec, folds, run_names, bodies, fit, attempt)
        now = _fit_of(model, traced)
        count = len(traced.chosen)
        progress(
            f"pass {attempt + 1}: {count} effect{'s' * (count != 1)} of "
            f"{len(traced.candidates)} candidates",
            attempt + 1,
        )
        settled = attempt and now.places == fit.places and now.close_to(fit)
        fit = now
        if settled:
            break
        if _coupled((*model.declared, *fit.effects)) != coupled:
            coupled = _coupled((*model.declared, *fit.effects))
            for body, run in zip(bodies, prepared(coupled), strict=True):
                body.take(run)
    assert traced is not None
    return traced


@dataclass(frozen=True)
class _Fit:
    """The model after a pass: φ, effects found, values of declared and found ones, noise."""

    phi: Array
    effects: tuple[Effect, ...]
    values: Array
    levels: Array
    energy: float

    @property
    def places(self) -> set:
        return {(e.kind, e.joints, e.runs) for e in self.effects}

    def close_to(self, other: "_Fit") -> bool:
        change = abs(self.energy - other.energy) / max(self.energy, 1e-300)
        return change < _SETTLED and bool(np.allclose(self.levels, other.levels, rtol=0.02))


def _first_fit(model: Model, folds: Sequence[int], bodies: Sequence["_Body"]) -> _Fit:
    """The declared model alone, rows weighted by what it leaves."""
    phi, values = standard_parameters(model.robot), np.zeros(0)
    levels = np.ones(model.robot.n)
    for _ in range(3):
        signals = [body.signals(phi, model.declared, values) for body in bodies]
        data = _data(model, folds, bodies, signals)
        evidence = data.evidence([], NoiseModel.white(levels))
        parameters = evidence.solve(())
        left = np.concatenate(data.residuals([], (), parameters))
        usable = np.concatenate([run.usable for run in data.runs])
        squares = np.where(usable, left**2, 0.0).sum(axis=0)
        levels = np.sqrt(squares / np.maximum(usable.sum(axis=0), 1)) + 1e-9
        phi = full_inertias(model, parameters)
        values = _values(model, data, parameters)
    return _Fit(phi, (), values, levels, evidence.energy(()))


def _fit_of(model: Model, traced: Traced) -> _Fit:
    plain = traced.search.plain
    parameters = plain.solve(traced.chosen)
    return _Fit(
        full_inertias(model, parameters),
        traced.effects,
        _values(model, traced.data, parameters),
        levels_of(traced.noise),
        plain.energy(traced.chosen),
    )


def _values(model: Model, data: TrainingData, parameters: Array) -> Array:
    return parameters[data.declared[0].shape[2] - _width(model.declared) :]


def _one_pass(
    model: Model,
    spec: DiagnosisSpec,
    folds: Sequence[int],
    run_names: Sequence[str],
    bodies: Sequence["_Body"],
    fit: _Fit,
    attempt: int,
) -> Traced:
    """Columns and noise as the last fit says, then a search from the declared model."""
    effects = (*model.declared, *fit.effects)
    signals = [body.signals(fit.phi, effects, fit.values) for body in bodies]
    data = _data(model, folds, bodies, signals)
    candidates: list[Candidate] = []
    if spec.rounds:
        # Kinds that are searched on the residual must see what the last search gave to one of them.
        plain_kinds = np.repeat(
            [effect.kind not in LAST_TIER for effect in effects],
            [len(effect.parameters) for effect in effects],
        )
        steady = [body.signals(fit.phi, effects, fit.values * plain_kinds) for body in bodies]
        raw = [body.run.tau_raw - s.torque for body, s in zip(bodies, steady, strict=True)]
        found = {(e.kind, e.joints, e.runs): e for e in fit.effects}
        shapes = {
            place: shapes_around(effect, signals) for place, effect in found.items() if effect.shape
        }
        possible = possible_effects(
            spec, model.robot, model.declared, signals, raw, run_names, shapes
        )
        candidates = with_columns(possible, signals, data.runs)
    plain = data.evidence(candidates, NoiseModel.white(fit.levels))
    usual = _usual(candidates, _carried_over(fit.effects, candidates))
    usual = _with_the_obvious(plain, candidates, usual)
    left = data.residuals(candidates, usual, plain.solve(usual))
    noise = fit_noise(left, [run.usable for run in data.runs])
    white = data.evidence(candidates, noise)
    inflation = inflation_of(data, candidates, usual, noise, white)
    rules = Rules(spec.significance, spec.gain, inflation)
    search = Search(white, plain, candidates, rules, _sign_check(model, candidates, attempt < 2))
    chosen = search.run(most=spec.rounds)
    return Traced(
        data, tuple(candidates), noise, search, tuple(chosen), fit.phi, tuple(signals),
        fit.levels, inflation,
    )  # fmt: skip


def _carried_over(found: Sequence[Effect], candidates: Sequence[Candidate]) -> list[int]:
    """Where the effects found before are among the new candidates, by nearest shape."""
    chosen = []
    for effect in found:
        same = [
            i
            for i, c in enumerate(candidates)
            if c.place == (effect.kind, effect.joints, effect.runs)
        ]
        if same:
            chosen.append(
                min(same, key=lambda i: _distance(candidates[i].effect.shape, effect.shape))
            )
    return chosen


def _distance(a: Mapping[str, float], b: Mapping[str, float]) -> float:
    return sum(abs(a[name] - b[name]) / (abs(a[name]) + abs(b[name]) + 1e-12) for name in a)


def _usual(candidates: Sequence[Candidate], found: Sequence[int]) -> list[int]:
    """The usual effects on all joints, one shape of each, and those found."""
    taken = {candidates[i].place for i in found}
    usual = list(found)
    for i, c in enumerate(candidates):
        if c.effect.kind in _USUAL and c.place not in taken and len(c.effect.runs) < 2:
            usual.append(i)
            taken.add(c.place)
    return usual


def _with_the_obvious(
    plain: Evidence, candidates: Sequence[Candidate], usual: list[int]
) -> list[int]:
    """And what lowers the error on runs left out by a tenth or more, whatever it is."""
    for _ in range(_OBVIOUS):
        schur = plain.schur(usual)
        taken = {candidates[i].place for i in usual}
        free = [i for i, c in enumerate(candidates) if c.place not in taken and not c.effect.runs]
        ranked = sorted(free, key=lambda i: -schur.singles[i].chi2)
        for i in ranked[:4]:
            joints = list(candidates[i].rows)
            before = plain.left_out(usual, joints).sum()
            after = plain.left_out([*usual, i], joints).sum()
            if after < (1.0 - _PLAIN_TO_SEE) ** 2 * before:
                usual = [*usual, i]
                break
        else:
            return usual
    return usual


def _coupled(effects: Sequence[Effect]) -> list[tuple[int, int, float]]:
    """Joints j, k whose gears rub on v_j + s v_k."""
    return sorted(
        (e.joints[0], e.joints[1], float(e.shape["direction"]))
        for e in effects
        if e.kind == "coupled_friction"
    )


def _width(effects: Sequence[Effect]) -> int:
    return sum(len(effect.parameters) for effect in effects)


def levels_of(noise: NoiseModel) -> Array:
    """Standard deviation of the noise itself, from its autoregression."""
    levels = []
    for c, sigma in zip(noise.coefficients, noise.sigma, strict=True):
        response = np.zeros(400)
        response[0] = 1.0
        for t in range(1, len(response)):
            k = min(t, len(c))
            response[t] = c[:k] @ response[t - k : t][::-1] if k else 0.0
        levels.append(sigma * np.sqrt(np.sum(response**2)))
    return np.array(levels)


class _Body:
    """A run's rigid-body quantities; the regressor is computed once."""

    def __init__(self, model: Model, run: PreparedRun) -> None:
        self.model, self.run = model, run
        body = RigidBody(model.robot, standard_parameters(model.robot), run.q, run.v, run.a)
        self.regressor = body.regressor
        self.take(run)

    def take(self, run: PreparedRun) -> None:
        """The same motion with other averages."""
        self.run = run
        self.inertial = run.averaged_for_fit(self.regressor)

    def signals(self, phi: Array, effects: Sequence[Effect], values: Array) -> Signals:
        run = self.run
        body = RigidBody(self.model.robot, phi, run.q, run.v, run.a)
        body.__dict__["regressor"] = self.regressor
        load = body.load
        signals = Signals(run.t, run.q, run.v, run.a, load, load, body, run_name(run.name))
        if not len(values):
            return signals
        # Defects of the measurement do not change the torque that they act upon.
        in_robot = np.repeat(
            [not effect.data_defect for effect in effects],
            [len(effect.parameters) for effect in effects],
        )
        extra = effect_columns(effects, signals) @ np.where(in_robot, values, 0.0)
        return replace(signals, torque=load + extra)


def run_name(part: str) -> str:
    """The run a part of it belongs to."""
    return _PART.sub("", part)


def _data(
    model: Model,
    folds: Sequence[int],
    bodies: Sequence[_Body],
    signals: Sequence[Signals],
) -> TrainingData:
    declared, torques = [], []
    for body, signal in zip(bodies, signals, strict=True):
        run = body.run
        inertial, tau = body.inertial, run.tau_fit
        if model.prior is None:
            inertial = inertial[:, :, model.base.selection]
        else:
            tau = tau - inertial @ model.prior.mean
        effects = run.averaged_for_fit(effect_columns(model.declared, signal))
        declared.append(np.concatenate([inertial, effects], axis=2))
        torques.append(tau)
    precision = None
    if model.prior is not None:
        precision = np.concatenate([model.prior.precision, np.zeros(_width(model.declared))])
    runs = tuple(body.run for body in bodies)
    return TrainingData(runs, tuple(folds), tuple(declared), tuple(torques), precision)


def _sign_check(
    model: Model, candidates: Sequence[Candidate], early_pass: bool
) -> Callable[[Array, Sequence[int], Sequence[int]], bool]:
    """Vetoes sets in which an added parameter that cannot be negative is."""

    # At first the torque above the level is itself fitted to cut data, and too small.
    least, most = (_LEAST, _MOST) if not early_pass else (0.3 * _LEAST, 4.0 * _MOST)

    def allowed(parameters: Array, chosen: Sequence[int], added: Sequence[int]) -> bool:
        start = len(parameters) - sum(candidates[i].width for i in chosen)
        for i in chosen:
            effect = candidates[i].effect
            for k, parameter in enumerate(effect.parameters):
                value = parameters[start + k]
                if i in added and parameter.nonnegative and value < 0:
                    return False
                # Sizes that do not depend on the robot's have limits: no encoder is 12° off.
                huge = effect.kind in _BOUNDED and abs(value) > _BEYOND * parameter.high
                if i in added and huge:
                    return False
                # Torque of one joint cannot come before its cause, nor a moment after it.
                delay = effect.kind == "torque_delay" and len(effect.joints) == 1
                if i in added and delay and value < _SHORTEST_DELAY:
                    return False
                # Clipping takes away all that is above the level, play all of the load.
                if i in added and effect.kind in _WHOLE and not least <= value <= most:
                    return False
            start += len(effect.parameters)
        return True

    return allowed
