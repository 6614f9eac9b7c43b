"""From measured data to a diagnosis: split, filter, trace, name, and measure once at the end."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from excite_cli.config.spec import Spec
from excite_cli.diagnosis.absorbed import absorbed_effects
from excite_cli.diagnosis.aliases import joint_aliases, other_name
from excite_cli.diagnosis.before_after import Played, both_models, on_sealed, refitted
from excite_cli.diagnosis.candidates import record_of
from excite_cli.diagnosis.comparison import Comparison
from excite_cli.diagnosis.data_sheet_line import data_sheet_lines, with_worth
from excite_cli.diagnosis.declared_model import Model
from excite_cli.diagnosis.doubt import approximations
from excite_cli.diagnosis.effect_trace import effect_traces
from excite_cli.diagnosis.error_parts import error_parts
from excite_cli.diagnosis.error_path import error_path
from excite_cli.diagnosis.final_fit import final_fit, over_error, regression
from excite_cli.diagnosis.information import information_of
from excite_cli.diagnosis.large_rest import large_rests
from excite_cli.diagnosis.modelled_run import ModelledRun
from excite_cli.diagnosis.naming import named_effects
from excite_cli.diagnosis.own_torque import at_its_own_torque
from excite_cli.diagnosis.plausibility import check_recorded
from excite_cli.diagnosis.records import (
    CUT_SHORT,
    Absorbed,
    Approximation,
    Assumption,
    Diagnosis,
    EffectRecord,
    ErrorPath,
    JointAlias,
    Textbook,
    Unexplained,
)
from excite_cli.diagnosis.rounds import order_of, rounds_of
from excite_cli.diagnosis.sealed_errors import INERTIAS, SealedErrors, sealed_errors
from excite_cli.diagnosis.sealed_verdict import Worth, worth_on_sealed
from excite_cli.diagnosis.single_runs import (
    assumptions,
    differences_told,
    on_sealed_ends,
    runs_of_their_own,
)
from excite_cli.diagnosis.sufficient import comparison_of, sufficient
from excite_cli.diagnosis.textbook import textbook
from excite_cli.diagnosis.traces import Dependence, Traces
from excite_cli.diagnosis.tracing import Traced, trace
from excite_cli.diagnosis.unexplained import unexplained_structure
from excite_cli.diagnosis.verdict import SealedVerdict
from excite_cli.diagnosis.words import assumption_in_words
from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.regressor import standard_parameter_names
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import declared_effects
from excite_cli.identification.declared_states import check_declared_runs, check_left_to_fit
from excite_cli.identification.filter_bias import filter_findings, fitted_behind
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.left_out import LeftOut
from excite_cli.identification.noise_floor import NoiseFloor, noise_floor
from excite_cli.identification.prepare import (
    PreparedRun,
    prepare_all,
    require_motion,
    standing_still,
)
from excite_cli.identification.prior import prior_of
from excite_cli.identification.processing import Processing, choose_processing
from excite_cli.identification.sealed_copies import refuse_sealed_copies
from excite_cli.identification.split import Split, split, with_ends_sealed
from excite_cli.identification.torque_scale import Knowledge, assumed_scale, weighed
from excite_cli.identification.torque_trace import torque_units
from excite_cli.measurement.dataset import Dataset, Finding, Run
from excite_cli.measurement.recorded import recorded
from excite_cli.robot.model import Array, Robot
from excite_cli.robot.skeleton import skeleton_of

Progress = Callable[[str, int], None]


def diagnose(
    robot: Robot,
    base: BaseParameters,
    dataset: Dataset,
    spec: Spec,
    sealed: str | None = None,
    progress: Progress = lambda text, done: None,
    ended: Callable[[], bool] = lambda: False,
) -> Diagnosis:
    """Find what the declared model of `spec` lacks, and measure the error before and after.

    Inertias are kept near the URDF's where the data are silent (`identification.inertias`).

    The search ends with the answer so far after `diagnosis.max_seconds`, or once it is `ended`.

    Nothing of the sealed part is used but for `before` and `after`. Texts of the configuration and
    versions are left to the caller (`dataclasses.replace`).

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
    parts = split(dataset, sealed, spec.diagnosis.block, spec.identification.needed_runs)
    check_left_to_fit(spec, parts)
    refuse_sealed_copies(parts)
    processing, training = _prepared(spec, parts)
    require_motion(
        training,
        processing,
        robot.joint_names,
        (*spec.measurement.without_torque, *robot.unmeasured),
    )
    standing = standing_still(training, robot.joint_names)
    model = _model(robot, base, spec)
    kept = prepare_all(parts.sealed, processing)  # refused early where too short
    suspicious = check_recorded(robot, parts.training, training, processing, spec.measurement)
    traced, bodies = _traced(model, spec, parts, processing, progress, over)
    with_ends = with_ends_sealed(parts, runs_of_their_own(traced.effects), processing)
    if with_ends.ends and not over():
        parts = with_ends
        start = traced.effects
        del traced, bodies  # gigabytes, of large data: not beside the next one
        processing, training = _prepared(spec, parts)
        traced, bodies = _traced(model, spec, parts, processing, progress, over, start)
        kept = prepare_all(parts.sealed, processing)
    cut_short = _cut_short(over(), spec, time.monotonic() - started)
    progress("naming", 8)
    traced, book, compared = _needed(traced, bodies, spec)
    del bodies
    model = traced.model
    final = final_fit(traced, regression(traced))
    parameters, covariance = final.parameters, final.covariance
    unexplained, dependence = _unexplained(traced, robot)
    floor = noise_floor(parts.training, processing)
    models = both_models(model, traced, parameters)
    trained = Played(robot, traced.data.runs)
    before, after = map(trained.predictions, models)
    rests = large_rests(
        traced.data,
        traced.signals,
        [each.torque for each in after],
        traced.data.residuals(traced.candidates, traced.chosen, parameters),
        parts.training,
        processing,
        floor,
        robot.joint_names,
    )
    doubts = approximations(traced, unexplained, robot.joint_names, rests)
    ends = prepare_all(parts.ends, processing)
    played = Played(robot, kept)
    told = played.predictions(models[0]), played.predictions(models[1])
    sealed_part = on_sealed(played, *told)
    from_urdf = spec.identification.inertias == "cad" and bool(sealed_part.by_urdf)
    begin = sealed_part.by_urdf if from_urdf else told[0]
    errors = sealed_errors(played, model, traced, models[1], begin, told[1], from_urdf)
    taken_off = error_parts(traced, errors)
    held = Played(robot, [*kept, *ends])
    worth = worth_on_sealed(
        held,
        model,
        traced,
        models[1],
        over_error(traced, final),
        compared.missed if compared else None,
    )
    named, candidates, rivals = named_effects(
        model,
        traced,
        (parameters, covariance),
        doubts,
        worth,
        taken_off,
        spec.diagnosis.carrying_links,
    )
    rank = base.rank
    lines = data_sheet_lines(model, traced, parameters, covariance)
    base_std = np.where(final.seen, np.sqrt(np.maximum(np.diag(covariance), 0.0)), np.inf)[:rank]
    assumed = assumptions(traced.effects, parts, model)
    return Diagnosis(
        config="",
        config_folder="",
        fingerprint=robot.fingerprint(),
        joint_names=robot.joint_names,
        base_names=base.in_words(),
        declared=_declared(model, models[1], robot),
        effects=named,
        absorbed=_absorbed(model, traced),
        unexplained=tuple(unexplained),
        sealed_run=parts.sealed_name,
        before=sealed_part.before,
        after=sealed_part.after,
        rounds=rounds_of(traced, robot.joint_names),
        findings=(
            *dataset.findings,
            *assumed_scale(spec.measurement, spec.identification),
            *suspicious,
            *standing,
            *_filter_bias(model, models[1], spec, parts.training, processing),
            *cut_short,
            *differences_told(traced),
            *_noticed(assumed, floor, robot, parts.training),
        ),
        processing=_choices(processing, traced, parts, training),
        phi=model.full_inertias(parameters),
        base_values=parameters[:rank],
        base_std=base_std,
        information=information_of(model, traced, rivals),
        versions={},
        seconds=time.monotonic() - started,
        noise_floor=floor.named(robot.joint_names) if floor else None,
        traces=Traces(
            torque_units(robot),
            trained.traces(before, after, sealed=False),
            effect_traces(traced, parameters, robot.joint_names),
            dependence,
        ),
        sealed_traces=sealed_part.traces,
        assumed=assumed,
        parts=on_sealed_ends(model, models, parts.ends, processing),
        untouched=sealed_part.untouched,
        textbook=_textbook(book, model, traced, played) if book is not None else None,
        skeleton=skeleton_of(robot),
        recorded=recorded(dataset),
        large_rests=rests,
        joint_aliases=_joint_aliases(traced, doubts, model),
        trained=trained.errors(after),
        inertia_names=standard_parameter_names(robot),
        path=_path(traced, candidates, errors, worth),
        inertia_parts=_by_joint(robot, taken_off[INERTIAS]) if from_urdf else {},
        friction_lines=with_worth(lines, held, traced, models[1], taken_off),
    )


def _textbook(book: Sequence[int], model: Model, traced: Traced, played: Played) -> Textbook:
    """Its effects beside the declared ones, and its error on the sealed data."""
    fitted = refitted(model, traced, book)
    added = list(fitted.by_effect)[len(model.declared) :]
    names = model.robot.joint_names
    return Textbook(
        tuple(record_of(effect, names, values) for effect, values in added),
        played.errors(played.predictions(fitted)),
    )


def _path(
    traced: Traced, candidates: Sequence[int], errors: SealedErrors, worth: Mapping[int, Worth]
) -> ErrorPath | None:
    """The error against the number of effects; `candidates` in the order in which they are told.

    What was weighed tells comes first and is in the smallest model, whatever the error says.
    """
    weighed = {i for i, each in worth.items() if each.verdict is SealedVerdict.WEIGHED}
    order = sorted(order_of(traced), key=lambda i: i not in weighed)
    found = error_path(traced, order, errors)
    return found and replace(
        found,
        smallest=max(found.smallest, len(weighed)),
        effects=tuple(candidates.index(i) for i in order),
    )


def _declared(model: Model, after: IdentifiedModel, robot: Robot) -> tuple[EffectRecord, ...]:
    """The declared effects, with the values that they have beside those that were found."""
    count = len(model.declared)
    told = list(after.by_effect)[:count]
    return tuple(record_of(effect, robot.joint_names, values) for effect, values in told)


def _by_joint(robot: Robot, values: Array) -> dict[str, float]:
    return dict(zip(robot.joint_names, map(float, values), strict=True))


def _prepared(spec: Spec, parts: Split) -> tuple[Processing, list[PreparedRun]]:
    """How the training parts are filtered, and what that gives."""
    processing = choose_processing(
        parts.training, spec.measurement.filter, spec.diagnosis.moving_speed
    )
    return processing, prepare_all(parts.training, processing)


def _traced(
    model: Model,
    spec: Spec,
    parts: Split,
    processing: Processing,
    progress: Progress,
    over: Callable[[], bool],
    start: Sequence[Effect] = (),
) -> tuple[Traced, list[ModelledRun]]:
    """What is found in the training parts, and these as the model sees them.

    The effects `start` were found in more of them.
    """
    progress("filtering", 0)

    def prepared(left_out: LeftOut) -> list[PreparedRun]:
        return prepare_all(parts.training, processing, left_out)

    traced, bodies = trace(
        model, spec.diagnosis, prepared, parts.folds, parts.units, progress, start, over
    )
    return at_its_own_torque(traced, bodies), bodies


def _needed(
    traced: Traced, bodies: Sequence[ModelledRun], spec: Spec
) -> tuple[Traced, list[int] | None, Comparison | None]:
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
        f"the search was ended after {seconds:.0f} s, with the answer so far: what else is missing "
        "was not looked for. Without diagnosis.max_seconds, and without Ctrl-C, it goes on to its "
        "end"
    )
    return (Finding(CUT_SHORT, "warning", text),)


def _noticed(
    assumed: Sequence[Assumption],
    floor: NoiseFloor | None,
    robot: Robot,
    training: Sequence[Run],
) -> Iterator[Finding]:
    for each in assumed:
        yield Finding("assumed", "warning", assumption_in_words(each))
    if floor is not None:
        yield from floor.noticed(robot.joint_names)
    if len({run.name for run in training}) == 1:
        yield Finding(
            "one run",
            "warning",
            f"All names rest on one recording, {training[0].name}: what is left out to test them "
            "is a part of the same motion. Record a second motion, and names that do not hold go.",
            training[0].name,
        )


def _filter_bias(
    model: Model, after: IdentifiedModel, spec: Spec, runs: Sequence[Run], processing: Processing
) -> tuple[Finding, ...]:
    """Whether the filter that was set biases the model that was found."""
    rows = model.weighed if model.weighed is not None else np.zeros((0, 1))
    wide = np.zeros((len(rows), model.base.rank + sum(len(e.parameters) for e in after.effects)))
    wide[:, : rows.shape[1] - 1] = rows[:, :-1]
    known = Knowledge(after.effects, wide, rows[:, -1])
    behind = fitted_behind(model.robot, model.base, known, spec.identification, runs)
    return filter_findings(runs, processing, spec.measurement.filter, behind)


def _unexplained(traced: Traced, robot: Robot) -> tuple[list[Unexplained], Dependence]:
    rules = traced.judge.rules
    return unexplained_structure(
        traced.data,
        traced.candidates,
        traced.chosen,
        traced.signals,
        traced.noise,
        (rules.significance, rules.gain, rules.inflation),
        robot.joint_names,
    )


def _joint_aliases(
    traced: Traced, doubts: Mapping[int, Approximation], model: Model
) -> tuple[JointAlias, ...]:
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


def _absorbed(model: Model, traced: Traced) -> tuple[Absorbed, ...]:
    names = _column_names(model), model.robot.joint_names
    white = traced.judge.white.without_prior if model.vague else traced.judge.white
    found = absorbed_effects(white, traced.candidates, *names, traced.chosen)
    return tuple(found)


def _model(robot: Robot, base: BaseParameters, spec: Spec) -> Model:
    declared = declared_effects(spec.effects, robot)
    known = weighed(spec.identification, declared, robot, base)
    rows = np.column_stack([known.rows, known.target])
    prior = prior_of(spec.identification, robot, len(rows) > 0)
    vague = prior is not None and spec.identification.inertias != "cad"
    return Model(robot, base, known.effects, prior, spec.runs, rows, vague)


def _column_names(model: Model) -> list[str]:
    """Names of the inertial columns that the search saw, then of the declared effects'."""
    base = model.base
    names = [base.names[k] for k in base.selection]
    for effect in model.declared:
        where = "+".join(model.robot.joint_names[j] for j in effect.joints)
        names += [f"{parameter.name}[{where}]" for parameter in effect.parameters]
    return names


def _choices(
    processing: Processing, traced: Traced, parts: Split, training: Sequence[PreparedRun]
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
