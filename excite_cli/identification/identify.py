"""From a dataset to the parameters of the declared model, judged on data that took no part."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from excite_cli.config.spec import Spec
from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.effects.catalogue import declared_effects
from excite_cli.errors import ExciteError
from excite_cli.identification.declared_states import (
    LeftOut,
    check_declared_runs,
    check_left_to_fit,
)
from excite_cli.identification.errors_of_torque import Errors
from excite_cli.identification.filter_bias import filter_findings, fitted_behind
from excite_cli.identification.fit import Fit, effect_parameters, fit
from excite_cli.identification.fit_words import not_seen
from excite_cli.identification.hausman import (
    SIGNIFICANT,
    Hausman,
    hausman_test,
    instrument_dataset,
)
from excite_cli.identification.held_out_copies import refuse_held_out_copies
from excite_cli.identification.identified_model import errors_on
from excite_cli.identification.implausible_links import implausible
from excite_cli.identification.noise_floor import noise_floor
from excite_cli.identification.prepare import (
    PreparedRun,
    prepare_all,
    require_motion,
    standing_still,
)
from excite_cli.identification.processing import Processing, choose_processing
from excite_cli.identification.regression import (
    Regression,
    build_regression,
    follows_model,
    rebuilt,
    regression_on,
)
from excite_cli.identification.split import Split, split
from excite_cli.identification.torque_scale import assumed_scale, knowledge_of, unseen_load
from excite_cli.identification.torque_trace import TorqueTrace, torque_trace, torque_units
from excite_cli.measurement.campaign_clock import Recorded, recorded
from excite_cli.measurement.dataset import Dataset, Finding
from excite_cli.robot.model import Robot
from excite_cli.shown.answer import Shown, offered

Tell = Callable[[str], None]
# Parameters this many standard deviations below zero that cannot be negative are reported.
_SURELY = 3.0
# Share of a joint's torque on held-out data from which the declared model is doubted.
_MUCH_LEFT = 0.1
_TOLD = 6  # names in a sentence


@dataclass(frozen=True, repr=False)
class Identification(Shown):
    """The fit, its errors on the held-out part and on the training part, and what was noticed.

    `noise_floor` [N·m] (N): RMS per joint of what changes from period to period in training runs;
    None if no motion was repeated. `traces`: torque over time, in `torque_units` per joint.
    `recorded`: when. `spec`: the config with what was found of the drives' law in it.
    """

    fit: Fit
    held_out_run: str
    error: Errors
    training_error: Errors
    hausman: Hausman
    processing: Processing
    findings: tuple[Finding, ...]
    noise_floor: dict[str, float] | None = None
    torque_units: tuple[str, ...] = ()
    traces: tuple[TorqueTrace, ...] = ()
    recorded: Recorded = field(default_factory=Recorded)
    spec: Spec | None = None

    def plot_residual(self, joint: str | None = None, ax: Any = None) -> Any:
        """Torque of the held-out part in time, measured and of the fit, and the residual.

        As `Diagnosis.plot_residual`.
        """
        return offered(self)["plot_residual"](self, joint, ax)


def identify(
    robot: Robot,
    base: BaseParameters,
    dataset: Dataset,
    spec: Spec,
    held_out: str | None = None,
    tell: Tell = lambda text: None,
) -> Identification:
    """Fit the declared model of `spec` to all of `dataset` but the held-out part.

    Raises
    ------
    ConfigError
        An effect, its runs, a filter or the held-out run does not fit.
    FileError
        A run is too short.
    """
    known = knowledge_of(spec.identification, declared_effects(spec.effects, robot), robot, base)
    effects = known.effects
    check_declared_runs(spec, dataset)

    def cut(data: Dataset) -> Split:
        return split(data, held_out, spec.diagnosis.block, spec.identification.needed_runs)

    parts = cut(dataset)
    check_left_to_fit(spec, parts)
    refuse_held_out_copies(parts)
    processing = choose_processing(
        parts.training, spec.measurement.filter, spec.diagnosis.moving_speed
    )
    tell("columns of the regression")
    training = regression_on(robot, base, effects, parts.training, processing)
    prepared = [run.prepared for run in training.runs]
    unmeasured = (*spec.measurement.without_torque, *robot.unmeasured)
    require_motion(prepared, processing, robot.joint_names, unmeasured)
    tell("fit")
    found = fit(training, spec.identification, (known.rows, known.target))
    tell("errors on the held-out part")
    kept = prepare_all(parts.held_out, processing, LeftOut.by(effects))
    if follows_model(training):
        training = rebuilt(training, found.phi, found.values[found.rank :])
    tell("the filter")
    behind = fitted_behind(robot, base, known, spec.identification, parts.training)
    wanted = spec.measurement.filter
    biased = filter_findings(parts.training, processing, wanted, behind, found)
    tell("closed-loop bias")
    hausman = _hausman(training, dataset, cut, processing, found)
    floor = noise_floor(parts.training, processing)
    error, held_out_traces = judged(robot, found, kept, held_out=True)
    training_error, training_traces = judged(robot, found, prepared, held_out=False)
    return Identification(
        fit=found,
        held_out_run=parts.held_out_name,
        error=error,
        training_error=training_error,
        hausman=hausman,
        processing=processing,
        findings=(
            *dataset.findings,
            *assumed_scale(spec.measurement, spec.identification),
            *standing_still(prepared, robot.joint_names),
            *_hardly_moved(found),
            *unseen_load(spec.identification, _gains(found)),
            *_noticed(found, hausman),
            *biased,
            *_much_left(error),
            *implausible(found.links, found.inertias, found.joint_names),
            *(floor.noticed(robot.joint_names) if floor else ()),
        ),
        noise_floor=floor.named(robot.joint_names) if floor else None,
        torque_units=torque_units(robot),
        traces=(*training_traces, *held_out_traces),
        recorded=recorded(dataset),
    )


def judged(
    robot: Robot, found: Fit, runs: Sequence[PreparedRun], held_out: bool
) -> tuple[Errors, tuple[TorqueTrace, ...]]:
    """Errors of the fit's torque on runs, and this torque over time."""
    predicted = [found.model.predicted(robot, run) for run in runs]
    return errors_on(robot, runs, predicted), tuple(
        torque_trace(run, each.load, each.torque, held_out=held_out)
        for run, each in zip(runs, predicted, strict=True)
    )


def _hausman(
    training: Regression,
    dataset: Dataset,
    cut: Callable[[Dataset], Split],
    processing: Processing,
    found: Fit,
) -> Hausman:
    """The test with instruments cut and filtered as the data were."""
    instruments, source, reason = instrument_dataset(dataset)
    if instruments is None:
        return Hausman(False, reason)
    runs = cut(instruments).training
    processing = replace(processing, velocity="differentiated")
    values = found.values[found.rank :]
    robot, base, effects = training.robot, training.base, training.effects
    try:
        prepared = prepare_all(runs, processing, LeftOut.by(effects))
        other = build_regression(robot, base, effects, prepared, found.phi, values)
    except ExciteError as error:
        return Hausman(False, str(error))
    rows, columns = [run.rows for run in training.runs], [run.columns for run in other.runs]
    return hausman_test(rows, columns, source, found.noise)


def _gains(found: Fit) -> dict[str, float]:
    """Gains that were found, by the joint."""
    return {
        found.joint_names[effect.joints[0]]: float(found.effect_values(i)[0])
        for i, effect in enumerate(found.effects)
        if effect.of_whole_torque
    }


def _much_left(error: Errors) -> list[Finding]:
    """That the declared model lacks something, where joints move."""
    much = {name: x for name, x in error.relative_moving.items() if x > _MUCH_LEFT}
    if not much:
        return []
    worst = max(much, key=much.__getitem__)
    text = (
        f"{much[worst]:.0%} of the torque of {worst} is unexplained on held-out data ({len(much)} "
        f"joint{'s' * (len(much) > 1)} above {_MUCH_LEFT:.0%}): the declared model lacks "
        "an effect. `excite diagnose` searches for it"
    )
    return [Finding("much_left", "warning", text, "", tuple(much))]


def _hardly_moved(found: Fit) -> list[Finding]:
    """What is taken from the URDF for want of motion."""
    if not found.kept:
        return []
    more = f" and {len(found.kept) - _TOLD} more" if len(found.kept) > _TOLD else ""
    text = (
        f"{len(found.kept)} of {found.rank} base parameters are weakly excited (their standard "
        "deviation exceeds the URDF's value) and regularised to URDF values: "
        f"{', '.join(found.kept[:_TOLD])}{more}."
    )
    return [Finding("kept", "note", text)]


def _noticed(found: Fit, hausman: Hausman) -> list[Finding]:
    """What a person must know about the fit."""
    findings = []
    signed = np.array([each.nonnegative for each in effect_parameters(found.effects)], bool)
    values, std = found.values[found.rank :], found.std[found.rank :]
    negative = np.flatnonzero(signed & (values < -_SURELY * std))
    if len(negative):
        names = ", ".join(found.names[found.rank + i] for i in negative)
        why = "The declared model lacks something."
        if len(negative) == signed.sum() > 1:
            why = "The sign of the torque may be flipped (measurement.sign)."
        text = f"{names}: significantly negative, which is physically infeasible. {why}"
        findings.append(Finding("negative", "warning", text))
    loose = [name for name, ok in zip(found.names, found.identifiable, strict=True) if not ok]
    if loose:
        text = (
            f"{len(loose)} of {len(found.names)} parameters are not identifiable from these data."
        )
        findings.append(Finding("not_identifiable", "note", text))
    findings += not_seen(found.names, np.isfinite(found.std))
    if found.consistent is not None and not found.consistent.solved:
        text = f"no physically consistent set was found: {found.consistent.status}."
        findings.append(Finding("inconsistent", "warning", text))
    if hausman.testable and hausman.p_value < SIGNIFICANT:
        findings.append(Finding("closed_loop_bias", "warning", hausman.sentence() + "."))
    return findings
