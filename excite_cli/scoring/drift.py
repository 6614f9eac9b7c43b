"""Since when runs are worse than all before, by less than the model's own residual allows.

Of ratios of a joint: from some run on all are clearly above those before that raised no alarm. If
their order were chance, a runs on one side and b on the other would come apart like that once in
C(a + b, b) times, for every place to cut and every joint.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from math import comb

import numpy as np

from excite_cli.measurement.dataset import Finding
from excite_cli.scoring.records import ScoredRun

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
