"""What people set up wrongly, with sizes drawn at random, and what is asked of `excite inspect`.

Decided before the program is run: the row that must have a doubt or fault (or, of what is repaired,
a word), the joints that it must name, the key of the config that it must give. What the plain fit
of the textbook's model does not notice either (its error rises by less than a twentieth) may go
untold.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from excite_cli.api.loading import Case
from excite_cli.dynamics.regressor import InverseDynamics
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.robot.model import Array, Robot

UNITS, NAMES_ROW = "units of positions and time", "names of columns"


@dataclass(frozen=True)
class Altered:
    """Data as a file has them; `rows` of which one must tell, its `joints`, the `key`.

    `robot`: further keys of the config's robot. `told`: a word suffices, since it is repaired.
    `run`: what is not of this robot. `also`: rows that are right, too. `unknown`: the data do not
    say what would settle it.
    """

    data: Dataset
    rows: tuple[str, ...] = ()
    joints: tuple[str, ...] = ()
    key: str = ""
    robot: dict[str, Any] = field(default_factory=dict)
    told: bool = False
    run: str = ""
    also: tuple[str, ...] = ()
    unknown: bool = False


Mistake = Callable[[Dataset, Case, np.random.Generator], Altered]


def _runs(data: Dataset, change: Callable[[Run], Run]) -> Dataset:
    return replace(data, runs=tuple(map(change, data.runs)))


def _moving(data: Dataset, robot: Robot) -> list[int]:
    """Joints that turn, and move."""
    span = np.max([np.ptp(run.q, axis=0) for run in data.runs], axis=0)
    return [j for j in range(robot.n) if span[j] > 0.3 and not robot.sliding[j]]


def _one(data: Dataset, case: Case, rng: np.random.Generator) -> int:
    return int(rng.choice(_moving(data, case.robot)))


def _turned(angle: Callable[[np.random.Generator], float]) -> Mistake:
    def make(data: Dataset, case: Case, rng: np.random.Generator) -> Altered:
        around = rng.uniform(0, 2 * np.pi)
        turn = Rotation.from_rotvec(angle(rng) * np.array([np.cos(around), np.sin(around), 0.0]))
        angles = [float(x) for x in turn.as_euler("xyz")]
        key = "robot.base_orientation"
        return Altered(data, ("direction of gravity",), (), key, {"base_orientation": angles})

    return make


def _zero(angle: Callable[[np.random.Generator], float]) -> Mistake:
    def make(data: Dataset, case: Case, rng: np.random.Generator) -> Altered:
        j, off = _one(data, case, rng), angle(rng)
        shifted = _runs(data, lambda run: replace(run, q=run.q + off * _at(run, j)))
        joints = (case.robot.joint_names[j],)
        return Altered(shifted, ("zero of every joint",), joints, "measurement.offset")

    return make


def _at(run: Run, j: int) -> Array:
    return np.asarray(np.arange(run.q.shape[1]) == j, float)


def _sign(channel: str, every: bool) -> Mistake:
    row = "signs of positions" if channel == "q" else "signs of torques"
    key = "measurement.position_sign" if channel == "q" else "measurement.sign"

    def make(data: Dataset, case: Case, rng: np.random.Generator) -> Altered:
        j, names = _one(data, case, rng), case.robot.joint_names

        def change(run: Run) -> Run:
            sign = -np.ones(len(names)) if every else 1.0 - 2.0 * _at(run, j)
            dq = None if run.dq is None or channel == "tau" else run.dq * sign
            own: dict[str, Any] = {channel: getattr(run, channel) * sign}
            return replace(run, dq=dq, **own) if channel == "q" else replace(run, **own)

        joints = () if every else (names[j],)
        both = ("signs of positions", "signs of torques")
        return Altered(_runs(data, change), (row, *both), joints, key)

    return make


def _order(channels: tuple[str, ...], kind: str) -> Mistake:
    def make(data: Dataset, case: Case, rng: np.random.Generator) -> Altered:
        n, names = case.robot.n, case.robot.joint_names
        order = np.arange(n)
        if kind == "two":
            j, k = rng.choice(_moving(data, case.robot), 2, replace=False)
            order[[j, k]] = order[[k, j]]
        else:
            order = np.roll(order, 1) if kind == "shift" else order[::-1].copy()

        def change(run: Run) -> Run:
            own = {c: getattr(run, c)[:, order] for c in channels if getattr(run, c) is not None}
            return replace(run, **own)

        joints = tuple(names[j] for j in range(n) if order[j] != j)
        key = "measurement.names" if "q" in channels and "tau" in channels else ""
        return Altered(_runs(data, change), ("order of columns", NAMES_ROW), joints, key)

    return make


def _scaled(factor: Callable[[np.random.Generator], float], every: bool) -> Mistake:
    def make(data: Dataset, case: Case, rng: np.random.Generator) -> Altered:
        j, by = _one(data, case, rng), factor(rng)
        whole = 1.0 if every else 0.0
        scaled = _runs(data, lambda r: replace(r, tau=r.tau * by ** np.maximum(_at(r, j), whole)))
        joints = () if every else (case.robot.joint_names[j],)
        return Altered(scaled, ("unit of torques",), joints, "measurement.torque_unit")

    return make


def _in_units(angle: float, speed: float, key: str) -> Mistake:
    def make(data: Dataset, case: Case, rng: np.random.Generator) -> Altered:
        def change(run: Run) -> Run:
            speeds = np.gradient(run.q, run.step, axis=0) if run.dq is None else run.dq
            return replace(run, q=run.q * angle, dq=speeds * speed if speed else None)

        # The fewest bits with which counts keep the limits are a first guess.
        also = ("unit of positions",) * (key == "measurement.angle")
        rows = (UNITS, "limits of the joints")
        return Altered(_runs(data, change), rows, (), key, also=also)

    return make


def _one_in_degrees(data: Dataset, case: Case, rng: np.random.Generator) -> Altered:
    """Of one joint alone, without recorded speeds."""
    j = _one(data, case, rng)
    by = lambda run: np.where(_at(run, j) > 0, _DEG, 1.0)  # noqa: E731
    changed = _runs(data, lambda run: replace(run, q=run.q * by(run), dq=None))
    joints = () if case.robot.n == 1 else (case.robot.joint_names[j],)
    return Altered(changed, (UNITS, "unit of positions"), joints, "measurement.angle")


def _numbered(speeds: bool) -> Mistake:
    """Stamps that count samples; without recorded speeds nobody knows what a sample lasts."""

    def make(data: Dataset, case: Case, rng: np.random.Generator) -> Altered:
        def change(run: Run) -> Run:
            dq = np.gradient(run.q, run.step, axis=0) if run.dq is None else run.dq
            numbers = np.round((run.t - run.t[0]) / run.step)
            return replace(run, t=numbers, dq=dq if speeds else None, epoch=None)

        key = "measurement.clock" if speeds else ""
        return Altered(_runs(data, change), (UNITS, "clock"), (), key, unknown=not speeds)

    return make


def _time(unit: float, key: str) -> Mistake:
    return lambda data, case, rng: Altered(
        _runs(data, lambda run: replace(run, t=run.t * unit, epoch=None)), (UNITS,), (), key
    )


def _clock(factor: Callable[[np.random.Generator], float], speeds: bool) -> Mistake:
    def make(data: Dataset, case: Case, rng: np.random.Generator) -> Altered:
        by = factor(rng)

        def change(run: Run) -> Run:
            dq = (
                (np.gradient(run.q, run.step, axis=0) if run.dq is None else run.dq)
                if speeds
                else None
            )
            return replace(run, t=run.t * by, dq=dq)

        return Altered(_runs(data, change), ("clock", UNITS), (), "measurement.clock")

    return make


def _late(seconds: Callable[[np.random.Generator], float]) -> Mistake:
    def make(data: Dataset, case: Case, rng: np.random.Generator) -> Altered:
        late = seconds(rng)

        def change(run: Run) -> Run:
            tau = [np.interp(run.t - late, run.t, x) for x in run.tau.T]
            return replace(run, tau=np.column_stack(tau))

        row = "torques and positions at one time"
        return Altered(_runs(data, change), (row,), (), "measurement.torque_lag")

    return make


def _weightless(data: Dataset, case: Case, rng: np.random.Generator) -> Altered:
    dynamics = InverseDynamics(case.robot)

    def change(run: Run) -> Run:
        rest = np.zeros_like(run.q)
        return replace(run, tau=run.tau - dynamics.torques(run.q, rest, rest))

    return Altered(_runs(data, change), ("weight in the torques",), (), "measurement.gravity")


def _wrapped(low: float) -> Mistake:
    def make(data: Dataset, case: Case, rng: np.random.Generator) -> Altered:
        j = _one(data, case, rng)
        middle = np.mean([run.q[:, j].mean() for run in data.runs])

        def change(run: Run) -> Run:
            q = run.q.copy()
            turned = q[:, j] - middle + low  # the wrap lies in the middle of the motion
            q[:, j] = (turned - low) % (2 * np.pi) + low
            return replace(run, q=q, dq=None)

        # Its zero is another one, too.
        wrapped = _runs(data, change)
        return Altered(
            wrapped, ("angles of one turn",), (), told=True, also=("zero of every joint",)
        )

    return make


def _stale(data: Dataset, case: Case, rng: np.random.Generator) -> Altered:
    def change(run: Run) -> Run:
        held = rng.random(len(run.t)) < 0.05
        fresh = np.maximum.accumulate(np.where(held, 0, np.arange(len(run.t))))
        dq = None if run.dq is None else run.dq[fresh]
        return replace(run, q=run.q[fresh], tau=run.tau[fresh], dq=dq)

    row = "values that are missing or held"
    return Altered(_runs(data, change), (row,), (), told=True)


def _gaps(data: Dataset, case: Case, rng: np.random.Generator) -> Altered:
    def change(run: Run) -> Run:
        at = rng.uniform(0.3, 0.6) * run.duration + run.t[0]
        later = np.where(run.t > at, 2.0, 0.0) + np.where(run.t > at + 0.9, 2.0, 0.0)
        return replace(run, t=run.t + later)

    return Altered(_runs(data, change), ("time stamps and gaps",), (), told=True)


def _foreign(data: Dataset, case: Case, rng: np.random.Generator) -> Altered:
    if len(data.runs) < 3:
        return Altered(data)
    first, second = data.runs[:2]
    count = min(len(first.t), len(second.t))
    own = replace(first.cut(0, count), tau=second.tau[:count])
    mixed = replace(data, runs=(own, *data.runs[1:]))
    return Altered(mixed, ("runs of this robot",), run=first.name)


def _filtered(data: Dataset, case: Case, rng: np.random.Generator) -> Altered:
    seconds = rng.uniform(0.05, 0.2)

    def change(run: Run) -> Run:
        keep = np.exp(-run.step / seconds)
        dq = np.gradient(run.q, run.step, axis=0)
        late = lfilter([1 - keep], [1, -keep], dq, axis=0, zi=keep * dq[:1])[0]
        return replace(run, dq=np.asarray(late))

    return Altered(_runs(data, change), (UNITS,), (), told=True)


def _dead(data: Dataset, case: Case, rng: np.random.Generator) -> Altered:
    j = _one(data, case, rng)
    dead = _runs(data, lambda run: replace(run, tau=run.tau * (1.0 - _at(run, j))))
    return Altered(dead, ("values that are missing or held",), (case.robot.joint_names[j],))


_DEG, _RPM = 180 / np.pi, 30 / np.pi
MISTAKES: dict[str, Mistake] = {
    "wall": _turned(lambda rng: np.pi / 2),
    "ceiling": _turned(lambda rng: np.pi),
    "45°": _turned(lambda rng: np.pi / 4),
    "leaning": _turned(lambda rng: np.radians(rng.uniform(10, 20))),
    "zero +90°": _zero(lambda rng: np.pi / 2),
    "zero -90°": _zero(lambda rng: -np.pi / 2),
    "zero 180°": _zero(lambda rng: np.pi),
    "zero free": _zero(lambda rng: float(rng.choice([-1, 1]) * np.radians(rng.uniform(20, 80)))),
    "position turned": _sign("q", every=False),
    "all positions turned": _sign("q", every=True),
    "torque turned": _sign("tau", every=False),
    "all torques turned": _sign("tau", every=True),
    "columns swapped": _order(("q", "dq", "tau"), "two"),
    "torques swapped": _order(("tau",), "two"),
    "positions swapped": _order(("q", "dq"), "two"),
    "columns shifted": _order(("q", "dq", "tau"), "shift"),
    "torques reversed": _order(("tau",), "reversed"),
    "torques shifted": _order(("tau",), "shift"),
    "degrees": _in_units(_DEG, 0.0, "measurement.angle"),
    "degrees, deg/s": _in_units(_DEG, _DEG, "measurement.angle"),
    "degrees, rad/s": _in_units(_DEG, 1.0, "measurement.angle"),
    "deg/s": _in_units(1.0, _DEG, "measurement.channels"),
    "rpm": _in_units(1.0, _RPM, "measurement.channels"),
    "counts": _in_units(4096 / (2 * np.pi), 0.0, "measurement.angle"),
    "counts of 2^17": _in_units(2**17 / (2 * np.pi), 0.0, "measurement.angle"),
    "one in degrees": _one_in_degrees,
    "sample numbers": _numbered(speeds=False),
    "sample numbers, speeds": _numbered(speeds=True),
    "ms": _time(1e3, "measurement.time"),
    "µs": _time(1e6, "measurement.time"),
    "ns": _time(1e9, "measurement.time"),
    "clock slow": _clock(lambda rng: rng.uniform(0.7, 0.85), speeds=False),
    "clock fast": _clock(lambda rng: rng.uniform(1.2, 1.4), speeds=False),
    "clock slow, speeds": _clock(lambda rng: rng.uniform(0.6, 0.75), speeds=True),
    "mN·m": _scaled(lambda rng: 1e3, every=True),
    "N·cm": _scaled(lambda rng: 1e2, every=True),
    "A": _scaled(lambda rng: 1 / rng.uniform(8, 20), every=True),
    "before gears": _scaled(lambda rng: 1 / rng.uniform(80, 160), every=True),
    "‰": _scaled(lambda rng: 1000 / rng.uniform(20, 80), every=True),
    "one in mN·m": _scaled(lambda rng: 1e3, every=False),
    "one before its gear": _scaled(lambda rng: 1 / rng.uniform(80, 160), every=False),
    "without gravity": _weightless,
    "torque late": _late(lambda rng: rng.uniform(0.03, 0.08)),
    "torque early": _late(lambda rng: -rng.uniform(0.03, 0.08)),
    "wrapped at ±π": _wrapped(-np.pi),
    "wrapped at 0 and 2π": _wrapped(0.0),
    "stale samples": _stale,
    "gaps and a short piece": _gaps,
    "torque of another run": _foreign,
    "filtered speeds": _filtered,
    "a dead torque": _dead,
}
