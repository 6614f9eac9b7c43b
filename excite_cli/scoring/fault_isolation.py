"""The likely reason of an alarm: a quick trace, restricted to what changes from day to day.

Payloads, contacts, offsets, gains, dry and viscous friction, encoders that slipped, a base that
stands elsewhere: whatever kinds say of themselves that they are in single runs, change between
them, or may begin. Each is fitted alone to the residual of the run, joints weighed by what the
model allows them; the one that leaves least is a reason, the next is looked for beside it. Nothing
of the model is fitted: it stays as it was.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from excite_cli.diagnosis.candidates import record_of
from excite_cli.dynamics.regressor import PARAMETERS_PER_BODY
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Effect, Signals
from excite_cli.effects.catalogue import catalogue
from excite_cli.effects.judgement import Seen
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.prepare import PreparedRun
from excite_cli.identification.regression import seen_of, with_effects
from excite_cli.robot.carried_payload import reach
from excite_cli.robot.model import Array, Robot
from excite_cli.scoring.records import RunExplanation

_MOST = 3  # reasons
_LEAST = 0.15  # of what is too much, that a reason must explain
_ENOUGH = 0.1  # of it left: the rest needs no reason
_FAR = 0.5  # of the robot's reach (or 1 m), that a payload's centre may be off its link
_SAMPLES = 3000  # of a run


def reasons_of(
    robot: Robot,
    model: IdentifiedModel,
    run: PreparedRun,
    allowed: Array,
    correlated: float,
) -> tuple[tuple[RunExplanation, ...], float]:
    """What explains the residual of `run` beside `model`, the strongest first; share that is left.

    `allowed` RMS (n,); `correlated`: how many samples carry the information of one.
    """
    body = RigidBody(robot, model.phi, run.q, run.v, run.a)
    signals = with_effects(seen_of(run, body), model.effects, model.values)
    predicted = model.predicted(robot, run).torque
    scale = np.where(run.usable, 1.0 / np.maximum(allowed, 1e-9), 0.0)
    residual = (run.tau_fit - run.averaged_for_fit(predicted)) * scale
    every = slice(None, None, max(1, len(residual) // _SAMPLES))
    residual, scale = residual[every], scale[every]
    first = float(np.square(residual).sum())
    excess = max(first - float((scale > 0).sum()), 1e-12)
    left = residual.ravel()
    taken: list[tuple[Effect, Array]] = []
    for _ in range(_MOST):
        best = _best(robot, run, signals, left.reshape(residual.shape), scale, taken, correlated)
        if best is None or best[0] < _LEAST * excess:
            break
        taken.append(best[1:])
        columns = np.hstack([each for _, each in taken])
        left = residual.ravel() - columns @ _solved(columns, residual.ravel())[0]
        if float(left @ left) - (first - excess) < _ENOUGH * excess:
            break
    told = _told(robot, residual.ravel(), taken, first, correlated)
    return told, float(left @ left) / max(first, 1e-30)


def _best(
    robot: Robot,
    run: PreparedRun,
    signals: Signals,
    left: Array,
    scale: Array,
    taken: list[tuple[Effect, Array]],
    correlated: float,
) -> tuple[float, Effect, Array] | None:
    """Energy that the best of all candidates takes beside those `taken`, itself, its columns."""
    found: tuple[float, Effect, Array] | None = None
    beside = np.hstack([each for _, each in taken]) if taken else np.zeros((left.size, 0))
    count = float((scale > 0).sum()) / correlated
    places = {effect.place for effect, _ in taken}
    every = max(1, len(run.tau_fit) // _SAMPLES)
    body = signals.body
    seen = Seen(
        np.where(run.usable, np.abs(run.tau_fit), 0.0).max(axis=0, initial=0.0),
        np.sqrt(np.mean(np.square(body.load), axis=0)),
        float(np.abs(body.phi[::PARAMETERS_PER_BODY]).sum()),
        _FAR * max(reach(robot.model), 1.0),
    )
    for effect in _candidates(robot, run, signals, left):
        if effect.place in places:
            continue
        rows = list(effect.rows(robot.n))
        columns = np.zeros((len(scale), robot.n, len(effect.parameters)))
        own = run.averaged_for_fit(effect.columns(signals), rows)
        columns[:, rows] = own[::every] * scale[:, rows, None]
        flat = columns.reshape(left.size, -1)
        together = np.hstack([beside, flat])
        values, covariance = _solved(together, left.ravel())
        own_values = values[beside.shape[1] :]
        own_covariance = correlated * covariance[beside.shape[1] :, beside.shape[1] :]
        if not _possible(effect, own_values, own_covariance):
            continue
        if effect.carried and effect.absurd(own_values, seen):
            continue
        rest = left.ravel() - together @ values
        gain = float(left.ravel() @ left.ravel() - rest @ rest)
        penalty = correlated * len(effect.parameters) * np.log(max(count, 2.0))
        if gain > penalty and (found is None or gain - penalty > found[0]):
            found = gain - penalty, effect, flat
    return found


def _candidates(robot: Robot, run: PreparedRun, signals: Signals, left: Array) -> Iterator[Effect]:
    at_rate = np.stack(
        [np.interp(signals.t, np.linspace(signals.t[0], signals.t[-1], len(x)), x) for x in left.T],
        axis=1,
    )
    for kind in catalogue().values():
        if not (kind.per_run or kind.changes_between_runs or kind.can_appear_later):
            continue
        for joints in kind.places(robot):
            for shape in kind.tuned(robot, joints, [signals], [at_rate]):
                yield kind(joints, shape, (run.run.name,))


def _possible(effect: Effect, values: Array, covariance: Array) -> bool:
    if effect.is_change or effect.possible(values):
        return True
    try:
        return not effect.why_impossible(values, covariance)
    except np.linalg.LinAlgError:
        return False


def _solved(columns: Array, y: Array) -> tuple[Array, Array]:
    """Least squares: values, and their covariance at unit variance."""
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-12)
    scaled = columns / size
    gram = scaled.T @ scaled
    inverse = np.linalg.pinv(gram, hermitian=True, rcond=1e-10)
    return inverse @ (scaled.T @ y) / size, inverse / np.outer(size, size)


def _told(
    robot: Robot,
    residual: Array,
    taken: list[tuple[Effect, Array]],
    first: float,
    correlated: float,
) -> tuple[RunExplanation, ...]:
    """The reasons fitted together; each with the share that goes if it alone is left out."""
    if not taken:
        return ()
    columns = np.hstack([each for _, each in taken])
    values, covariance = _solved(columns, residual)
    rest = residual - columns @ values
    noise = max(float(rest @ rest) / max(len(residual) - len(values), 1), 1e-30)
    reasons, at = [], 0
    for k, (effect, own) in enumerate(taken):
        part = slice(at, at + own.shape[1])
        at += own.shape[1]
        others = [each for i, (_, each) in enumerate(taken) if i != k]
        without = residual
        if others:
            beside = np.hstack(others)
            without = residual - beside @ _solved(beside, residual)[0]
        share = (float(without @ without) - float(rest @ rest)) / max(first, 1e-30)
        spread = correlated * noise * covariance[part, part]
        told = effect.report_on(robot.sliding, values[part], spread)
        record = record_of(effect, robot.joint_names, values[part])
        reasons.append(RunExplanation(replace(record, runs=()), told, share))
    return tuple(sorted(reasons, key=lambda each: -each.share))
