"""How a diagnosis judges an effect: by which rules it is named, and which sizes are possible.

All have defaults, which suit most effects; a member says what is otherwise of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cache
from math import inf
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from excite_cli.arrays import Array, Mask

if TYPE_CHECKING:
    from excite_cli.effects.base import Effect
    from excite_cli.effects.parameter import Parameter
    from excite_cli.effects.signals import Signals

# How far several fitted parameters may be off by chance: lengths and distances in their errors.


# Chance of a true effect to look impossible by the error of the fit, and be refused.
_CHANCE = 0.01


@cache
def two_deviations(count: int) -> float:
    """Length that `count` unit normals exceed as rarely as one exceeds two deviations."""
    from scipy.stats import chi2  # slow to import

    return float(np.sqrt(chi2.isf(chi2.sf(4.0, 1), count)))


@cache
def unlikely_distance(count: int) -> float:
    """χ² distance that `count` parameters of a possible effect seldom have from possible ones."""
    from scipy.stats import chi2  # slow to import

    return float(chi2.isf(_CHANCE, count))


def half_of(covariance: Array) -> Array:
    """B (size, size) with B Bᵀ a `covariance`, however ill-conditioned."""
    scale = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    scale[scale < 1e-150] = 1.0
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    return np.asarray(scale[:, None] * vectors * np.sqrt(np.maximum(values, 1e-12)))


def nearest_of_sign(values: Array, covariance: Array, signed: Mask) -> Array:
    """The nearest parameters (p,) of which those that are `signed` are not negative.

    minimise (x − values)ᵀ covariance⁻¹ (x − values) subject to x_k ≥ 0, a bounded least-squares
    problem.
    """
    from scipy.optimize import lsq_linear  # slow to import

    whiten = np.linalg.inv(half_of(covariance))
    lower = np.where(signed, 0.0, -np.inf)
    found = lsq_linear(
        whiten, whiten @ values, (lower, np.full(len(values), np.inf)), method="bvls"
    )
    return np.asarray(np.where(signed & (found.x <= 1e-12 * np.abs(values)), 0.0, found.x))


class Tier(IntEnum):
    """When a diagnosis asks for a kind; a later one may still replace an earlier one."""

    EVERY_ROBOT = 1
    MANY_ROBOTS = 2
    LAST = 3


@dataclass(frozen=True)
class Seen:
    """Of each moved joint (n,) [N·m]: the largest measured `torque`, and RMS of the rigid `load`.

    `mass` of the robot [kg]; `reach` [m], beyond which it carries nothing (default: no bound).
    """

    torque: Array
    load: Array
    mass: float
    reach: float = inf


class Judgement:
    """What is known of an effect before data, and what its fitted values may be."""

    kind: ClassVar[str]
    parameters: ClassVar[tuple[Parameter, ...]]
    shapes: ClassVar[tuple[Parameter, ...]] = ()
    joints: tuple[int, ...]
    shape: Mapping[str, float]
    runs: tuple[str, ...]
    # In all runs, but its size may change from run to run: in runs of its own it is that change.
    changes_between_runs: ClassVar[bool] = False

    # χ² that it must save beyond what chance makes of all tests, where two kinds explain the data
    # about as well.
    prior_cost: ClassVar[float] = 4.0
    tier: ClassVar[Tier] = Tier.MANY_ROBOTS
    refines: ClassVar[tuple[str, ...]] = ()  # kinds of one joint that must be in before it
    excludes: ClassVar[tuple[str, ...]] = ()  # other forms of its cause: a place has one of them
    same_as: ClassVar[tuple[str, ...]] = ()  # kinds that together are the same columns
    # Kinds that are judged by the straight line through both: of themselves they may be nothing.
    deviates_from: ClassVar[tuple[str, ...]] = ()
    # Kinds of its joints that it is the change of over the angle, or a share of: never more than
    # is there.
    varies: ClassVar[tuple[str, ...]] = ()
    # Dry or viscous friction of its one joint: part of the straight line that data sheets give.
    friction: ClassVar[bool] = False
    # A `curve` takes its place only where that leaves less on its joints by this share; 0: where
    # it leaves no more.
    holds_until_beaten: ClassVar[float] = 0.0
    # Many robots have it: it is in the model while the noise is measured, lest it be taken for it.
    usual: ClassVar[bool] = False

    # Share of what it explains that may be lost where fitted numbers are moved to possible ones.
    projection_tolerance: ClassVar[float] = 0.0

    # By how much a shape parameter is changed, up and down, once its effect is found.
    finer_ratios: ClassVar[tuple[float, ...]] = (1.35, 1.15, 1.06, 1.02)

    # Linear parameters that are its size, by name; empty: all of them together.
    size: ClassVar[tuple[str, ...]] = ()

    @property
    def shape_cost(self) -> float:
        """χ² beyond `prior_cost`, of parameters that not all of its shapes have."""
        return 0.0

    @property
    def is_change(self) -> bool:
        """Whether it is by how much something that all runs have is more, or less, in some."""
        return self.changes_between_runs and bool(self.runs)

    @property
    def builds_on(self) -> tuple[str, ...]:
        """Kinds of one joint that must be in before it: `refines`; of a change, its own kind."""
        every = self.is_change and self.tier == Tier.EVERY_ROBOT
        return (*self.refines, self.kind) if every else self.refines

    @property
    def asked_for(self) -> Tier:
        """Its tier; a change in some runs waits for what sets runs apart on many robots."""
        return max(self.tier, Tier.MANY_ROBOTS) if self.is_change else self.tier

    @classmethod
    def exclusive_with(cls, other: type[Effect]) -> bool:
        """Whether a place has one of the two at most; either of them may say so."""
        return other.kind in cls.excludes or cls.kind in other.excludes

    @property
    def imitates(self) -> bool:
        """Whether it comes near all that it refines, which then stays in whatever it explains.

        Nor may it replace any of that. Changes in enough runs are as good as what all runs have.
        """
        return self.is_change

    @property
    def completes(self) -> bool:
        """Whether, with one of the kinds that it refines in, the others are put in as well.

        A small one may not pass on its own, and this effect would stand for it.
        """
        return self.imitates

    def possible(self, values: Array) -> bool:
        """Whether fitted `values` have signs and sizes that physics allows; a change either."""
        if self.is_change:
            return True
        given = zip(self.parameters, values, strict=True)
        return all(parameter.allows(float(value)) for parameter, value in given)

    def nearest(self, values: Array, covariance: Array) -> Array:
        """The nearest values of possible signs, in units of their error.

        Of a single parameter that is zero, and nothing is left.
        """
        signed = np.array([parameter.nonnegative for parameter in self.parameters])
        if not (signed & (values < 0.0)).any():
            return values
        return nearest_of_sign(values, covariance, signed)

    def why_impossible(self, values: Array, covariance: Array) -> str:
        """Why values that are not `possible` cannot be the error of the fit; empty if they can.

        They cannot where the χ² distance to the `nearest` ones is one that chance exceeds in 1 % of
        all cases, if it is also more than the share `projection_tolerance` of all that the effect
        explains; and what is then left of the effect must be more than its error.
        """
        near = self.nearest(values, covariance)
        if not self.possible(near):
            return self.why_not(values)
        whiten = np.linalg.inv(half_of(covariance))
        far, whole = (float(np.square(whiten @ x).sum()) for x in (values - near, values))
        if far > max(unlikely_distance(len(values)), self.projection_tolerance * whole):
            return self.why_not(values)
        return "" if self.signal_to_error(near, covariance) > 1.0 else self.why_not(values)

    @property
    def varied(self) -> str:
        """Which of the kinds that it may vary it does; empty if none."""
        return next(iter(self.varies), "")

    def taken(self, values: Array) -> tuple[float, Array]:
        """How much it takes at most of what is `varied`, and the derivative (p,) of that."""
        return 0.0, np.zeros(len(values))

    def absurd(self, values: Array, seen: Seen) -> str:
        """Why values that could be are absurd on the robot that was `seen`; empty if they are not.

        The whole search asks it: it must be cheap.
        """
        torque = max(seen.torque[j] for j in self.joints)
        for parameter, value in zip(self.parameters, values, strict=True):
            if reason := parameter.absurd(float(value), torque):
                return reason
        return ""

    def why_not(self, values: Array) -> str:
        """Why values are not `possible`, as a sentence."""
        given = zip(self.parameters, values, strict=True)
        reasons = [parameter.why_not(float(value)) for parameter, value in given]
        return next((reason for reason in reasons if reason), "outside the range of this effect")

    def signal_to_error(self, values: Array, covariance: Array) -> float:
        """Size over error: above 1 beyond two standard deviations, or as rare for several."""
        names = [parameter.name for parameter in self.parameters]
        at = [names.index(name) for name in self.size or names]
        whiten = np.linalg.inv(half_of(covariance[np.ix_(at, at)]))
        return float(np.linalg.norm(whiten @ values[at])) / two_deviations(len(at))

    def model_error(self, values: Array) -> Array:
        """Standard deviations (p,) that the inexactness of its columns gives to its parameters."""
        return np.zeros(len(values))

    def finer_steps(self, name: str, signals: Sequence[Signals]) -> Sequence[float]:
        """By how much shape parameter `name` is changed, up and down, once the effect is found.

        A grid names an effect, it does not measure it. Empty: the grid is all there is.
        """
        return steps_by_ratio(self.shape[name], self.finer_ratios)

    def shapes_near(self, signals: Sequence[Signals]) -> list[dict]:
        """Shapes that may be better once the effect is found: by `finer_steps`, one at a time."""
        known = {parameter.name: parameter for parameter in self.shapes}
        return [
            {**self.shape, name: near}
            for name, value in self.shape.items()
            for change in self.finer_steps(name, signals)
            for near in (float(value - change), float(value + change))
            if known[name].allows(near)
        ]

    def compares_with(self, other: Effect) -> bool:
        """Whether sizes in the shape of `other` say how uncertain its own are."""
        return True

    def shows_above(self, speed: float) -> bool:
        """Whether it shows at speeds above `speed`: slower samples are left out."""
        return True

    def coupled_speeds(self) -> tuple[tuple[int, int, float], ...]:
        """Joints j, k and s of which v_j + s v_k must not stand still: columns are wrong there."""
        return ()

    def forgets_over(self) -> tuple[tuple[int, float], ...]:
        """Joints and ways [rad] that they must have gone in a run before columns are right."""
        return ()

    def cuts_at(self) -> tuple[tuple[int, float], ...]:
        """Joints and torques that no reading exceeds, whatever else adds to them there."""
        return ()

    def curve(self, signals: Signals, every: Sequence[Signals]) -> Array | None:
        """Columns (T, r, k) in one part of `every` of a curve without a name that it comes near.

        None: its form is its own. An effect that leaves no less than the curve is doubted; one that
        `holds_until_beaten` by a share, only where the curve leaves less by it.
        """
        return None


def steps_by_ratio(value: float, ratios: Sequence[float]) -> list[float]:
    """Changes of `value` by these ratios, all above one."""
    return [(ratio - 1.0) * value for ratio in ratios]
