"""From measured data to a diagnosis: split, filter, trace, name, and measure once at the end."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from excite_cli.checks.all_checks import also_an_effect, findings_of
from excite_cli.config.spec import Spec
from excite_cli.diagnosis.aliases import absorbed_effects, joint_aliases, other_name
from excite_cli.diagnosis.candidates import record_of
from excite_cli.diagnosis.comparison import ModelComparison
from excite_cli.diagnosis.data_sheet_line import data_sheet_lines, with_worth
from excite_cli.diagnosis.effect_trace import effect_traces
from excite_cli.diagnosis.excess_residual import excess_residuals
from excite_cli.diagnosis.final_fit import final_fit, regression, signal_to_error
from excite_cli.diagnosis.held_out_difference import held_out_difference
from excite_cli.diagnosis.held_out_errors import (
    INERTIAS,
    HeldOutRuns,
    both_models,
    error_parts,
    held_out_errors,
    refitted,
)
from excite_cli.diagnosis.held_out_verdict import worth_on_held_out
from excite_cli.diagnosis.misspecification import approximations
from excite_cli.diagnosis.modelled_run import DeclaredModel, ModelledRun
from excite_cli.diagnosis.naming import information_of, named_effects, rounds_of
from excite_cli.diagnosis.own_torque import at_its_own_torque
from excite_cli.diagnosis.records import (
    CUT_SHORT,
    OPEN_SETUP,
    Approximation,
    Assumption,
    Diagnosis,
    EffectRecord,
    JointAlias,
    Textbook,
    by_joint,
)
from excite_cli.diagnosis.search_loop import trace
from excite_cli.diagnosis.search_result import SearchResult
from excite_cli.diagnosis.single_runs import (
    assumptions,
    differences_between_runs,
    on_held_out_ends,
    runs_of_their_own,
)
from excite_cli.diagnosis.sufficient import comparison_of, sufficient
from excite_cli.diagnosis.textbook import textbook
from excite_cli.diagnosis.traces import Traces
from excite_cli.diagnosis.words import assumption_in_words
from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.regressor import standard_parameter_names
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import declared_effects
from excite_cli.identification.declared_states import check_declared_runs, check_left_to_fit
from excite_cli.identification.filter_bias import filter_findings, fitted_behind
from excite_cli.identification.fit import effect_parameter_names
from excite_cli.identification.fit_words import not_seen
from excite_cli.identification.held_out_copies import refuse_held_out_copies
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.noise_floor import NoiseFloor, noise_floor
from excite_cli.identification.prepare import (
    PreparedRun,
    prepare_all,
    require_motion,
    standing_still,
)
from excite_cli.identification.prior import prior_of
from excite_cli.identification.processing import Processing, choose_processing
from excite_cli.identification.split import Split, split, with_ends_held_out
from excite_cli.identification.torque_scale import Knowledge, assumed_scale, weighed
from excite_cli.identification.torque_trace import torque_units
from excite_cli.measurement.campaign_clock import recorded
from excite_cli.measurement.dataset import Dataset, Finding, Run
from excite_cli.robot.model import Robot
from excite_cli.robot.tree import skeleton_of

Progress = Callable[[str, int], None]
# Of 74 logs set up wrongly by little, effects of other names were confirmed in 18 without this.
_OPEN = Finding(
    OPEN_SETUP,
    "warning",
    "The set-up is in doubt (above): until it is resolved, no effect beyond the textbook's is "
    "confirmed. The keys that resolve it: excite inspect",
)


def diagnose(
    robot: Robot,
    base: BaseParameters,
    dataset: Dataset,
    spec: Spec,
    held_out: str | None = None,
    progress: Progress = lambda text, done: None,
    ended: Callable[[], bool] = lambda: False,
) -> Diagnosis:
    """Find what the declared model of `spec` lacks, and measure the error before and after.

    Inertias are kept near the URDF's where the data are silent (`identification.inertias`).

    The search ends with the answer so far after `diagnosis.max_seconds`, or once it is `ended`.

    Nothing of the held-out part is used but for `before` and `after`. Texts of the configuration
    and versions are left to the caller (`dataclasses.replace`).

    Raises
    ------
    ConfigError
        The configuration does not fit the robot or the data.
    FileError
        The data cannot be what the configuration says (joint order, signs), or are too short.
    """
    started, seconds = time.monotonic(), spec.diagnosis.max_seconds

    def over() -> bool:
        return ended() or (seconds is not None and time.monotonic() - started > seconds)

    check_declared_runs(spec, dataset)
    parts = split(dataset, held_out, spec.diagnosis.block, spec.identification.needed_runs)
    check_left_to_fit(spec, parts)
    refuse_held_out_copies(parts)
    processing, training = _prepared(spec, parts)
    unmeasured = (*spec.measurement.without_torque, *robot.unmeasured)
    require_motion(training, processing, robot.joint_names, unmeasured)
    standing = standing_still(training, robot.joint_names)
    model = _model(robot, base, spec)
    kept = prepare_all(parts.held_out, processing)  # refused early where too short
    suspicious, is_open = findings_of(
        robot, parts.training, training, processing, spec, dataset.findings
    )
    traced, bodies = _traced(model, spec, parts, processing, progress, over)
    with_ends = with_ends_held_out(parts, runs_of_their_own(traced.effects), processing)
    if with_ends.ends and not over():
        parts = with_ends
        start = traced.effects
        del traced, bodies  # gigabytes, of large data: not beside the next one
        processing, training = _prepared(spec, parts)
        traced, bodies = _traced(model, spec, parts, processing, progress, over, start)
        kept = prepare_all(parts.held_out, processing)
    cut_short = _cut_short(over(), spec, time.monotonic() - started)
    progress("naming", 8)
    traced, book, compared = _needed(traced, bodies, spec)
    del bodies
    final = final_fit(traced, regression(traced, model))
    model = traced.model
    floor = noise_floor(parts.training, processing)
    models = both_models(traced, final.parameters)
    trained = HeldOutRuns(robot, traced.data.runs)
    before, after = map(trained.predictions, models)
    torques = [each.torque for each in after]
    left = traced.data.residuals(traced.candidates, traced.chosen, final.parameters)
    rests, dependence = excess_residuals(traced, torques, left, parts.training, processing, floor)
    doubts = approximations(traced, robot.joint_names, rests)
    played = HeldOutRuns(robot, kept)
    told, by_urdf = [played.predictions(each) for each in models], played.by_urdf
    from_urdf = spec.identification.inertias == "cad" and bool(by_urdf)
    begin = by_urdf if from_urdf else told[0]
    errors = held_out_errors(played, traced, models[1], begin, told[1], from_urdf)
    taken_off = error_parts(traced, errors)
    held = HeldOutRuns(robot, [*kept, *prepare_all(parts.ends, processing)])
    with_all = held.predictions(models[1])
    # No data left out miss what a wrong set-up may stand for.
    missed = (lambda *_: False) if is_open else compared.missed if compared else None
    worth = worth_on_held_out(held, traced, with_all, signal_to_error(traced, final), missed)
    links = spec.diagnosis.carrying_links
    named, rivals = named_effects(traced, final, doubts, worth, taken_off, links)
    lines = data_sheet_lines(traced, final)
    rank, declared = base.rank, len(model.declared)
    variances = np.diag(final.covariance)[:rank]
    assumed = assumptions(traced.effects, parts, model)
    reached, usual = played.errors(told[1]), trained.errors(after)
    both = reached.mean_relative_moving, usual.mean_relative_moving
    return Diagnosis(
        config="",
        config_folder="",
        fingerprint=robot.fingerprint(),
        joint_names=robot.joint_names,
        base_names=base.in_words(),
        declared=_records(models[1], robot)[:declared],
        effects=tuple(named.values()),
        absorbed=absorbed_effects(traced.judge.white, traced.candidates, traced.chosen, model),
        held_out_run=parts.held_out_name,
        before=played.errors(told[0]),
        after=reached,
        rounds=rounds_of(traced),
        findings=(
            *dataset.findings,
            *assumed_scale(spec.measurement, spec.identification),
            *(each for each in suspicious if is_open or not _is_denied(each, traced)),
            *((_OPEN,) if is_open else ()),
            *standing,
            *_filter_bias(model, models[1], spec, parts.training, processing),
            *cut_short,
            *differences_between_runs(traced),
            *held_out_difference(robot, models[1], kept, told[1], traced.data.runs, both),
            *not_seen(
                effect_parameter_names((*model.declared, *traced.effects), robot.joint_names),
                final.seen[base.rank :],
            ),
            *_noticed(assumed, floor, robot, parts),
        ),
        processing=_choices(processing, traced, parts, training),
        phi=model.full_inertias(final.parameters),
        base_values=final.parameters[:rank],
        base_std=np.where(final.seen[:rank], np.sqrt(np.maximum(variances, 0.0)), np.inf),
        information=information_of(traced, rivals),
        versions={},
        seconds=time.monotonic() - started,
        noise_floor=floor.named(robot.joint_names) if floor else None,
        traces=Traces(
            torque_units(robot),
            trained.traces(before, after, held_out=False),
            effect_traces(traced, final.parameters),
            dependence,
        ),
        held_out_traces=played.traces(told[0], told[1], held_out=True),
        assumed=assumed,
        parts=on_held_out_ends(robot, models, parts.ends, processing),
        untouched=played.errors(by_urdf) if by_urdf else None,
        textbook=_textbook(book, traced, played) if book is not None else None,
        skeleton=skeleton_of(robot),
        recorded=recorded(dataset),
        excess_residuals=rests,
        joint_aliases=_joint_aliases(traced, doubts),
        trained=usual,
        inertia_names=standard_parameter_names(robot),
        inertia_parts=by_joint(robot.joint_names, taken_off[INERTIAS]) if from_urdf else {},
        friction_lines=with_worth(lines, held, traced, with_all, taken_off),
    )


def _is_denied(doubt: Finding, traced: SearchResult) -> bool:
    """Whether an effect says the same as a doubt of the set-up, and beside the others is not there.

    The check has no effects but friction: of a gimbal whose cables and magnets pull at it, it said
    that it leans by 1.5°.
    """
    kind = also_an_effect(doubt)
    tried = {each.effect.kind for each in traced.candidates}
    found = {each.kind for each in (*traced.model.declared, *traced.effects)}
    return kind in tried and kind not in found


def _records(fitted: IdentifiedModel, robot: Robot) -> tuple[EffectRecord, ...]:
    """The effects of a model, with their values."""
    return tuple(record_of(each, robot.joint_names, values) for each, values in fitted.by_effect)


def _textbook(book: Sequence[int], traced: SearchResult, played: HeldOutRuns) -> Textbook:
    """Its effects beside the declared ones, and its error on the held-out data."""
    fitted = refitted(traced, book)
    added = _records(fitted, played.robot)[len(traced.model.declared) :]
    return Textbook(added, played.errors(played.predictions(fitted)))


def _prepared(spec: Spec, parts: Split) -> tuple[Processing, list[PreparedRun]]:
    """How the training parts are filtered, and what that gives."""
    processing = choose_processing(
        parts.training, spec.measurement.filter, spec.diagnosis.moving_speed
    )
    return processing, prepare_all(parts.training, processing)


def _traced(
    model: DeclaredModel,
    spec: Spec,
    parts: Split,
    processing: Processing,
    progress: Progress,
    over: Callable[[], bool],
    start: Sequence[Effect] = (),
) -> tuple[SearchResult, list[ModelledRun]]:
    """What is found in the training parts, and these as the model sees them.

    The effects `start` were found in more of them.
    """
    progress("filtering", 0)
    prepared = partial(prepare_all, parts.training, processing)
    traced, bodies = trace(
        model, spec.diagnosis, prepared, parts.folds, parts.units, progress, start, over
    )
    return at_its_own_torque(traced, bodies), bodies


def _needed(
    traced: SearchResult, bodies: Sequence[ModelledRun], spec: Spec
) -> tuple[SearchResult, list[int] | None, ModelComparison | None]:
    """The answer of what was found, the textbook's candidates, and how models compare.

    Not where nothing is looked for, nor where something was weighed: then None.
    """
    if not spec.diagnosis.rounds or traced.model.is_weighed:
        return traced, None, None
    models = comparison_of(traced)
    plain = textbook(traced.candidates, models)
    traced = replace(traced, plain=tuple(plain))
    needed = replace(traced, chosen=tuple(sufficient(traced, models)))
    return at_its_own_torque(needed, bodies), plain, models


def _cut_short(over: bool, spec: Spec, seconds: float) -> tuple[Finding, ...]:
    """That the search did not come to its end."""
    if not over or not spec.diagnosis.rounds:
        return ()
    text = (
        f"the search ended after {seconds:.0f} s with the answer so far, so further effects may be "
        "missing. Without diagnosis.max_seconds and without Ctrl-C, the search runs to its end"
    )
    return (Finding(CUT_SHORT, "warning", text),)


def _noticed(
    assumed: Sequence[Assumption],
    floor: NoiseFloor | None,
    robot: Robot,
    parts: Split,
) -> Iterator[Finding]:
    for each in assumed:
        yield Finding("assumed", "warning", assumption_in_words(each))
    if floor is not None:
        yield from floor.noticed(robot.joint_names)
    name, *others = {run.name for run in parts.training}
    if not others:
        shared = any(run.name == name for run in parts.held_out)
        text = (
            f"Only one recording, '{name}': training and held-out data share a motion, so spurious "
            "effects may pass. Record a second motion."
            if shared
            else f"Only one training recording, '{name}': what is different in "
            f"{parts.held_out_name} passes for an error of the model. Record a third one."
        )
        yield Finding("one run", "warning", text, name)


def _filter_bias(
    model: DeclaredModel,
    after: IdentifiedModel,
    spec: Spec,
    runs: Sequence[Run],
    processing: Processing,
) -> tuple[Finding, ...]:
    """Whether the filter that was set biases the model that was found."""
    rows, more = model.scales, len(after.values) - model.declared_width
    wide = np.pad(rows[:, :-1], ((0, 0), (0, more)))
    known = Knowledge(after.effects, wide, rows[:, -1])
    behind = fitted_behind(model.robot, model.base, known, spec.identification, runs)
    return filter_findings(runs, processing, spec.measurement.filter, behind)


def _joint_aliases(
    traced: SearchResult, doubts: Mapping[int, Approximation]
) -> tuple[JointAlias, ...]:
    model = traced.model
    shown = [i for i in traced.chosen if i not in doubts]
    sides = [
        [[traced.candidates[i].effect for i in side] for side in both]
        for both in joint_aliases(traced.chosen, traced.judge, shown)
    ]
    # Beside a declared effect one that was found may be the rest of another name of both.
    there = {each.place: each for each in (*model.declared, *traced.effects)}
    own = {traced.candidates[i].place for i in shown}
    for c in traced.candidates:
        parts = other_name(c.effect, there)
        if len(own & set(parts)) == 1:
            sides.append([[there[place] for place in parts], [c.effect]])
    names = model.robot.joint_names
    return tuple(
        JointAlias(*(tuple(record_of(each, names) for each in side) for side in both))
        for both in sides
    )


def _model(robot: Robot, base: BaseParameters, spec: Spec) -> DeclaredModel:
    declared = declared_effects(spec.effects, robot)
    known = weighed(spec.identification, declared, robot, base)
    rows = np.column_stack([known.rows, known.target])
    prior = prior_of(spec.identification, robot, len(rows) > 0)
    vague = prior is not None and spec.identification.inertias != "cad"
    return DeclaredModel(robot, base, known.effects, prior, spec.runs, rows, vague)


def _choices(
    processing: Processing, traced: SearchResult, parts: Split, training: Sequence[PreparedRun]
) -> dict[str, Any]:
    """Every choice that was made, for the result."""
    valid = np.concatenate([run.valid for run in training])
    usable = np.concatenate([run.usable for run in training])
    return {
        **processing.as_data(),
        "standstill_share": [float(x) for x in (valid & ~usable).mean(axis=0)],
        "invalid_share": [float(x) for x in (~valid).mean(axis=0)],
        "noise_orders": [len(c) for c in traced.noise.coefficients],
        "noise_rms": [float(x) for x in traced.levels],
        "runs": sorted({parts.unit(run.id) for run in parts.training}),
        "inflation": traced.inflation,
        "candidates": len(traced.candidates),
        "samples": int(usable.any(axis=1).sum()),
    }
