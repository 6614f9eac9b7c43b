"""Data with columns in another order or of other signs, and how well each fits the robot.

What torques alone can be is an assignment: which torque, with which sign, fits which joint. Where
positions change, the motion must be evaluated anew; so that search goes step by step, the best
single change (two joints exchanged, one mirrored, the whole order turned round or shifted) first,
then the next.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from excite_cli.diagnosis.torque_shares import RoughModel, Samples
from excite_cli.robot.model import Array

_SEARCH_SAMPLES = 100
# Shares below this are the noise, the inertias' errors and effects: no difference is made there.
FLOOR = 0.02
# A gain in log(share before / share after) that is worth a word: one share nearly halved.
CLEAR = 0.64
# What every change costs, in the same measure: of explanations alike, the simpler one.
PRICE = 0.35
# The gain that makes another sign of a torque worth a try.
SIGN = 0.4

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

    def applied(self, samples: Samples) -> Samples:
        """The data with the change made."""
        q, v, a = (x[:, self.q_order] * self.q_sign for x in (samples.q, samples.v, samples.a))
        tau = samples.tau[:, self.tau_order] * self.tau_sign
        known, moves = samples.known[:, self.tau_order], samples.moves[:, self.q_order]
        return Samples(q, v, a, tau, known, moves)

    @property
    def exchanges(self) -> int:
        """How many columns were exchanged; a whole turn or shift counts once."""
        again = not (self.tau_order == self.q_order).all()
        return exchanges(self.q_order) + (exchanges(self.tau_order) if again else 0)

    @property
    def mistakes(self) -> int:
        """How many things went wrong: exchanges and signs; all signs turned count once."""
        turned = self.signs.sum(axis=1)
        return self.exchanges + int(np.where(turned == len(self.q_sign), 1, turned).sum())

    @property
    def signs(self) -> NDArray[np.bool_]:
        """Joints whose torque, and whose position, has the other sign: (2, n)."""
        return np.array([self.tau_sign < 0, self.q_sign < 0])

    @property
    def touched(self) -> NDArray[np.bool_]:
        """Joints (n,) whose own columns change."""
        here = np.arange(len(self.q_sign))
        orders = (self.q_order != here) | (self.tau_order != here)
        return np.asarray(orders | (self.q_sign < 0) | (self.tau_sign < 0))


@dataclass(frozen=True)
class Verdict:
    """A change and the shares (n,) of the torques that it leaves."""

    change: Change
    left: Array

    @property
    def cost(self) -> float:
        """Σ log of the shares, and the price of the change: the smaller the better."""
        return float(logs(self.left).sum()) + PRICE * self.change.mistakes


def exchanges(order: Order) -> int:
    """Exchanges of two that make up an order; turned round or shifted as a whole, it is one."""
    n = len(order)
    shifted = bool((np.diff(order) % n == 1).all())
    reversed_ = bool((order == np.arange(n)[::-1]).all())
    if n > 2 and (shifted or reversed_):
        return int(order[0] != 0)
    cycles = connected_components(csr_matrix((np.ones(n), (np.arange(n), order))))[0]
    return n - int(cycles)


def logs(left: Array) -> Array:
    """Logarithm of shares, which make no difference below `FLOOR`."""
    return np.log(np.clip(left, FLOOR, 1.0))


def torques_changed(table: Array) -> Iterator[Verdict]:
    """Torques of other signs, in another order, or both, on the motion as it is.

    `table` (n, n, 2): share of torque k that joint j's motion leaves, by sign.
    """
    n = len(table)
    here, ones = np.arange(n), np.ones(n)
    sign, left = _signed(table[here, here])
    yield Verdict(Change(here, ones, here, sign), left)
    yield Verdict(Change(here, ones, here, -ones), table[here, here, 1])
    for cost in (logs(table[:, :, 0]), logs(table).min(axis=2)):
        # An exchange has its price: of torques that fit about as well, each joint keeps its own.
        order = linear_sum_assignment(cost - 0.5 * PRICE * np.eye(n))[1]
        yield Verdict(Change(here, ones, order, ones), table[here, order, 0])
        sign, left = _signed(table[here, order])
        yield Verdict(Change(here, ones, order, sign), left)


def positions_changed(
    model: RoughModel, samples: Samples, untouched: NDArray[np.bool_]
) -> list[Verdict]:
    """The best changes of positions, with or without their torques, found step by step.

    Of joints `untouched` (n,) nothing is changed.
    """
    few = samples.thinned(_SEARCH_SAMPLES)
    n = samples.q.shape[1]
    current = _judged(model, few, [Change.none(n)])[0]
    for step in range(n + 1):
        near = _neighbours(current.change, far=step == 0)
        tried = [change for change in near if not (change.touched & untouched).any()]
        if not tried:
            break
        found = _judged(model, few, tried)
        best = min(found, key=lambda verdict: verdict.cost)
        if best.cost > current.cost - 1e-6:
            break
        current = best
    if not current.change.mistakes:
        return []
    return _judged(model, samples, [current.change], signs=False)


def mirrored(model: RoughModel, samples: Samples, change: Change) -> list[Verdict]:
    """What torques of another sign may be as well: the joint's positions have the opposite sign."""
    turned = np.flatnonzero((change.tau_sign < 0) & (change.q_sign > 0))
    if not len(turned):
        return []
    here = np.arange(len(change.q_sign))
    found = []
    for j in turned:
        sign = np.where(here == j, -1.0, 1.0)
        found.append(replace(change, q_sign=change.q_sign * sign, tau_sign=change.tau_sign * sign))
    return _judged(model, samples, found, signs=False)


def _neighbours(change: Change, far: bool) -> Iterator[Change]:
    """Changes one step away: orders come with torques that follow, and with torques that stay."""
    n = len(change.q_sign)
    here = np.arange(n)
    steps = []
    for pair in combinations(range(n), 2):
        order = here.copy()
        order[list(pair)] = pair[::-1]
        steps.append(order)
    if far and n > 2:
        steps += [np.roll(here, shift) for shift in range(1, n)] + [here[::-1].copy()]
    follows = bool((change.tau_order == change.q_order).all())
    stays = bool((change.tau_order == here).all())
    for order in steps:
        moved = replace(change, q_order=change.q_order[order], q_sign=change.q_sign[order])
        if follows:
            yield replace(moved, tau_order=moved.q_order)
        if stays:
            yield moved
    for j in range(n):
        sign = change.q_sign.copy()
        sign[j] *= -1
        yield replace(change, q_sign=sign)
    if far:
        yield replace(change, q_sign=-change.q_sign)


def _judged(
    model: RoughModel, samples: Samples, changes: Sequence[Change], signs: bool = True
) -> list[Verdict]:
    """Shares left by every change; with `signs`, the signs of the torques are chosen anew."""
    if signs:
        changes = [replace(change, tau_sign=np.abs(change.tau_sign)) for change in changes]
    left = model.own_shares_left([change.applied(samples) for change in changes])
    shares = left[..., 0]
    if signs:
        chosen, shares = _signed(left)
        changes = [replace(c, tau_sign=sign) for c, sign in zip(changes, chosen, strict=True)]
    return [Verdict(c, share) for c, share in zip(changes, shares, strict=True)]


def _signed(left: Array) -> tuple[Array, Array]:
    """Signs and shares (…, n) from (…, n, 2): the other sign only where it is clearly better."""
    other = logs(left[..., 1]) < logs(left[..., 0]) - SIGN
    return np.where(other, -1.0, 1.0), np.where(other, left[..., 1], left[..., 0])
