"""Torque that stands at a limit: named with its level and masked.

A torque clipped at L has a heap of samples at exactly L. Near an ordinary extremum the samples in a
band of width w below it grow like w^(1/2) (a parabola) or w^(1/4) (a flat top): the first band then
holds at most 2.4 times as many as the next three. A clipped torque holds many times more.
"""

from dataclasses import replace

import numpy as np

from excite_cli.measurement.dataset import Array, Finding, Mask, Run
from excite_cli.measurement.stretches import longest

_HEAP = 5.0  # samples in the first band, per sample in the next three
_FEWEST = 10
_SHORTEST = 5  # samples in a row
_AROUND = 5  # samples before and after that tell whether a joint moves


def mask_saturated(run: Run, joints: tuple[str, ...], revolute: Mask) -> tuple[Run, list[Finding]]:
    """Mark torques at a plateau as not valid; say its level and its share of moving samples.

    `revolute` (n,): which joints turn; what moves others are forces.
    """
    if len(run.t) <= 2 * _AROUND:
        return run, []
    valid, findings = run.usable().copy(), []
    moving = _moving(run)
    for j, joint in enumerate(joints):
        usable = valid[:, j] & moving[:, j]
        values = run.tau[usable, j]
        if len(values) < _FEWEST or np.ptp(values) == 0:
            continue
        for side, word in ((1.0, "upper"), (-1.0, "lower")):
            at = _plateau(side * values)
            if at is None:
                continue
            level = side * float((side * values).max())
            share, unit = np.count_nonzero(at) / len(values), "N·m" if revolute[j] else "N"
            text = (
                f"torque of {joint} stands at its {word} limit {level:.6g} {unit} in {share:.1%} "
                "of moving samples: saturated, or clipped when recorded; these samples are masked"
            )
            findings.append(Finding("saturated", "warning", text, run.name, (joint,)))
            valid[np.flatnonzero(usable)[at], j] = False
    return (replace(run, valid=valid) if findings else run), findings


def _moving(run: Run) -> Mask:
    """Whether a joint moves around an instant, (T, n); at rest a coarse torque stands too."""
    ahead = np.vstack([run.q[_AROUND:], np.repeat(run.q[-1:], _AROUND, axis=0)])
    behind = np.vstack([np.repeat(run.q[:1], _AROUND, axis=0), run.q[:-_AROUND]])
    return np.asarray(ahead != behind)


def _plateau(values: Array) -> Mask | None:
    """Samples at the top, if they are a plateau."""
    top, span = values.max(), np.ptp(values)
    levels = np.abs(np.diff(values))
    moved = levels[levels > 1e-9 * span]
    step = max(float(moved.min()) if len(moved) else 0.0, 1e-6 * span)  # of the quantisation
    if step > span / 8:
        return None  # too few levels to tell a plateau from a step
    at = values > top - 0.5 * step
    count = int(np.count_nonzero(at))
    below = int(np.count_nonzero(values > top - 3.5 * step)) - count
    enough = count >= max(_FEWEST, 0.003 * len(values))
    if not enough or count < _HEAP * below or longest(at) < _SHORTEST:
        return None
    # A torque of two values only (bang-bang) has no plateau, it has nothing else.
    return at if count < 0.9 * len(values) else None
