"""Could these be the robot's torques and positions? Order and signs, judged with the URDF.

A mistake in the file is not an effect of the robot, and a diagnosis of such data would be wrong
from the start. So a few mistakes are tried: columns in another order, torques or positions that
count the other way. One is told if, undone, it leaves clearly less of the torques (see
`torque_shares`) than the data as they are, and no joint fits clearly worse.

Motions must be evaluated anew when positions are exchanged; so the search goes step by step, the
best single change (two joints exchanged, one mirrored, the whole order turned or shifted) first,
then the next.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from excite_cli.diagnosis.torque_shares import (
    Samples,
    columns_of,
    own_shares_left,
    samples_of,
    shares_left,
)
from excite_cli.errors import FileError
from excite_cli.identification.prepare import PreparedRun
from excite_cli.robot.inverse_dynamics import InverseDynamics
from excite_cli.robot.model import Array, Robot

_SAMPLES, _SEARCH_SAMPLES = 600, 150
# Shares below this are the noise, the inertias' errors and effects: no difference is made there.
_FLOOR = 0.05
# Data that fit this well on every joint are what they say they are.
_GOOD = 0.1
# What a change must gain, in Σ log(share before / share after): as much as halving one share.
_CLEAR = float(np.log(2.0))
_WORSE = 0.25  # by which no joint may lose, in the same measure
_FITS = 0.6  # share that a changed joint may have left at most
_EQUAL = 0.35  # gains that differ by less cannot be told apart

Order = NDArray[np.intp]


@dataclass(frozen=True)
class Change:
    """What is done to the columns of the file: column `order[j]` times `sign[j]` is joint j's.

    `q_*` of positions (and speeds), `tau_*` of torques.
    """

    q_order: Order
    q_sign: Array
    tau_order: Order
    tau_sign: Array

    @classmethod
    def none(cls, n: int) -> "Change":
        """The data as they are."""
        return cls(np.arange(n), np.ones(n), np.arange(n), np.ones(n))


@dataclass(frozen=True)
class Verdict:
    """A change and the shares (n,) of the torques that it leaves."""

    change: Change
    left: Array

    @property
    def score(self) -> float:
        """The smaller the better."""
        return float(_log(self.left).sum())


def check_plausibility(robot: Robot, runs: Sequence[PreparedRun]) -> None:
    """Refuse data whose order of columns or whose signs contradict the robot.

    Raises
    ------
    FileError
        Columns are in another order, or torques or positions of joints count the other way.
    """
    samples = samples_of(runs, _SAMPLES)
    dynamics = InverseDynamics(robot)
    n = robot.n
    columns = columns_of(dynamics, samples.q, samples.v, samples.a)
    table = shares_left(columns, samples.tau, samples.usable)
    straight = Verdict(Change.none(n), table[np.arange(n), np.arange(n), 0])
    if straight.left.max() < _GOOD:
        return
    torques = [v for v in _torques_changed(table) if _clearly_better(v, straight)]
    motion = _motion_changed(dynamics, samples, straight)
    found = [v for v in (*torques, motion) if v is not None and _clearly_better(v, straight)]
    if not found:
        return
    # Sorted is stable: of equals, the one that changes torques alone comes first.
    best = min(found, key=lambda verdict: verdict.score + _EQUAL * _size(verdict.change))
    others = [
        verdict
        for verdict in found
        if verdict is not best and verdict.score < best.score + _EQUAL
    ]
    raise FileError(_message(robot.joint_names, best, others, straight))


def _log(left: Array) -> Array:
    return np.log(np.clip(left, _FLOOR, 1.0))


def _size(change: Change) -> int:
    """How many things a person must have done wrong."""
    n = len(change.q_sign)
    here = np.arange(n)
    orders = int((change.q_order != here).any()) + int(
        (change.tau_order != change.q_order).any()
    )
    signs = [int((sign < 0).sum()) for sign in (change.q_sign, change.tau_sign)]
    return orders + sum(1 if count == n else count for count in signs)


def _clearly_better(verdict: Verdict, straight: Verdict) -> bool:
    """Whether the change gains enough, on the joints it is about, and costs none of the others."""
    gain = _log(straight.left) - _log(verdict.left)
    change, here = verdict.change, np.arange(len(gain))
    turned = (change.tau_sign < 0) & (change.q_sign > 0)
    touched = turned | (change.tau_order != here) | (change.q_order != here)
    touched |= change.q_sign < 0
    return bool(
        gain.sum() > _CLEAR
        and gain.min() > -_WORSE
        and (gain[turned] > _CLEAR).all()
        and gain[touched].mean() > 0.5 * _CLEAR
        and verdict.left[touched].max(initial=0.0) < _FITS
    )


def _signed(left: Array) -> tuple[Array, Array]:
    """Signs (n,) and shares (n,) from (n, 2): the other sign only where it is clearly better."""
    other = _log(left[:, 1]) < _log(left[:, 0]) - _CLEAR
    return np.where(other, -1.0, 1.0), np.where(other, left[:, 1], left[:, 0])


def _torques_changed(table: Array) -> Iterator[Verdict]:
    """Torques of other signs, in another order, or both, on the motion as it is."""
    n = len(table)
    here = np.arange(n)
    sign, left = _signed(table[here, here])
    if (sign < 0).any():
        yield Verdict(Change(here, np.ones(n), here, sign), left)
    for cost in (_log(table[:, :, 0]), _log(table).min(axis=2) + _EQUAL):
        # Of columns that fit equally well, each joint keeps its own.
        order = linear_sum_assignment(cost - 1e-3 * np.eye(n))[1]
        if (order == here).all():
            continue
        sign, left = _signed(table[here, order])
        yield Verdict(Change(here, np.ones(n), order, sign), left)
        keep = table[here, order, 0]
        yield Verdict(Change(here, np.ones(n), order, np.ones(n)), keep)


def _motion_changed(
    dynamics: InverseDynamics, samples: Samples, straight: Verdict
) -> Verdict | None:
    """The best change of positions found step by step, with or without their torques."""
    few = samples.thinned(_SEARCH_SAMPLES)
    n = len(straight.left)
    current = Change.none(n)
    score = _judged(dynamics, few, current).score
    for step in range(n + 1):
        tried = [
            _judged(dynamics, few, each)
            for change in _next_changes(current, first=step == 0)
            for each in _with_torques(change)
        ]
        best = min(tried, key=lambda verdict: verdict.score + _EQUAL * _size(verdict.change))
        cost = best.score + _EQUAL * _size(best.change)
        if cost > score + _EQUAL * _size(current) - 1e-9:
            break
        current, score = best.change, best.score
    if _size(current) == 0:
        return None
    return _judged(dynamics, samples, current)
