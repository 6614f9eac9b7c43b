"""What an effect is: torque that rigid bodies do not explain, linear in its parameters.

    tau_j = (Y φ)_j + Σ_e Σ_p columns_e[j, p] · θ_e,p

An effect acts on some joints (`joints`, indices of moved joints) and touches some rows (`rows`).
Its columns may depend on time, on q, v, a and, for friction that grows with load, gains and delays,
on the torque of the model found so far; its non-linear parameters (`shape`) are numbers chosen from
a grid. The same class serves planning (columns and their vector–Jacobian product,
`pull_back`), identification, diagnosis and simulation (torque for given values).

Beside its columns, an effect may state what is known of it: by which rules a diagnosis names it
(`judgement`), how it gets into a simulated robot (`mechanism`), and how it is drawn
(`presentation`). No other part of the program asks for a kind by its name.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np

from excite_cli.effects.judgement import Judgement
from excite_cli.effects.judgement import Tier as Tier
from excite_cli.effects.judgement import steps_by_ratio as steps_by_ratio
from excite_cli.effects.mechanism import Mechanism
from excite_cli.effects.parameter import Parameter
from excite_cli.effects.parameter import Value as Value
from excite_cli.effects.parameter import deviation as deviation
from excite_cli.effects.presentation import Abscissa as Abscissa
from excite_cli.effects.presentation import Picture as Picture
from excite_cli.effects.presentation import Presentation, Scope
from excite_cli.effects.presentation import Quantity as Quantity
from excite_cli.effects.signals import Cotangents, Signals

if TYPE_CHECKING:
    from excite_cli.measurement.run_identity import RunId
    from excite_cli.robot.model import Array, Robot


class Place(NamedTuple):
    """Kind, joints, runs (empty: all) and the column of the log that is followed, if any.

    What two effects that differ in their shape only have in common.
    """

    kind: str
    joints: tuple[int, ...]
    runs: tuple[str, ...] = ()
    covariate: str = ""


@dataclass(frozen=True)
class Effect(Judgement, Mechanism, Presentation, ABC):
    """An effect on given joints with given shape (values of its non-linear parameters).

    `runs`: the recordings, or stretches of them, in which it is present; empty means all.
    `covariate`: the column of the log that it follows, if its kind follows one.
    """

    joints: tuple[int, ...]
    shape: Mapping[str, float] = field(default_factory=dict)
    runs: tuple[str, ...] = ()
    covariate: str = ""

    kind: ClassVar[str]
    title: ClassVar[str]
    signature: ClassVar[str]
    scope: ClassVar[Scope] = "joint"
    parameters: ClassVar[tuple[Parameter, ...]]
    shapes: ClassVar[tuple[Parameter, ...]] = ()
    per_run: ClassVar[bool] = False  # present in some runs only: looked for in each on its own
    can_appear_later: ClassVar[bool] = False  # from one day on a robot may have it, or more of it
    in_all_rows: ClassVar[bool] = False  # its torque shows in every joint, not in its own alone
    of_campaign: ClassVar[bool] = False  # its columns look at the campaign's clock
    # Looked for once for every declared column of the log; its grid sees signals with that alone.
    follows_covariate: ClassVar[bool] = False
    changes_of: ClassVar[tuple[str, ...]] = ()  # kinds whose size its parameters change, in order
    # Its columns are the whole torque of the model: other effects of its joints are in them.
    of_whole_torque: ClassVar[bool] = False
    # What tells its size where inertias take it up, as a person may declare it.
    identified_by: ClassVar[str] = ""
    on_base: ClassVar[bool] = False  # rows of a measured base may have it, which have no gears
    of_sensor: ClassVar[bool] = False  # of a torque that was measured: a law's has none
    # Its torque at an instant depends on the time, or on other instants: it needs a series.
    over_time: ClassVar[bool] = False
    excitable: ClassVar[bool] = True  # has columns for a planned motion, and `pull_back`
    why_not_excitable: ClassVar[str] = ""

    @classmethod
    def places(cls, robot: Robot) -> list[tuple[int, ...]]:
        """The sets of joints on which this kind is looked for."""
        first = 0 if cls.on_base else robot.base_joints
        if cls.scope == "joint":
            return [(j,) for j in range(first, robot.n)]
        if cls.scope == "pair":
            return [pair for pair in neighbours(robot) if min(pair) >= first]
        if cls.scope == "base":
            return [tuple(range(robot.base_joints))] if robot.base_joints else []
        return [tuple(range(robot.n))]

    @classmethod
    def grid(cls, robot: Robot, joints: tuple[int, ...], signals: Sequence[Signals]) -> list[dict]:
        """Values of the non-linear parameters that are tried; each counts as a test."""
        return [{}]

    @classmethod
    def tuned(
        cls,
        robot: Robot,
        joints: tuple[int, ...],
        signals: Sequence[Signals],
        residuals: Sequence[Array],
    ) -> list[dict]:
        """Values of the non-linear parameters worth trying on residuals, (T, n) for every run.

        Like `grid`, but a kind that can search (a periodogram, windows of time) returns its best
        few. The search counts for `tests_of_grid` tests.
        """
        return cls.grid(robot, joints, signals)

    @classmethod
    def tests_of_grid(
        cls, robot: Robot, joints: tuple[int, ...], signals: Sequence[Signals]
    ) -> int:
        """How many independent tests the choice of the non-linear parameters stands for."""
        return len(cls.grid(robot, joints, signals))

    @property
    def place(self) -> Place:
        """Kind, joints, runs and column: effects that differ in shape only share it."""
        return Place(self.kind, self.joints, self.runs, self.covariate)

    @property
    def is_friction(self) -> bool:
        """Whether it follows the speed of a state by itself: no series, and no column of a log."""
        return "speed" in self.function_of and not (self.over_time or self.follows_covariate)

    def active(self, run: RunId) -> bool:
        """Whether the effect is present in `run`."""
        return not self.runs or run.is_among(self.runs)

    @classmethod
    def is_searched(cls) -> bool:
        """Whether its shapes are searched on what is left of a torque (`tuned`)."""
        return cls.tuned.__func__ is not Effect.tuned.__func__  # type: ignore[attr-defined]

    def rows(self, n: int) -> tuple[int, ...]:
        """Moved joints in whose torque it shows."""
        return tuple(range(n)) if self.in_all_rows else self.joints

    @abstractmethod
    def columns(self, signals: Signals) -> Array:
        """Torque per unit of every linear parameter, (T, len(rows), len(parameters))."""

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """Derivative of Σ weights ∘ columns; `weights` has the shape of `columns`."""
        raise NotImplementedError(f"{self.kind} cannot be excited: {self.why_not_excitable}")

    def torque(self, signals: Signals, values: Array) -> Array:
        """Torque (T, n) for given linear parameters."""
        tau = np.zeros_like(signals.q)
        if self.active(signals.run):
            tau[:, list(self.rows(signals.q.shape[1]))] = self.columns(signals) @ values
        return tau


def neighbours(robot: Robot) -> list[tuple[int, ...]]:
    """Pairs (j, k), j < k, of moved joints of which k is carried by j directly."""
    return [(parent, k) for k, parent in enumerate(robot.parents) if parent >= 0]
