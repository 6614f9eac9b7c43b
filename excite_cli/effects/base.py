"""What an effect is: torque that rigid bodies do not explain, linear in its parameters.

    tau_j = (Y φ)_j + Σ_e Σ_p columns_e[j, p] · θ_e,p

An effect acts on some joints (`joints`, indices of moved joints) and touches some rows (`rows`).
Its columns may depend on time, on q, v, a and, for friction that grows with load, gains and delays,
on the torque of the model found so far; its non-linear parameters (`shape`) are numbers chosen from
a grid. The same class serves planning (columns and their pull-back), identification, diagnosis and
simulation (torque for given values).
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np

from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.measurement.run_identity import RunId
from excite_cli.robot.model import Array, Robot

Scope = Literal["joint", "pair", "robot"]
Quantity = Literal["position", "speed", "acceleration", "load", "time"]


@dataclass(frozen=True)
class Signals:
    """What an effect may look at: one run, or one planned motion, at equidistant instants.

    `t` (T,) from the start of the run [s]; `q, v, a` (T, n); `load` (T, n) rigid-body torque of
    the model so far, `torque` (T, n) all of it with the effects found; `body` gives the derivatives
    of the rigid-body torque.
    """

    t: Array
    q: Array
    v: Array
    a: Array
    load: Array
    torque: Array
    body: RigidBody
    run: RunId = field(default_factory=RunId)

    def rate(self, x: Array) -> Array:
        """dx/dt by central differences along the first axis."""
        if len(self.t) < 3:
            return np.zeros_like(x)
        return np.gradient(x, float(self.t[1] - self.t[0]), axis=0)

    def rate_back(self, w: Array) -> Array:
        """The transpose of `rate`: the cotangent of x for a cotangent w of dx/dt."""
        if len(self.t) < 3:
            return np.zeros_like(w)
        h = float(self.t[1] - self.t[0])
        back = np.zeros_like(w)
        back[2:] += w[1:-1] / (2 * h)
        back[:-2] -= w[1:-1] / (2 * h)
        back[1] += w[0] / h
        back[0] -= w[0] / h
        back[-1] += w[-1] / h
        back[-2] -= w[-1] / h
        return back

    def only(self, joint: int, x: Array) -> Array:
        """Zeros (T, n) with x (T,) in the column of `joint`."""
        full = np.zeros_like(self.q)
        full[:, joint] = x
        return full


@dataclass
class Cotangents:
    """Derivatives of a scalar with respect to what columns depend on, each (T, n) or None.

    `regressor` is (T, n, 10·n_bodies), for effects whose columns are entries of Y.
    """

    q: Array | None = None
    v: Array | None = None
    a: Array | None = None
    load: Array | None = None
    torque: Array | None = None
    regressor: Array | None = None


@dataclass(frozen=True)
class Parameter:
    """A parameter: name, unit, and the range of sizes that is usual for a robot arm."""

    name: str
    unit: str
    low: float
    high: float
    nonnegative: bool = False


@dataclass(frozen=True)
class Value:
    """A parameter's value with its standard deviation and unit."""

    value: float
    std: float
    unit: str


@dataclass(frozen=True)
class Abscissa:
    """What the torque of an effect is drawn over: `values` (T,) in `unit`, and their name.

    Values that lie a `period` apart are the same place, if there is one.
    """

    name: str
    unit: str
    values: Array
    period: float | None = None


# Of one joint: name, unit, and where `Signals` has it.
_DRAWN_OVER: Mapping[Quantity, tuple[str, str, str]] = {
    "position": ("angle", "rad", "q"),
    "speed": ("speed", "rad/s", "v"),
    "acceleration": ("acceleration", "rad/s²", "a"),
    "load": ("rigid-body torque", "N·m", "load"),
}


@dataclass(frozen=True)
class Effect(ABC):
    """An effect on given joints with given shape (values of its non-linear parameters).

    `runs`: the recordings, or stretches of them, in which it is present; empty means all.
    """

    joints: tuple[int, ...]
    shape: Mapping[str, float] = field(default_factory=dict)
    runs: tuple[str, ...] = ()

    kind: ClassVar[str]
    title: ClassVar[str]
    signature: ClassVar[str]
    scope: ClassVar[Scope] = "joint"
    parameters: ClassVar[tuple[Parameter, ...]]
    shapes: ClassVar[tuple[Parameter, ...]] = ()
    # What of its own joints the torque is a function of: with a free function of it beside, nothing
    # of the effect would be left.
    function_of: ClassVar[tuple[Quantity, ...]] = ()
    simpler_than: ClassVar[tuple[str, ...]] = ()  # kinds that contain this one
    defaults: ClassVar[Mapping[str, float]] = {}  # of `planted`, for what is not named
    per_run: ClassVar[bool] = False  # present in some runs only: looked for in each on its own
    data_defect: ClassVar[bool] = False  # lies in the measurement, not in the robot
    excitable: ClassVar[bool] = True  # has columns for a planned motion, with a pull-back
    why_not_excitable: ClassVar[str] = ""

    @classmethod
    def places(cls, robot: Robot) -> list[tuple[int, ...]]:
        """The sets of joints on which this kind is looked for."""
        if cls.scope == "joint":
            return [(j,) for j in range(robot.n)]
        if cls.scope == "pair":
            return neighbours(robot)
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

    def active(self, run: RunId) -> bool:
        """Whether the effect is present in `run`."""
        return not self.runs or run.is_among(self.runs)

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

    def abscissa(self, signals: Signals) -> Abscissa | None:
        """The quantity over which a person sees the effect; None: the torque it predicts.

        By default the one quantity of its one joint that it is a `function_of`.
        """
        if len(self.joints) != 1 or len(self.function_of) != 1:
            return None
        if self.function_of[0] not in _DRAWN_OVER:
            return None
        name, unit, series = _DRAWN_OVER[self.function_of[0]]
        return Abscissa(name, unit, getattr(signals, series)[:, self.joints[0]])

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

    def urdf(self, values: Array) -> dict[str, float]:
        """Attributes of the URDF's <dynamics> that hold this effect; empty if none can."""
        return {}

    def mjcf(self, values: Array) -> dict[str, float]:
        """Attributes of MuJoCo's <joint> that hold this effect; empty if none can."""
        return {}


def neighbours(robot: Robot) -> list[tuple[int, ...]]:
    """Pairs (j, k), j < k, of moved joints of which k is carried by j directly."""
    first = int(robot.model.njoints) - robot.n
    parents = [int(robot.model.parents[first + k]) - first for k in range(robot.n)]
    return [(parent, k) for k, parent in enumerate(parents) if parent >= 0]


def deviation(slope: Array, covariance: Array) -> float:
    """Standard deviation of a function of the parameters with this derivative, to first order."""
    return float(np.sqrt(max(float(slope @ covariance @ slope), 0.0)))
