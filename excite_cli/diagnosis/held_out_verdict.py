"""What every effect is worth on data that took no part: the error there with it and without it.

Without it, the model is fitted anew to the training data: so is what refines it left out, which
would take its place. What the effect removes is the difference of the mean relative errors of the
torque, where joints move: of one that stands the stiction may be any, and no model says it. Blocks
of the held-out part are drawn with replacement, the same for both errors, and say whether it is
above or below zero beyond chance. An effect of several joints is confirmed where it removes error
from those, too, that are not the one from which it removes most. What only weighing tells from the
inertias is not judged by this error: inertias would take it up and predict as well. Nothing is
chosen or fitted by this.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from excite_cli.diagnosis.held_out_errors import HeldOutRuns, refitted
from excite_cli.diagnosis.records import ErrorReduction
from excite_cli.diagnosis.search_result import SearchResult
from excite_cli.diagnosis.textbook import everyday
from excite_cli.diagnosis.verdict import HeldOutVerdict
from excite_cli.identification.errors_of_torque import Errors, block_sums, drawn_blocks
from excite_cli.identification.identified_model import Prediction
from excite_cli.identification.prepare import PreparedRun
from excite_cli.robot.model import Array

# Blocks are longer than what noise of the filtered torque remembers [s]; of little data, shorter.
_SHORTEST, _LONGEST, _WANTED = 0.2, 0.5, 8
_FEWEST = 5  # blocks: of fewer, all of them agree by chance too often
_NIL = 1e-6  # of the torque

Missed = Callable[[Sequence[int], Sequence[int], Sequence[int]], bool]


@dataclass(frozen=True)
class Worth:
    """The verdict on an effect, and by how much it lowers the error, per joint where it does."""

    verdict: HeldOutVerdict
    removes: dict[str, ErrorReduction]


def worth_on_held_out(
    held: HeldOutRuns,
    traced: SearchResult,
    with_all: Sequence[Prediction],
    sizes: Mapping[int, float],
    missed: Missed | None = None,
) -> dict[int, Worth]:
    """Worth of every chosen candidate on the held-out runs `held`, beside all others.

    `with_all`: what the model with all of them predicts there. `sizes` over two standard
    deviations: what may be zero is not confirmed. Nor is what not every robot has, unless training
    data left out have `missed` it as well.
    """
    common = set(everyday(traced.candidates))
    found = {}
    for i in traced.chosen:
        rest = traced.judge.without(i, traced.chosen)
        candidate = traced.candidates[i]
        joints = [j for j in candidate.effect.joints if j in candidate.rows]
        worth = worth_beside(held, traced, with_all, rest, joints)
        verdict = worth.verdict
        if traced.judge.identified_by_prior_only(i, rest):
            verdict = HeldOutVerdict.WEIGHED
        elif verdict is HeldOutVerdict.CONFIRMED:
            named = (
                i in common
                or missed is None
                or missed(traced.chosen, rest, traced.candidates[i].rows)
            )
            if sizes[i] < 1.0 or not named:
                verdict = HeldOutVerdict.NOT_CONFIRMED
        found[i] = replace(worth, verdict=verdict)
    return found


def worth_beside(
    held: HeldOutRuns,
    traced: SearchResult,
    with_all: Sequence[Prediction],
    rest: Sequence[int],
    joints: Sequence[int],
) -> Worth:
    """What all candidates but the `rest` are worth, which act on some joints."""
    without = held.predictions(refitted(traced, rest))
    errors_without, errors = held.errors(without), held.errors(with_all)
    lower = errors_without.mean_relative - errors.mean_relative
    verdict = held_out_verdict(removed_in_draws(held.runs, without, with_all), lower)
    if verdict is HeldOutVerdict.CONFIRMED and len(joints) > 1:
        on = [held.robot.joint_names[j] for j in joints]
        gains = [errors_without.relative[name] - errors.relative[name] for name in on]
        best = joints[int(np.argmax(np.nan_to_num(gains)))]
        others = removed_in_draws(held.runs, without, with_all, beside=best)
        verdict = held_out_verdict(others, lower)
    return Worth(verdict, _removes(errors_without, errors))


def held_out_verdict(removed: Array, lower: float) -> HeldOutVerdict:
    """Judge an effect by what it removes in many draws of blocks (draws,), none if there are few.

    `lower`: by how much it lowers the mean error over all samples, also where joints stand; a
    verdict that this contradicts is not given.
    """
    if not len(removed):
        return HeldOutVerdict.NOT_CONFIRMED
    low, high = np.percentile(removed, [2.5, 97.5])
    if low > 0.0 and lower > 0.0:
        return HeldOutVerdict.CONFIRMED
    if high < 0.0 and lower < 0.0:
        return HeldOutVerdict.HARMFUL
    return HeldOutVerdict.NOT_CONFIRMED


def removed_in_draws(
    runs: Sequence[PreparedRun],
    without: Sequence[Prediction],
    with_it: Sequence[Prediction],
    beside: int | None = None,
) -> Array:
    """What is removed from the mean relative error where joints move; (0,) of too few blocks.

    Of all joints, or those `beside` one.
    """
    moving = sum(run.step * (run.valid & run.moving).any(axis=1).sum() for run in runs)
    block = min(max(moving / _WANTED, _SHORTEST), _LONGEST)
    (worse, size), (better, _) = (_moving_sums(runs, each, block) for each in (without, with_it))
    if beside is not None:
        worse, better, size = (np.delete(x, beside, axis=1) for x in (worse, better, size))
    moves = size.any(axis=1)
    if np.count_nonzero(moves) < _FEWEST:
        return np.zeros(0)
    # The torque's size is not drawn anew: few blocks may hold next to none of a joint's.
    moved = size.any(axis=0)
    whole, draws = size.sum(axis=0)[moved], drawn_blocks(int(np.count_nonzero(moves)))
    relative = [np.sqrt(draws @ each[moves][:, moved] / whole) for each in (worse, better)]
    return np.asarray((relative[0] - relative[1]).mean(axis=1))


def _moving_sums(
    runs: Sequence[PreparedRun], predictions: Sequence[Prediction], block: float
) -> tuple[Array, Array]:
    """‖e‖² and ‖τ‖² of every block, where the joints move: (B, n) each."""
    sums = [
        block_sums(run, each.torque, block) for run, each in zip(runs, predictions, strict=True)
    ]
    wrong, size = np.concatenate(sums, axis=1)[2:4]
    return wrong, size


def _removes(without: Errors, with_it: Errors) -> dict[str, ErrorReduction]:
    """What is removed on every joint on which it is not nil."""
    found = {}
    for joint, relative in with_it.relative.items():
        less = without.relative[joint] - relative
        if abs(less) > _NIL:
            found[joint] = ErrorReduction(
                less,
                without.relative_moving[joint] - with_it.relative_moving[joint],
                without.rms[joint] - with_it.rms[joint],
            )
    return found
