"""Samples that repeat while the robot moves: masked, and reported.

A stale message repeats all channels for an instant or a few. Its positions would lead the filters
astray (its torque is masked), so they are filled between those of the messages around it.
"""

from dataclasses import replace

import numpy as np

from excite_cli.measurement.dataset import Array, Finding, Mask, Run
from excite_cli.measurement.stretches import moves, stretches

_SHORTEST = 0.1  # s, of a single channel
_FEWEST = 20  # samples, of a single channel
_FROZEN_END = 10  # samples
_HARDER = 3.0  # times the change of a step before a robot stopped
_SHORT = 5  # samples of stale messages that need no jump to be known
# Torques that repeat in less than this share of samples do not all repeat at once by chance.
_HARDLY, _ENOUGH = 1e-3, 200


def mask_stuck(run: Run, joints: tuple[str, ...]) -> tuple[Run, list[Finding]]:
    """Mark repeated samples as not valid.

    Whole rows that repeat (a stale message), and torques of one joint that stand still far longer
    than the channel's own habit of repeating values explains, while that joint moves.
    """
    findings: list[Finding] = []
    valid = run.usable().copy()
    stale = _stale(run)
    if stale.any():
        text = (
            f"{np.count_nonzero(stale)} of {len(run.t)} samples repeat the one before in every "
            "position and torque while the robot moves: stale messages; filled and masked"
        )
        findings.append(Finding("stale", "warning", text, run.name))
        valid[stale] = False
        run = _filled(run, stale)
    same = np.vstack([np.zeros((1, len(joints)), bool), run.tau[1:] == run.tau[:-1]])
    for j, joint in enumerate(joints):
        if same[1:, j].all():
            continue  # constant throughout: a dead channel
        for start, end in _standing(run, same[:, j] & ~stale, j):
            if not valid[start:end, j].any():
                continue
            text = (
                f"torque of {joint} stands at {run.tau[start, j]:.6g} from {run.t[start]:.3f} to "
                f"{run.t[end - 1]:.3f} s while it moves; masked"
            )
            findings.append(Finding("stuck", "warning", text, run.name, (joint,)))
            valid[start:end, j] = False
    return (replace(run, valid=valid) if findings else run), findings


def _stale(run: Run) -> Mask:
    """Rows equal to the one before, where the positions then catch up with a jump.

    At rest, a noiseless robot repeats its rows too, and in slow motion a coarse encoder; there is
    no jump of more than a step of the encoder when it goes on. A few equal rows are stale without
    a jump where no torque of a moving robot ever repeats by itself, and equal rows up to the end
    where the robot would have stopped much harder than it slowed down. Nothing is stale where
    nothing moves.
    """
    moved = np.abs(np.diff(run.q, axis=0)).max(axis=1)
    same = np.diff(run.tau, axis=0) == 0
    repeated = same.all(axis=1) & (moved == 0)
    own = same[moved > 0]
    noisy = len(own) > _ENOUGH and own.mean() < _HARDLY
    # Repeats of a time stamp are duplicates, and told as such.
    repeated = np.concatenate([[False], repeated & (np.diff(run.t) > 0)])
    stale = np.zeros(len(run.t), bool)
    encoder = float(moved[moved > 0].min(initial=np.inf))
    for start, length in zip(*stretches(repeated), strict=True):
        end = start + length
        if end + 1 < len(run.t):
            late = moved[end - 1] > max((1 + 0.5 * length) * moved[end], 2.5 * encoder)
            late |= noisy and length <= _SHORT
        else:
            late = length >= _FROZEN_END and _stops_at_once(run.q[:start])
        stale[start:end] = late and moves(run.q, start, end).any()
    return stale


def _stops_at_once(q: Array) -> bool:
    """Whether the last step of positions (T, n) is no end of a motion that slows down."""
    steps = np.abs(np.diff(q, axis=0))
    if len(steps) < 2:
        return False
    count = np.min(steps, axis=0, initial=np.inf, where=steps > 0)
    harder = steps[-1] > _HARDER * np.abs(steps[-2] - steps[-1]) + 2.5 * count
    return bool(harder.any())


def _filled(run: Run, stale: Mask) -> Run:
    """Positions, speeds and torques of stale rows, linear between fresh ones."""

    def between(values: Array) -> Array:
        columns = (np.interp(run.t, run.t[~stale], column[~stale]) for column in values.T)
        return np.column_stack(list(columns))

    dq = None if run.dq is None else between(run.dq)
    return replace(run, q=between(run.q), tau=between(run.tau), dq=dq)


def _standing(run: Run, repeats: Mask, j: int) -> list[tuple[int, int]]:
    """Long stretches of one joint's torque, while its position changes."""
    habit = np.count_nonzero(repeats) / len(repeats)
    # Length that chance exceeds once in a million runs, given how often values repeat.
    by_chance = np.log(1e-6 / len(repeats)) / np.log(min(max(habit, 1e-6), 0.999))
    fewest = max(by_chance, _SHORTEST / max(run.step, 1e-12), _FEWEST)
    # A coarse torque that changes slowly stands as well, and goes on by one of its own steps.
    steps = np.abs(np.diff(run.tau[:, j]))
    leap = 3 * float(np.median(steps[steps > 0]))
    resumed = np.append(steps, np.inf)
    first, lengths = stretches(repeats)
    found = [(int(a), int(a + n)) for a, n in zip(first, lengths, strict=True) if n >= fewest]
    return [
        (a, b)
        for a, b in found
        if np.ptp(run.q[a:b, j]) > 0 and resumed[b - 1] > leap and moves(run.q, a, b)[j]
    ]
