"""What motions are expected to make of planted effects, with the noise of a simulation."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from excite_cli.api.inspecting import bare_problem
from excite_cli.api.loading import Case
from excite_cli.diagnosis.predicted_outcome import (
    PredictedOutcome,
    predict_outcome,
    rows_of_fit,
)
from excite_cli.dynamics.regressor import Regressor, standard_parameters
from excite_cli.effects.catalogue import declared_effects
from excite_cli.errors import ExciteError
from excite_cli.excitation.effect_columns import why_not_planned
from excite_cli.excitation.objective import Stack
from excite_cli.identification.prepare import PreparedRun, prepare
from excite_cli.identification.processing import choose_processing
from excite_cli.measurement.dataset import Run
from excite_cli.robot.model import Array
from excite_cli.shown.note import Level, Note, Tell
from excite_cli.simulation.ground_truth import PlantedEffect
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.study.selftest import beside, usual_effects
from excite_cli.trajectory.fade import Segment

_COUNTED = 1e-4  # noise of a torque that has none, as a share: positions are counted
_LEAST = 1e-6  # of the largest torque, where inertias make none
_INSTANTS = 500
_BLOCK = 0.5  # s, of a held-out recording


def predicted_outcomes(
    case: Case,
    motions: Sequence[Segment],
    planted: Sequence[PlantedEffect],
    settings: SimulationSettings,
    tell: Tell,
) -> list[PredictedOutcome | None]:
    """What these motions but the last are expected to make of each; None where that is not known.

    Rows are means over m samples, with the noise ν RMS τ, τ the torque of the URDF's inertias. With
    s the noise of a sample as a share, and c its correlation from sample to sample,

        ν² = s²/m ((1 + c)/(1 − c) − 2 c (1 − c^m) / (m (1 − c)²)).
    """
    declared = declared_effects(case.spec.effects, replace(case.robot, rows=case.robot.moved))
    usual = usual_effects(case.robot, declared if case.spec.effects else (), settings.seed)
    possible = list({it.effect.place: it.effect for it in (*usual, *planted)}.values())
    kept, runs = motions[: max(1, len(motions) - 1)], _recordings(case, motions, settings)
    level = _noise_of_means(settings, 1.0 / runs[0].step)
    weights = 1.0 / (level * _usual_torque(case, kept))
    by_row = dict(zip(case.robot.row_names, weights.tolist(), strict=True))
    criterion = case.spec.criterion.model_copy(update={"row_weights": by_row})
    spec = case.spec.model_copy(update={"criterion": criterion})
    try:
        problem = bare_problem(replace(case, spec=spec), possible)
        stack = Stack.empty(problem.columns)
        recorded = [rows_of_fit(problem, *each) for each in zip(motions, runs, strict=True)]
        for rows in recorded[: len(kept)]:
            stack = stack.with_rows(rows)
    except ExciteError as error:
        tell(Note(Level.NOTE, f"no outcome is predicted: {error}"))
        return [None for _ in planted]
    size = max(1, round(_BLOCK / runs[-1].step)) * len(case.robot.rows)
    blocks = recorded[-1][: len(recorded[-1]) // size * size].reshape(-1, size, problem.columns)
    prediction, alpha = problem.prediction, case.spec.diagnosis.significance
    assert prediction is not None

    def found(one: PlantedEffect) -> PredictedOutcome | None:
        if why_not_planned(one.effect, case.robot):
            return None
        # Friction of several terms that are not declared is confirmed as one.
        more = {each.effect.place for each in beside(one, case.robot, declared)}
        line = one.effect.friction and more - {each.place for each in declared}
        held = None if line else blocks
        known = prediction, stack, held, alpha, one.effect, one.values, level
        return predict_outcome(*known, settings.inertia_error)

    return [found(each) for each in planted]


def _recordings(
    case: Case, motions: Sequence[Segment], settings: SimulationSettings
) -> list[PreparedRun]:
    """The motions in counts of the encoder, without a torque, as a diagnosis filters them."""
    runs, count = [], settings.encoder
    for k, motion in enumerate(motions):
        t = np.arange(int(motion.trajectory.duration * settings.rate)) / settings.rate
        q = motion.trajectory.states(t, motion.coefficients)[0]
        q = count * np.round(q / count) if count else q
        runs.append(Run(f"motion_{k + 1}", t, q, np.zeros_like(q)))
    spec, kept = case.spec, runs[: max(1, len(runs) - 1)]
    filters = choose_processing(kept, spec.measurement.filter, spec.diagnosis.moving_speed)
    return [prepare(run, filters) for run in runs]


def _noise_of_means(settings: SimulationSettings, rate: float) -> float:
    """ν of `predicted_outcomes` at `rate` rows a second [Hz]; larger if a mean has no sample."""
    c, m = settings.noise_correlation, max(1.0, settings.rate / rate)
    of_one = (1.0 + c) / (1.0 - c) - 2.0 * c * (1.0 - c**m) / (m * (1.0 - c) ** 2)
    fewer = max(1.0, rate / settings.rate)
    return max(settings.torque_noise, _COUNTED) * float(np.sqrt(of_one / m * fewer))


def _usual_torque(case: Case, motions: Sequence[Segment]) -> Array:
    """RMS (R,) of the torque of every row that the URDF's inertias make on these motions."""
    y = [Regressor(case.robot).evaluate(*states_of(each)) for each in motions]
    tau = np.concatenate(y) @ standard_parameters(case.robot)
    rms = np.sqrt(np.mean(np.square(tau), axis=0))
    return np.asarray(np.maximum(rms, _LEAST * rms.max()))


def states_of(motion: Segment) -> tuple[Array, Array, Array]:
    """q, v, a, each (N, n), at instants spread evenly over the motion."""
    return motion.at(np.linspace(0.0, motion.trajectory.duration, _INSTANTS))
