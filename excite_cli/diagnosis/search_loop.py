"""The loop around the search: noise model, columns that follow the torque, and effects agree.

Noise is estimated with the effects in that are found so far (a residual that still holds a strong
slow effect looks like noise with a long memory and hides it); columns that look at the torque of
the model follow the fit. Every pass searches from the textbook's effects anew (from what the last
pass found, a KR300 was left with 6.3 % for 5.6, though a Go2 with 8.5 for 10), until a pass finds
what the pass before it found. Passes may also go round (what is found asks for other samples to be
left out, with which it is lost): then the answer is the pass with the least error on runs left out.
"""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from excite_cli.config.data_spec import DiagnosisSpec
from excite_cli.diagnosis.candidates import Candidate, possible_effects, shapes_around, with_columns
from excite_cli.diagnosis.evidence import Evidence
from excite_cli.diagnosis.extrapolation import Reach, UsualMotion
from excite_cli.diagnosis.in_runs import SeenRuns
from excite_cli.diagnosis.judgement import Judgement, Rules
from excite_cli.diagnosis.modelled_run import (
    DeclaredModel,
    ModelledRun,
    inertial_columns,
    signals_of_all,
    training_data,
)
from excite_cli.diagnosis.noise_model import NoiseModel, fit_noise
from excite_cli.diagnosis.placebo import placebos_of
from excite_cli.diagnosis.possible_sizes import PossibleSizes
from excite_cli.diagnosis.search import CandidateSearch
from excite_cli.diagnosis.search_result import SearchResult
from excite_cli.diagnosis.textbook import everyday, textbook_effects
from excite_cli.diagnosis.training import TrainingData
from excite_cli.diagnosis.verdict import Verdict
from excite_cli.diagnosis.weighted_fit import WeightedFit
from excite_cli.dynamics.pseudo_inertia import InertialPrior
from excite_cli.dynamics.regressor import PARAMETERS_PER_BODY, standard_parameters
from excite_cli.effects.base import Effect, Signals
from excite_cli.effects.catalogue import scales
from excite_cli.effects.judgement import Seen
from excite_cli.identification.declared_states import LeftOut, declared_sets
from excite_cli.identification.prepare import PreparedRun
from excite_cli.identification.prior import as_wide_as_needed
from excite_cli.identification.regression import width_of
from excite_cli.robot.model import Array

_PASSES = 5  # with four, the level of a cut torque was 1.1 % off
_SETTLED = 1e-3  # change of the residual energy from pass to pass
_BETTER = 0.02  # relative: passes that differ by less are as good as each other
_SAME_SHAPE = 0.02  # half of the relative changes of its numbers: energies say little of them
_SAME_LEVEL = 0.05  # of a cut, relative: a first pass may have it a quarter too low
_OBVIOUS, _PLAIN_TO_SEE = 8, 0.2
Progress = Callable[[str, int], None]


def trace(
    model: DeclaredModel,
    spec: DiagnosisSpec,
    prepared: Callable[[LeftOut], list[PreparedRun]],
    folds: Sequence[int],
    run_names: Sequence[str],
    progress: Progress,
    start: Sequence[Effect] = (),
    over: Callable[[], bool] = lambda: False,
) -> tuple[SearchResult, list[ModelledRun]]:
    """Find the effects that `model` lacks; with the runs as it sees them.

    What is found when it is `over` is the answer, whatever the passes say.

    `prepared` gives the training parts, without samples that effects which were found ask to leave.
    `start`: effects found in more of the same data; all numbers are fitted to these data alone.
    """
    left_out = LeftOut.by((*model.declared, *start))
    runs = prepared(left_out)
    columns = inertial_columns(model, runs)
    bodies = [ModelledRun(model, *each) for each in zip(runs, columns, strict=True)]
    del runs, columns  # the next ones take their place
    plain = textbook_effects(model) if spec.rounds and not model.is_weighed else []
    if model.vague:
        model = _beside(model, folds, bodies, start or plain)
    fit = _first_fit(model, folds, bodies, start or plain)
    passes: list[_Pass] = []

    def take(wanted: LeftOut) -> None:
        nonlocal left_out
        if wanted != left_out:
            runs = prepared(wanted)
            columns = inertial_columns(model, runs)
            for body, run, own in zip(bodies, runs, columns, strict=True):
                body.take(run, own)
            left_out = wanted

    traced: SearchResult | None = None
    cuts: Mapping[int, float] = {}
    for attempt in range(_PASSES):
        traced = None  # its columns are gigabytes, of large data: not beside the next ones
        traced = _one_pass(model, spec, folds, run_names, bodies, fit, over)
        now = fit_of(model, traced)
        count = len(traced.chosen)
        progress(
            f"pass {attempt + 1}: {count} effect{'s' * (count != 1)} of "
            f"{len(traced.candidates)} candidates",
            attempt + 1,
        )
        if over() or (attempt > 0 and now.places == fit.places and now.close_to(fit)):
            return traced, bodies
        passes.append(_Pass(fit, left_out, _left_out(traced)))
        fit = now
        if attempt < _PASSES - 1:
            levels = dict(cut for effect in fit.effects for cut in effect.cuts_at())
            if any(_is_new(level, cuts.get(j)) for j, level in levels.items()):
                cuts, rest = {**cuts, **levels}, beside_cuts(fit)
                cutting = [effect for effect in fit.effects if effect.cuts_at()]
                progress("without what is cut off", attempt + 1)
                take(LeftOut.by((*model.declared, *rest.effects), cutting))
                blind = _without_kinds(spec, cutting)
                traced = None
                traced = _one_pass(model, blind, folds, run_names, bodies, rest, over)
                fit = fit_of(model, traced)
            take(LeftOut.by((*model.declared, *fit.effects)))
    assert traced is not None
    best = min(passes, key=lambda each: each.error)
    if best.error > passes[-1].error - _BETTER:
        return traced, bodies
    traced = None
    take(best.left_out)
    return _one_pass(model, spec, folds, run_names, bodies, best.fit, over), bodies


@dataclass(frozen=True)
class _Pass:
    """What a pass began from, and the error of what it found on runs left out."""

    fit: "PassFit"
    left_out: LeftOut
    error: float


@dataclass(frozen=True)
class PassFit:
    """The model after a pass: φ, effects found, values of declared and found ones, noise."""

    phi: Array
    effects: tuple[Effect, ...]
    values: Array
    levels: Array
    energy: float

    @property
    def places(self) -> set:
        """Where its effects are."""
        return {effect.place for effect in self.effects}

    def close_to(self, other: "PassFit") -> bool:
        """Whether another fit of the same effects is about the same."""
        shapes = {(e.kind, e.joints, e.runs): e.shape for e in other.effects}
        moved = [_distance(e.shape, shapes[e.kind, e.joints, e.runs]) for e in self.effects]
        change = abs(self.energy - other.energy) / max(self.energy, 1e-300)
        alike = change < _SETTLED and bool(np.allclose(self.levels, other.levels, rtol=0.02))
        return alike and max(moved, default=0.0) < _SAME_SHAPE


def _is_new(level: float, known: float | None) -> bool:
    """Whether a cut was not known, or lay elsewhere."""
    return known is None or abs(level - known) > _SAME_LEVEL * known


def beside_cuts(fit: PassFit) -> PassFit:
    """The fit without what cuts the torque.

    Columns of a cut are reckoned with the model of the pass before: where torque is cut, a fit can
    but repeat it. A model that had no friction yet was held without it (TALOS, 14 joints, friction
    of 7 % of the load on the joint that saturates: a gain was named in its place); a push of 1.17 ±
    0.02 N that an early pass had found in those 0.3 s of one run in which a UR10's pan saturates
    was needed ever after. So what else is there is looked for once without such samples, and then
    the cut, of which little was known before, anew.
    """
    widths = [len(effect.parameters) for effect in fit.effects]
    kept = [not effect.cuts_at() for effect in fit.effects]
    values = np.repeat([True, *kept], [len(fit.values) - sum(widths), *widths])
    effects = tuple(e for e, keep in zip(fit.effects, kept, strict=True) if keep)
    return replace(fit, effects=effects, values=fit.values[values])


def _without_kinds(spec: DiagnosisSpec, effects: Sequence[Effect]) -> DiagnosisSpec:
    """The search without some kinds; none at all, where no others are looked for."""
    kinds = {effect.kind for effect in effects} | {*spec.exclude}
    others = spec.kinds == "all" or not {*spec.kinds} <= kinds
    rounds = spec.rounds if others else 0
    return spec.model_copy(update={"exclude": sorted(kinds), "rounds": rounds})


def _beside(
    model: DeclaredModel,
    folds: Sequence[int],
    bodies: Sequence[ModelledRun],
    effects: Sequence[Effect],
) -> DeclaredModel:
    """The model whose prior is as wide as what is fitted beside these effects asks for."""
    assert model.prior is not None
    signals = signals_of_all(bodies, standard_parameters(model.robot), (), np.zeros(0))
    data = training_data(model, folds, bodies, signals)
    found = with_columns([(effect, 1) for effect in effects], signals, data.runs)

    def fitted(prior: InertialPrior) -> tuple[Array, DeclaredModel]:
        tried = replace(model, prior=prior)
        rows = tried.known
        fit = WeightedFit(replace(data, prior=rows.T @ rows), found)
        return fit(range(len(found)))[0], tried

    return as_wide_as_needed(model.prior, model.base, fitted)[1]


def _first_fit(
    model: DeclaredModel,
    folds: Sequence[int],
    bodies: Sequence["ModelledRun"],
    effects: Sequence[Effect],
) -> PassFit:
    """The declared model with these effects, rows weighted by what it leaves."""
    known = (*model.declared, *effects)
    phi = standard_parameters(model.robot)
    values = np.zeros(width_of(known))
    levels = np.ones(model.robot.n)
    for _ in range(3):
        signals = signals_of_all(bodies, phi, known, values)
        data = training_data(model, folds, bodies, signals)
        found = with_columns([(effect, 1) for effect in effects], signals, data.runs)
        chosen = range(len(found))
        evidence = data.evidence(found, NoiseModel.white(levels))
        parameters = evidence.solve(chosen)
        left = np.concatenate(data.residuals(found, chosen, parameters))
        usable = np.concatenate([run.usable for run in data.runs])
        squares = np.where(usable, left**2, 0.0).sum(axis=0)
        levels = np.sqrt(squares / np.maximum(usable.sum(axis=0), 1)) + 1e-9
        phi = model.full_inertias(parameters)
        effects = [each.effect for each in found]
        known = (*model.declared, *effects)
        values = values_of(model, data, parameters)
    return PassFit(phi, tuple(effects), values, levels, evidence.energy(chosen))


def fit_of(model: DeclaredModel, traced: SearchResult) -> PassFit:
    """What a search found, to begin the next one from."""
    plain = traced.judge.plain
    parameters = plain.solve(traced.chosen)
    return PassFit(
        model.full_inertias(parameters),
        traced.effects,
        values_of(model, traced.data, parameters),
        traced.noise.levels(),
        plain.energy(traced.chosen),
    )


def _left_out(traced: SearchResult) -> float:
    """Logarithm of the RMS that is left of runs left out, mean over the joints."""
    squares = traced.judge.plain.by_fold.energies(traced.chosen).sum(axis=1)
    counts = sum(run.usable.sum(axis=0) for run in traced.data.runs)
    return float(np.mean(np.log(squares / np.maximum(counts, 1) * traced.levels**2 + 1e-300))) / 2


def values_of(model: DeclaredModel, data: TrainingData, parameters: Array) -> Array:
    """Of the effects, declared ones and those found."""
    return parameters[data.declared[0].shape[2] - model.declared_width :]


def _one_pass(
    model: DeclaredModel,
    spec: DiagnosisSpec,
    folds: Sequence[int],
    run_names: Sequence[str],
    bodies: Sequence["ModelledRun"],
    fit: PassFit,
    over: Callable[[], bool],
) -> SearchResult:
    """Columns and noise as the last fit says, then a search from the textbook's model."""
    effects = (*model.declared, *fit.effects)
    signals = signals_of_all(bodies, fit.phi, effects, fit.values)
    data = training_data(model, folds, bodies, signals)
    candidates: list[Candidate] = []
    if spec.rounds:
        # Kinds that are searched on the residual must see what the last search gave to one of them.
        # Likewise the runs of what is in some of them only, or changes with time or a column.
        plain_kinds = np.repeat(
            [
                not (effect.is_searched() or effect.runs or effect.changes_of)
                and "time" not in effect.function_of
                for effect in effects
            ],
            [len(effect.parameters) for effect in effects],
        )
        steady = [body.signals(fit.phi, effects, fit.values * plain_kinds) for body in bodies]
        raw = [body.run.tau_raw - s.torque for body, s in zip(bodies, steady, strict=True)]
        shapes = {
            effect.place: shapes_around(effect, signals) if effect.shape else [{}]
            for effect in fit.effects
            if effect.shape or effect.runs
        }
        measured = all(run.unsure is None for run in data.runs)
        left = [body.run.tau_raw - s.torque for body, s in zip(bodies, signals, strict=True)]
        seen = SeenRuns(model.robot, signals, raw, run_names, model.states, measured, left)
        possible = possible_effects(spec, model.declared, seen, shapes)
        candidates = with_columns(possible, signals, data.runs)
    plain = data.evidence(candidates, NoiseModel.white(fit.levels))
    found = _carried_over(fit.effects, candidates)
    usual = _usual(candidates, found)
    usual = _of_best_shapes(plain, candidates, usual)
    usual = _with_the_obvious(plain, candidates, usual)
    rest = data.residuals(candidates, usual, plain.solve(usual))
    noise = fit_noise(rest, [run.usable for run in data.runs])
    white = data.evidence(candidates, noise)
    placebos = placebos_of(data, candidates, usual, noise, white)
    inflation = placebos.inflation
    rules = Rules(spec.significance, spec.gain, inflation, placebos.least_p)
    motion = UsualMotion(model.robot, fit.phi, signals)
    sizes = PossibleSizes(
        candidates,
        lambda some, directions: inflation * white.covariance(some, directions),
        _seen(data, signals),
        model.declared,
        Reach(candidates, data, motion, everyday(candidates)),
    )
    judge = Judgement(white, plain, candidates, rules, sizes, found)
    chosen = _searched(judge, spec.rounds, data, model, over)
    return SearchResult(
        data, tuple(candidates), noise, judge, tuple(chosen), fit.phi, tuple(signals),
        fit.levels, inflation, sizes, model, motion,
    )  # fmt: skip


def _searched(
    judge: Judgement, most: int, data: TrainingData, model: DeclaredModel, over: Callable[[], bool]
) -> list[int]:
    """The best set found from the textbook's; if something was weighed, from nothing or all gains.

    A scale that all joints share, or nearly, takes the gains of all: each alone is at odds with the
    inertias.
    """
    open_ = set(differences(judge.candidates, data, model))
    search = CandidateSearch(judge, most, over=over)
    if not model.is_weighed:
        chosen = search.run(search.pruned(everyday(judge.candidates)) if most else ())
        if over():  # a pass that was cut short may know less than the one before it
            chosen = min(chosen, search.pruned(list(judge.found)), key=judge.cost)
        return _in_both(judge, chosen, open_)
    chosen = search.run()
    places = {effect.place for effect in scales(model.robot)}
    gains = [i for i, c in enumerate(judge.candidates) if c.place in places]
    return _in_both(judge, min(chosen, search.run(gains), key=judge.cost), open_)


def _in_both(judge: Judgement, chosen: Sequence[int], open_: Collection[int]) -> list[int]:
    """The same effects, those by which two recordings differ with one value for both, if it holds.

    Looked for without them, a joint whose offset had changed was given waves and gains for it.
    """
    candidates = judge.candidates
    places = {candidates[i].place for i in chosen}
    found = [i for i in chosen if i not in open_]
    for i in chosen:
        common = candidates[i].place._replace(runs=())
        if i in open_ and common not in places:
            places.add(common)
            own = next((k for k, c in enumerate(candidates) if c.place == common), None)
            if own is not None and judge.verdict(found, [own]) is Verdict.ACCEPTED:
                found.append(own)
    return found


def differences(
    candidates: Sequence[Candidate], data: TrainingData, model: DeclaredModel
) -> Iterator[int]:
    """Changes of which two recordings do not say which of them is usual, and nobody else does.

    What one of the two has more of says nothing of a third.
    """
    if len({run.run.name for run in data.runs}) == 2:
        for i, c in enumerate(candidates):
            if c.effect.is_change and declared_sets(c.effect.kind, model.states) is None:
                yield i


def _seen(data: TrainingData, signals: Sequence[Signals]) -> Seen:
    """How large torques and robot are in the training data."""
    torque = [
        np.where(run.usable, np.abs(run.tau_fit), 0.0).max(axis=0, initial=0.0) for run in data.runs
    ]
    load = np.concatenate([s.load for s in signals])
    phi = signals[0].body.phi
    mass = float(np.abs(phi[::PARAMETERS_PER_BODY]).sum())
    return Seen(np.max(torque, axis=0), np.sqrt(np.mean(load**2, axis=0)), mass)


def _carried_over(found: Sequence[Effect], candidates: Sequence[Candidate]) -> list[int]:
    """Where the effects found before are among the new candidates, by nearest shape."""
    chosen = []
    for effect in found:
        same = [i for i, c in enumerate(candidates) if c.place == effect.place]
        if same:
            chosen.append(
                min(same, key=lambda i: _distance(candidates[i].effect.shape, effect.shape))
            )
    return chosen


def _distance(a: Mapping[str, float], b: Mapping[str, float]) -> float:
    return sum(abs(a[name] - b[name]) / (abs(a[name]) + abs(b[name]) + 1e-12) for name in a)


def _usual(candidates: Sequence[Candidate], found: Sequence[int]) -> list[int]:
    """The usual effects on all joints, one shape of each, and those found.

    Noise is what is left with all of these in, needed or not.
    """
    taken = {candidates[i].place for i in found}
    usual = list(found)
    for i, c in enumerate(candidates):
        if (
            c.effect.usual
            and c.place not in taken
            and len(c.effect.runs) < 2
            and not c.effect.is_change
        ):
            usual.append(i)
            taken.add(c.place)
    return usual


def _of_best_shapes(
    plain: Evidence, candidates: Sequence[Candidate], usual: Sequence[int]
) -> list[int]:
    """Each in the shape that leaves least: what a wrong shape leaves has a memory, and is no noise.

    Whitened by it, all shapes near the wrong one would look alike.
    """
    best = list(usual)
    for k, i in enumerate(usual):
        shapes = [s for s, c in enumerate(candidates) if c.place == candidates[i].place]
        if len(shapes) > 1:
            best[k] = min(shapes, key=lambda s: plain.energy([*best[:k], s, *best[k + 1 :]]))
    return best


def _with_the_obvious(
    plain: Evidence, candidates: Sequence[Candidate], usual: list[int]
) -> list[int]:
    """And what takes a fifth or more off the energy that is left on its joints, whatever it is.

    Judged on the runs that were fitted: with so many columns in, runs left out say nothing.
    """
    for _ in range(_OBVIOUS):
        schur = plain.schur(usual)
        taken = {candidates[i].place for i in usual}
        free = [i for i, c in enumerate(candidates) if c.place not in taken]
        ranked = sorted(free, key=lambda i: -schur.singles[i].chi2)
        for i in ranked[:4]:
            joints = list(candidates[i].rows)
            before = plain.energy_on(usual, joints)
            if plain.energy_on([*usual, i], joints) < (1.0 - _PLAIN_TO_SEE) * before:
                usual = [*usual, i]
                break
        else:
            return usual
    return usual
