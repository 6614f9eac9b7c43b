"""What an effect is: torque that rigid bodies do not explain, linear in its parameters.

    tau_j = (Y φ)_j + Σ_e Σ_p columns_e[j, p] · θ_e,p

An effect acts on some joints (`joints`, indices of moved joints) and touches some rows (`rows`).
Its columns may depend on time, on q, v, a and, for friction that grows with load, gains and delays,
on the torque of the model found so far; its non-linear parameters (`shape`) are numbers chosen from
a grid. The same class serves planning (columns and their vector–Jacobian product,
`pull_back`), identification, diagnosis and simulation (torque for given values).

Beside its columns, an effect states what is known of it: by which rules a diagnosis names it, how
it gets into a simulated robot, and how it is drawn. No other part of the program asks for a kind by
its name.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from excite_cli.dynamics.nearest_inertias import half_of
from excite_cli.effects.abscissa import Abscissa, Quantity, of_one_joint
from excite_cli.effects.mjcf_parts import MjcfParts
from excite_cli.effects.parameter import Parameter, Value, deviation, unit_of_slider
from excite_cli.effects.place import Place
from excite_cli.effects.rare_sizes import nearest_of_sign, two_deviations, unlikely_distance
from excite_cli.effects.seen import Seen
from excite_cli.effects.signals import Cotangents, Signals
from excite_cli.effects.simulated_robot import JOINT_PARTS, SimulatedRobot
from excite_cli.measurement.run_identity import RunId
from excite_cli.robot.link_frame import LinkFrame
from excite_cli.robot.model import Array, Robot

Scope = Literal["joint", "pair", "robot", "base"]
Picture = Literal["cloud", "window"]

# By how much a shape parameter is changed, up and down, once its effect is found.
_FINER = (1.35, 1.15, 1.06, 1.02)


class Tier(IntEnum):
    """When a diagnosis asks for a kind; a later one may still replace an earlier one."""

    EVERY_ROBOT = 1
    MANY_ROBOTS = 2
    LAST = 3


@dataclass(frozen=True)
class Effect(ABC):
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
    # What of its own joints the torque is a function of: with a free function of it beside, nothing
    # of the effect would be left.
    function_of: ClassVar[tuple[Quantity, ...]] = ()
    defaults: ClassVar[Mapping[str, float]] = {}  # of `planted`, for what is not named
    per_run: ClassVar[bool] = False  # present in some runs only: looked for in each on its own
    can_appear_later: ClassVar[bool] = False  # from one day on a robot may have it, or more of it
    # In all runs, but its size may change from run to run: in runs of its own it is that change.
    changes_between_runs: ClassVar[bool] = False
    of_campaign: ClassVar[bool] = False  # its columns look at the campaign's clock
    # Looked for once for every declared column of the log; its grid sees signals with that alone.
    follows_covariate: ClassVar[bool] = False
    changes_of: ClassVar[tuple[str, ...]] = ()  # kinds whose size its parameters change, in order
    data_defect: ClassVar[bool] = False  # lies in the measurement, not in the robot
    # Its columns are the whole torque of the model: other effects of its joints are in them.
    of_whole_torque: ClassVar[bool] = False
    # What tells its size where inertias take it up, as a person may declare it.
    identified_by: ClassVar[str] = ""
    # A body that one joint carries: part of the load of joints, and named by its link if one likes.
    carried: ClassVar[bool] = False
    on_base: ClassVar[bool] = False  # rows of a measured base may have it, which have no gears
    # Its torque at an instant depends on the time, or on other instants: it needs a series.
    over_time: ClassVar[bool] = False
    excitable: ClassVar[bool] = True  # has columns for a planned motion, and `pull_back`
    why_not_excitable: ClassVar[str] = ""

    # How a diagnosis judges it. Surprise: χ² that it must save beyond what chance makes of all
    # tests, where two kinds explain the data about as well.
    prior_cost: ClassVar[float] = 4.0
    tier: ClassVar[Tier] = Tier.MANY_ROBOTS
    refines: ClassVar[tuple[str, ...]] = ()  # kinds of one joint that must be in before it
    excludes: ClassVar[tuple[str, ...]] = ()  # other forms of its cause: a place has one of them
    same_as: ClassVar[tuple[str, ...]] = ()  # kinds that together are the same columns
    # Kinds that are judged by the straight line through both: of themselves they may be nothing.
    deviates_from: ClassVar[tuple[str, ...]] = ()
    # Kinds of the same joint that it may be the change of over the angle: never more than is there.
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

    # Linear parameters that are its size, by name; empty: all of them together.
    size: ClassVar[tuple[str, ...]] = ()

    # In the simulated robot: the number that people know it by, if that is not the first linear
    # parameter; and settings of its mechanism that nobody identifies.
    known_by: ClassVar[str] = ""
    settings: ClassVar[Mapping[str, float]] = {}

    # How it is drawn: samples over `abscissa`, or the seconds in which it shows most.
    picture: ClassVar[Picture] = "cloud"

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

    def active(self, run: RunId) -> bool:
        """Whether the effect is present in `run`."""
        return not self.runs or run.is_among(self.runs)

    @property
    def is_change(self) -> bool:
        """Whether it is by how much something that all runs have is more, or less, in some."""
        return self.changes_between_runs and bool(self.runs)

    @property
    def builds_on(self) -> tuple[str, ...]:
        """Kinds of one joint that must be in before it: `refines`; of a change, its own kind."""
        every = self.is_change and self.tier == Tier.EVERY_ROBOT
        return (*self.refines, self.kind) if every else self.refines

    @classmethod
    def is_searched(cls) -> bool:
        """Whether its shapes are searched on what is left of a torque (`tuned`)."""
        return cls.tuned.__func__ is not Effect.tuned.__func__  # type: ignore[attr-defined]

    @property
    def asked_for(self) -> Tier:
        """Its tier; a change in some runs waits for what sets runs apart on many robots."""
        return max(self.tier, Tier.MANY_ROBOTS) if self.is_change else self.tier

    def rows(self, n: int) -> tuple[int, ...]:
        """Moved joints in whose torque it shows."""
        return self.joints

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

    @classmethod
    def exclusive_with(cls, other: type["Effect"]) -> bool:
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
        return steps_by_ratio(self.shape[name], _FINER)

    def compares_with(self, other: "Effect") -> bool:
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

    def abscissa(self, signals: Signals) -> Abscissa | None:
        """The quantity over which a person sees the effect; None: the torque it predicts.

        By default the one quantity of its one joint that it is a `function_of`.
        """
        if len(self.joints) != 1 or len(self.function_of) != 1:
            return None
        return of_one_joint(self.function_of[0], signals, self.joints[0])

    def seen_from(self, link: LinkFrame) -> Array:
        """Linear parameters in the frame of `link`: that matrix (p, p) times `values`."""
        return np.eye(len(self.parameters))

    def report(self, values: Array, covariance: Array) -> dict[str, Value]:
        """Named parameters as people know them, with standard deviations."""
        found = {
            p.name: Value(float(values[i]), deviation(np.eye(len(values))[i], covariance), p.unit)
            for i, p in enumerate(self.parameters)
        }
        for shape in self.shapes:
            if shape.name in self.shape:
                found[shape.name] = Value(float(self.shape[shape.name]), float("nan"), shape.unit)
        return found

    def report_on(
        self, sliding: NDArray[np.bool_], values: Array, covariance: Array
    ) -> dict[str, Value]:
        """`report` with the units of a robot whose moved joints slide, or do not (n,)."""
        return {
            name: replace(value, unit=self.unit_on(value.unit, sliding))
            for name, value in self.report(values, covariance).items()
        }

    def unit_on(self, unit: str, sliding: NDArray[np.bool_]) -> str:
        """A unit of its parameters on a robot whose moved joints slide, or do not (n,)."""
        of_joint = self.scope == "joint" and not self.carried
        return unit_of_slider(unit) if of_joint and sliding[self.joints[0]] else unit

    @classmethod
    def planted(cls, value: float, others: Mapping[str, float]) -> tuple[dict[str, float], Array]:
        """Shape and linear parameters for `value` of the first parameter and named `others`.

        What is not named takes its place in `defaults`; without one, the middle (geometric mean)
        of its usual range if it is a shape, zero if it is a linear parameter.
        """
        given = {**cls.defaults, **others}
        values = np.array([value, *(given.get(p.name, 0.0) for p in cls.parameters[1:])])
        shape = {
            p.name: float(given[p.name]) if p.name in given else float(np.sqrt(p.low * p.high))
            for p in cls.shapes
        }
        return shape, values

    def build_into(
        self, robot: SimulatedRobot, values: Array, numbers: Mapping[str, float]
    ) -> None:
        """Put the effect into a simulated robot.

        By default what MuJoCo's joint has a part for becomes that part, a defect of the data
        changes what is recorded, and all else acts through its own formula. `numbers` are all by
        name: linear parameters, shape and `settings`.
        """
        if self.data_defect:
            robot.falsify(self, values)
            return
        parts = self.mjcf(values)
        if parts and JOINT_PARTS.issuperset(parts) and len(self.joints) == 1:
            robot.add_to_joint(self.joints[0], parts)
        else:
            robot.apply(self, values)
        robot.tell_controller(self, values)

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """C statements that add its torque to `tau` (`c_code`); `columns` of the log by name.

        Empty: C has no such effect.
        """
        return ""

    def in_c_series(self, values: Array) -> str:
        """The same for a recorded series as a whole, where an instant alone tells too little.

        `count`, `step`, `q`, `v`, `a`, `load` (rows), `torque` to add to, and `spare` to work in.
        """
        return ""

    def urdf(self, values: Array) -> dict[str, float]:
        """Attributes of the URDF's <dynamics> that hold this effect; empty if none can."""
        return {}

    def mjcf(self, values: Array) -> dict[str, float]:
        """Attributes of MuJoCo's <joint> that hold this effect; empty if none can."""
        return {}

    def put_into_mjcf(self, parts: MjcfParts, values: Array) -> bool:
        """Add it to a MuJoCo model; false if that cannot hold it."""
        return len(self.joints) == 1 and parts.add(self.joints[0], self.mjcf(values))


def neighbours(robot: Robot) -> list[tuple[int, ...]]:
    """Pairs (j, k), j < k, of moved joints of which k is carried by j directly."""
    return [(parent, k) for k, parent in enumerate(robot.parents) if parent >= 0]


def steps_by_ratio(value: float, ratios: Sequence[float]) -> list[float]:
    """Changes of `value` by these ratios, all above one."""
    return [(ratio - 1.0) * value for ratio in ratios]
