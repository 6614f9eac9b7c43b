"""Torque predicted by a stored model beside what was measured; nothing is fitted."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import comb

import numpy as np

from excite_cli.config.data_spec import FilterSpec
from excite_cli.errors import FileError
from excite_cli.identification.errors_of_torque import FEWEST, Errors, block_sums
from excite_cli.identification.identified_model import IdentifiedModel, Prediction, errors_on
from excite_cli.identification.prepare import PreparedRun, prepare
from excite_cli.identification.processing import Processing, choose_processing
from excite_cli.identification.stored_model import StoredModel
from excite_cli.identification.torque_trace import torque_trace
from excite_cli.measurement.dataset import Finding, Run
from excite_cli.robot.model import Array
from excite_cli.scoring.fault_isolation import reasons_of
from excite_cli.scoring.records import RunExplanation, ScoredRun
from excite_cli.scoring.thresholds import Residual
from excite_cli.scoring.tolerance import Allowance, allowance_of, beyond_friction, blocks_of, rms_of

# Since when runs are worse than all before, by less than the model's own residual allows.
#
# Of ratios of a joint: from some run on all are clearly above those before that raised no alarm.
# If their order were chance, a runs on one side and b on the other would come apart like that
# once in C(a + b, b) times, for every place to cut and every joint.

_CHANCE = 0.05
_WORSE = 1.25  # of the median before, that the median of all from then on is
# None of 240 sound simulated runs raised an alarm; with 1.1, 4 of 57 changes were not seen.
_APART = 1.05  # of the largest before, that the smallest from then on is


@dataclass(frozen=True)
class Shift:
    """From the run `first` (an index) on all `runs` (indices) are worse on some `joints`.

    `usual`: median ratio of every joint in the runs before; `times` worse is the worst joint.
    """

    first: int
    runs: tuple[int, ...]
    joints: tuple[str, ...]
    usual: dict[str, float]
    times: float


def shift_of(runs: Sequence[ScoredRun], joint_names: Sequence[str]) -> Shift | None:
    """The clearest of them; runs in the order of their recording where that is known."""
    order = list(range(len(runs)))
    if all(run.epoch is not None for run in runs):
        order.sort(key=lambda k: runs[k].epoch or 0.0)
    judged = [k for k in order if runs[k].ratio]
    quiet = np.array([not runs[k].alarm for k in judged])
    ratios = np.array([[runs[k].ratio[name] for name in joint_names] for k in judged])
    cuts = range(1, len(judged))
    ways = {
        cut: comb(int(quiet[:cut].sum()) + len(judged) - cut, len(judged) - cut) for cut in cuts
    }
    best: tuple[float, Shift] | None = None
    for cut in cuts:
        # By chance as unlikely a cut would be there, at any place.
        chance = sum(1.0 / each for each in ways.values() if each >= ways[cut])
        if len(joint_names) * chance >= _CHANCE or not quiet[:cut].any():
            continue
        before, after = ratios[:cut][quiet[:cut]], ratios[cut:]
        with np.errstate(invalid="ignore", divide="ignore"):
            times = np.median(after, axis=0) / np.median(before, axis=0)
            apart = after.min(axis=0) / before.max(axis=0)
        worse = (times > _WORSE) & (apart > _APART)
        if worse.any() and (best is None or apart[worse].max() > best[0]):
            best = (
                float(apart[worse].max()),
                Shift(
                    judged[cut],
                    tuple(judged[cut:]),
                    tuple(name for name, x in zip(joint_names, worse, strict=True) if x),
                    dict(zip(joint_names, np.median(before, axis=0).tolist(), strict=True)),
                    float(times[worse].max()),
                ),
            )
    if best is None or all(runs[k].alarm for k in best[1].runs):
        return None
    return best[1]


def with_shift(
    runs: Sequence[ScoredRun], shift: Shift, again: Sequence[ScoredRun]
) -> tuple[list[ScoredRun], list[Finding]]:
    """The runs with alarms where most later ones have the same reason; what is to be said of it.

    `again`: those of the shift scored once more, with their reasons. Without a common reason it may
    as well be another motion, and no alarm.
    """
    of_name = {(run.file, run.name): run for run in again}
    later = {k: of_name.get((runs[k].file, runs[k].name), runs[k]) for k in shift.runs}
    reasons = Counter(_first(run) for run in later.values() if run.reasons)
    what, count = reasons.most_common(1)[0] if reasons else (None, 0)
    joints, since = ", ".join(shift.joints), runs[shift.first].name
    told = (
        f"since {since} the error of {joints} is {shift.times:.2g} times that of the runs before, "
        "though still within the model's tolerance"
    )
    if 2 * count <= len(later):
        text = (
            f"{told}; no common cause in these runs explains the increase. Did the motion change?"
        )
        return list(runs), [Finding("worse_since", "warning", text, since, shift.joints)]
    named = [
        later[k] if not run.alarm and k in later and _first(later[k]) == what else run
        for k, run in enumerate(runs)
    ]
    return named, [Finding("worse_since", "warning", told, since, shift.joints)]


def _first(run: ScoredRun) -> tuple[str, tuple[str, ...]] | None:
    return (run.reasons[0].effect.kind, run.reasons[0].effect.joints) if run.reasons else None


_SAME_RATE = 0.01
# Share of the torque that a model errs by where the data may be of another robot; share of the
# residual's energy that reasons leave where they are none. A payload of half the arm's mass leaves
# 0.1 %, a joint with twice the friction 0.3 %, the data of another arm 30 %.
NOT_THIS_ROBOT, _NO_REASON = 0.5, 0.2


class Scorer:
    """Scores runs one by one; keeps sums of squares, not samples."""

    def __init__(self, stored: StoredModel) -> None:
        self.stored, self.allowance = stored, allowance_of(stored)
        self._correlated = _correlated(stored)

    def of(
        self, runs: Sequence[Run], file: str, name: str = "", worse: Shift | None = None
    ) -> ScoredRun:
        """Score of the parts of one recording, taken together.

        Runs that are `worse` than those before are judged by what those were.

        Raises
        ------
        FileError
            No part is long enough for the filters.
        """
        robot = self.stored.robot
        prepared = self.prepared(runs)
        model = self._model(prepared)
        predictions = [model.predicted(robot, run) for run in prepared]
        error = errors_on(robot, prepared, predictions)
        found = ScoredRun(
            name or runs[0].name,
            file,
            float(sum(run.duration for run in runs)),
            error,
            sums=_sums(prepared, predictions),
            covariates={
                column: float(np.mean(np.concatenate([run.covariates[column] for run in runs])))
                for column in runs[0].covariates
            },
            epoch=runs[0].epoch,
        )
        if self.allowance is None:
            return found
        return self._judged(found, prepared, predictions, model, self.allowance, worse)

    def residuals(self, runs: Sequence[Run]) -> list[Residual]:
        """Unfiltered residuals of the parts of a recording, as a detector sees them."""
        robot, found = self.stored.robot, []
        for run in self.prepared(runs):
            told = self._model([run]).predicted(robot, run)
            good = np.isfinite(run.tau_raw)
            residual = np.where(good, run.tau_raw - told.torque, 0.0)
            found.append(Residual(residual, run.v, told.load, float(run.t[1] - run.t[0])))
        return found

    def prepared(self, runs: Sequence[Run]) -> list[PreparedRun]:
        """Parts of a recording, filtered as for the model's own errors."""
        prepared, short = [], None
        for run in runs:
            try:
                prepared.append(prepare(run, self._processing(run)))
            except FileError as error:
                short = error
        if not prepared:
            raise short or FileError("there is no run to score.")
        return prepared

    def _processing(self, run: Run) -> Processing:
        """The filters of the model's own errors; at another rate of recording the same cut-offs."""
        own, spec = self.stored.processing, self.stored.spec
        if own is not None and abs(own.recorded_rate * run.step - 1.0) < _SAME_RATE:
            return own
        if own is None:
            return choose_processing([run], spec.measurement.filter, spec.diagnosis.moving_speed)
        same = FilterSpec(
            position=own.position_cutoff or "none",
            parallel=own.parallel_cutoff or "none",
            rate=own.rate,
            velocity=spec.measurement.filter.velocity,
        )
        return choose_processing([run], same, own.moving_speed)

    def _model(self, prepared: Sequence[PreparedRun]) -> IdentifiedModel:
        """The model, with what single recordings of its own data had where that fits better."""
        whole = self.stored.model
        standing = whole.without(whole.of_single_runs)
        if not any(effect.active(run.run) for effect in whole.of_single_runs for run in prepared):
            return standing
        robot = self.stored.robot

        def energy(model: IdentifiedModel) -> float:
            told = [model.predicted(robot, run) for run in prepared]
            return errors_on(robot, prepared, told).mean_relative

        return whole if energy(whole) <= energy(standing) else standing

    def _judged(
        self,
        found: ScoredRun,
        prepared: Sequence[PreparedRun],
        predictions: Sequence[Prediction],
        model: IdentifiedModel,
        allowance: Allowance,
        worse: Shift | None,
    ) -> ScoredRun:
        robot, names = self.stored.robot, self.stored.robot.joint_names
        with np.errstate(divide="ignore", invalid="ignore"):
            torque = _by_name(found.error.rms, names) / _by_name(found.error.relative, names)
        allowed = allowance.rms(torque)
        traces = [
            torque_trace(run, told.load, told.torque, whole=True)
            for run, told in zip(prepared, predictions, strict=True)
        ]
        filters, slowest = self.stored.processing, allowance.slowest
        judged = [beyond_friction(robot, model, each, filters, slowest) for each in traces]
        blocks = np.concatenate(
            [blocks_of(each, trace.t) for each, trace in zip(judged, traces, strict=True)]
        )
        ratio = rms_of(np.concatenate(judged)) / allowed
        peak = np.sqrt(np.nanmax(np.vstack([blocks, np.zeros(robot.n)]), axis=0)) / allowed
        with np.errstate(invalid="ignore"):
            beyond = (ratio > allowance.most(len(blocks))) | (peak > allowance.most_of_a_block)
        if worse is not None:
            beyond |= np.isin(names, worse.joints)
        left = tuple(name for name, out in zip(names, beyond, strict=True) if out)
        reasons: tuple[RunExplanation, ...] = ()
        if left:
            longest = max(prepared, key=lambda run: len(run.t))
            finite = np.isfinite(allowed)
            known = np.where(finite, allowed, np.median(allowed[finite]))
            if worse is not None:
                usual = _by_name(worse.usual, names)
                known = known * np.where(usual > 0.0, usual, 1.0)
            reasons, rest = reasons_of(robot, model, longest, known, self._correlated)
            if found.error.mean_relative_moving > NOT_THIS_ROBOT and rest > _NO_REASON:
                reasons = ()
        return replace(
            found,
            allowed=_named(allowed, names),
            ratio=_named(ratio, names),
            peak=_named(peak, names),
            left=left,
            reasons=reasons,
        )


def together(runs: Sequence[ScoredRun], names: Sequence[str]) -> Errors:
    """Errors over all runs, from their sums."""
    wrong, size, wrong_moving, size_moving, count, moving = np.sum(
        [run.sums for run in runs], axis=0
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        relative, slow = np.sqrt(wrong / size), np.sqrt(wrong_moving / size_moving)
        relative, slow = (
            np.where(each >= FEWEST, share, np.nan)
            for each, share in ((count, relative), (moving, slow))
        )
        rms, rms_moving = np.sqrt(wrong / count), np.sqrt(wrong_moving / moving)
    return Errors(
        _mean(relative), _mean(slow), _named(relative, names), _named(slow, names),
        _named(rms, names), {}, (np.nan, np.nan),
        {name: int(each) for name, each in zip(names, count, strict=True)},
        _named(rms_moving, names),
    )  # fmt: skip


def _sums(
    prepared: Sequence[PreparedRun], predictions: Sequence[Prediction]
) -> tuple[tuple[float, ...], ...]:
    sums = [block_sums(run, told.torque) for run, told in zip(prepared, predictions, strict=True)]
    total = np.concatenate(sums, axis=1).sum(axis=1)
    return tuple(tuple(map(float, row)) for row in total)


def _correlated(stored: StoredModel) -> float:
    """How many filtered samples of the model's own residual say as much as one that is new."""
    found = []
    for trace in stored.traces:
        residual = trace.measured - trace.predicted
        for column in residual.T:
            good = column[np.isfinite(column)]
            if len(good) < 50:
                continue
            good = good - good.mean()
            power = float(good @ good)
            if power > 0:
                lagged = [float(good[k:] @ good[:-k]) / power for k in range(1, 40)]
                first = next((k for k, x in enumerate(lagged) if x < 0.05), len(lagged))
                found.append(1.0 + 2.0 * sum(lagged[:first]))
    return float(np.median(found)) if found else 4.0


def _by_name(values: dict[str, float], names: Sequence[str]) -> Array:
    return np.array([values.get(name, np.nan) for name in names])


def _named(values: Array, names: Sequence[str]) -> dict[str, float]:
    return {name: float(x) for name, x in zip(names, values, strict=True)}


def _mean(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else float("nan")
