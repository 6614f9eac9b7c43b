"""The loop around the search: noise model, columns that follow the torque, and effects agree.

Noise is estimated with the effects in that are found so far (a residual that still holds a strong
slow effect looks like noise with a long memory and hides it); columns that look at the torque of
the model follow the fit. Every pass searches from the declared model anew, until a pass finds what
the pass before it found.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from excite_cli.config.data_spec import DiagnosisSpec
from excite_cli.diagnosis.candidates import Candidate, possible_effects, with_columns
from excite_cli.diagnosis.noise_model import NoiseModel, fit_noise
from excite_cli.diagnosis.placebo import inflation_of
from excite_cli.diagnosis.search import Rules, Search
from excite_cli.diagnosis.training import KeptInertias, TrainingData
from excite_cli.effects.base import Effect, Signals
from excite_cli.identification.prepare import PreparedRun
from excite_cli.identification.prior import inertial_prior
from excite_cli.identification.regression import effect_columns
from excite_cli.robot.base_parameters import BaseParameters
from excite_cli.robot.model import Array, Robot
from excite_cli.robot.regressor import standard_parameters
from excite_cli.robot.rigid_body import RigidBody

_PASSES = 4
# Noise is what is left with all of these in, needed or not: many robots have them, and none of
# them must be taken for noise with a long memory.
_USUAL = (
    "viscous_friction", "coulomb_friction", "nonlinear_viscous_friction", "torque_offset",
    "armature", "load_dependent_friction", "spring", "coupled_friction",
)  # fmt: skip

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
    phi = standard_parameters(model.robot)
    found: tuple[Effect, ...] = ()
    values = np.zeros(0)
    noise: NoiseModel | None = None
    seen: list[set] = []
    traced: Traced | None = None
    for attempt in range(_PASSES):
        signals = [body.signals(phi, (*model.declared, *found), values) for body in bodies]
        data = _data(model, runs, folds, bodies, signals)
        raw = _raw_residuals(model, bodies, signals, bool(len(values)))
        effects = possible_effects(spec, model.robot, model.declared, signals, raw, run_names)
        candidates = with_columns(effects, signals, runs)
        allowed = _sign_check(model, candidates)
        carried = _carried_over(found, candidates)
        levels = levels_of(noise) if noise is not None else _first_levels(data)
        plain = data.evidence(candidates, NoiseModel.white(levels))
        usual = _usual(candidates, carried)
        left = data.residuals(candidates, usual, plain.solve(usual))
        noise = fit_noise(left, [run.usable for run in runs])
        white = data.evidence(candidates, noise)
        inflation = inflation_of(data, candidates, usual, noise, white)
        rules = Rules(spec.significance, spec.gain, inflation)
        search = Search(white, plain, candidates, rules, allowed)
        chosen = search.run(most=spec.rounds)
        parameters = plain.solve(chosen)
        traced = Traced(
            data, tuple(candidates), noise, search, tuple(chosen), phi, tuple(signals),
            levels, inflation,
        )  # fmt: skip
        now = {candidates[i].place for i in chosen}
        progress(
            f"pass {attempt + 1}: {len(chosen)} effects, {len(candidates)} candidates, "
            f"inflation {inflation:.2f}",
            attempt + 1,
        )
        if seen and now == seen[-1]:
            break
        seen.append(now)
        found = traced.effects
        if _coupled((*model.declared, *found)) != coupled:
            coupled = _coupled((*model.declared, *found))
            runs = prepared(coupled)
            for body, run in zip(bodies, runs, strict=True):
                body.take(run)
        phi = full_inertias(model, parameters)
        values = parameters[data.declared[0].shape[2] - _width(model.declared) :]
    assert traced is not None
    return traced


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
        if c.effect.kind in _USUAL and c.place not in taken:
            usual.append(i)
            taken.add(c.place)
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


def _first_levels(data: TrainingData) -> Array:
    """What the declared model leaves (n,) [N·m]."""
    levels = np.std(np.concatenate(data.tau), axis=0) + 1e-9
    for _ in range(2):
        parameters = data.evidence([], NoiseModel.white(levels)).solve(())
        left = np.concatenate(data.residuals([], (), parameters))
        levels = np.sqrt(np.mean(left**2, axis=0)) + 1e-9
    return levels


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
    return part.split(" ")[0] if part.endswith((" s", "half)")) else part


def _raw_residuals(
    model: Model, bodies: Sequence[_Body], signals: Sequence[Signals], fitted: bool
) -> list[Array]:
    """Recorded torque less the model's (T, n); before the first fit, less a quick fit."""
    if fitted:
        return [b.run.tau_raw - s.torque for b, s in zip(bodies, signals, strict=True)]
    columns = [b.regressor[:, :, model.base.selection] for b in bodies]
    rank = columns[0].shape[2]
    gram = sum((np.einsum("tnr,tns->rs", c, c) for c in columns), np.zeros((rank, rank)))
    cross = sum(
        (np.einsum("tnr,tn->r", c, b.run.tau_raw) for c, b in zip(columns, bodies, strict=True)),
        np.zeros(rank),
    )
    x = np.linalg.lstsq(gram, cross, rcond=1e-10)[0]
    return [b.run.tau_raw - c @ x for b, c in zip(bodies, columns, strict=True)]


def _data(
    model: Model,
    runs: Sequence[PreparedRun],
    folds: Sequence[int],
    bodies: Sequence[_Body],
    signals: Sequence[Signals],
) -> TrainingData:
    declared, torques = [], []
    for run, body, signal in zip(runs, bodies, signals, strict=True):
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
    return TrainingData(tuple(runs), tuple(folds), tuple(declared), tuple(torques), precision)


def _sign_check(
    model: Model, candidates: Sequence[Candidate]
) -> Callable[[Array, Sequence[int], Sequence[int]], bool]:
    """Vetoes sets in which an added parameter that cannot be negative is."""

    def allowed(parameters: Array, chosen: Sequence[int], added: Sequence[int]) -> bool:
        start = len(parameters) - sum(candidates[i].width for i in chosen)
        for i in chosen:
            effect = candidates[i].effect
            for k, parameter in enumerate(effect.parameters):
                value = parameters[start + k]
                if i in added and parameter.nonnegative and value < 0:
                    return False
                # Torque of one joint cannot come before its cause.
                early = effect.kind == "torque_delay" and len(effect.joints) == 1 and value < 0
                if i in added and early:
                    return False
                # Clipping takes away all that is above the level, play all of the load.
                if i in added and effect.kind in _WHOLE and not _LEAST <= value <= _MOST:
                    return False
            start += len(effect.parameters)
        return True

    return allowed
