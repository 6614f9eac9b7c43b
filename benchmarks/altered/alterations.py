"""What goes wrong between a robot and its file, and the key that says so.

An alteration takes the recordings as they should be to what the file holds; `keys` are those of
the measurement section with which the right answer must come back, if there are any.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.signal import lfilter

from excite_cli.dynamics.inverse_dynamics import InverseDynamics
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.robot.model import Array, Robot

Alter = Callable[[Dataset, Robot], Dataset]
Keys = Callable[[tuple[str, ...]], Mapping[str, Any]]


@dataclass(frozen=True)
class Alteration:
    """A mistake or a poor instrument; `told`: the kinds of findings of which one must name it.

    `several`: needs more than one run; `speeds`: needs recorded speeds.
    """

    alter: Alter
    told: tuple[str, ...] = ()
    keys: Keys = field(default=lambda names: {})
    several: bool = False
    speeds: bool = False


def _of_runs(change: Callable[[Run], Run]) -> Alter:
    return lambda data, robot: replace(data, runs=tuple(map(change, data.runs)))


def _exchanged(first: int, second: int, *channels: str) -> Alter:
    def alter(data: Dataset, robot: Robot) -> Dataset:
        order = np.arange(robot.n)
        order[[first, second]] = order[[second, first]]

        def change(run: Run) -> Run:
            kept = {name: getattr(run, name) for name in channels}
            return replace(run, **{k: None if x is None else x[:, order] for k, x in kept.items()})

        return _of_runs(change)(data, robot)

    return alter


def _names(first: int, second: int) -> Keys:
    return lambda names: {
        "names": {names[first % len(names)]: names[second % len(names)],
                  names[second % len(names)]: names[first % len(names)]}
    }  # fmt: skip


def _quantised(step: float) -> Alter:
    return _of_runs(lambda run: replace(run, tau=step * np.round(run.tau / step)))


def _clock(factor: float, speeds: bool) -> Alter:
    return _of_runs(lambda run: replace(run, t=run.t * factor, dq=run.dq if speeds else None))


def _slow_speeds(seconds: float) -> Alter:
    def change(run: Run) -> Run:
        keep = np.exp(-run.step / seconds)
        dq = np.gradient(run.q, run.step, axis=0)
        filtered = lfilter([1 - keep], [1, -keep], dq, axis=0, zi=keep * dq[:1])[0]
        return replace(run, dq=np.asarray(filtered))

    return _of_runs(change)


def _without_gravity(data: Dataset, robot: Robot) -> Dataset:
    dynamics = InverseDynamics(robot)

    def change(run: Run) -> Run:
        rest = np.zeros_like(run.q)
        return replace(run, tau=run.tau - dynamics.torques(run.q, rest, rest))

    return _of_runs(change)(data, robot)


def _scaled(factor: float, joint: int | None = None) -> Alter:
    def change(run: Run) -> Run:
        here = np.arange(run.tau.shape[1])
        one = np.where(here == joint, factor, 1.0) if joint is not None else factor
        return replace(run, tau=run.tau * one)

    return _of_runs(change)


def _constant(factor: float, joint: int | None = None) -> Keys:
    def keys(names: tuple[str, ...]) -> Mapping[str, Any]:
        chosen = {j: factor if joint in (None, k) else 1.0 for k, j in enumerate(names)}
        return {"torque": "current", "torque_constant": chosen}

    return keys


def _torque_of_another_run(data: Dataset, robot: Robot) -> Dataset:
    first, second = data.runs[:2]
    count = min(len(first.t), len(second.t))
    torques: tuple[Array, Array] = (second.tau[:count], first.tau[:count])
    runs = [replace(run.cut(0, count), tau=tau)
            for run, tau in zip((first, second), torques, strict=True)]  # fmt: skip
    return replace(data, runs=(runs[0], second, *data.runs[2:]))


def _rate(hertz: float) -> Alter:
    def change(run: Run) -> Run:
        stride = max(1, round(1 / (run.step * hertz)))
        dq = None if run.dq is None else run.dq[::stride]
        valid = None if run.valid is None else run.valid[::stride]
        return replace(run, t=run.t[::stride], q=run.q[::stride], dq=dq, tau=run.tau[::stride],
                       valid=valid, recorded=None)  # fmt: skip

    return _of_runs(change)


def _counted(per_turn: int) -> Alter:
    step = 2 * np.pi / per_turn
    return _of_runs(lambda run: replace(run, q=step * np.round(run.q / step), dq=None))


def _delayed(seconds: float) -> Alter:
    def change(run: Run) -> Run:
        tau = np.column_stack([np.interp(run.t - seconds, run.t, x) for x in run.tau.T])
        return replace(run, tau=tau)

    return _of_runs(change)


ALTERATIONS: dict[str, Alteration] = {
    "nothing": Alteration(_of_runs(lambda run: run)),
    "torques of 2 and 3 swapped": Alteration(_exchanged(1, 2, "tau"), ("implausible",)),
    "joints 2 and 3 exchanged": Alteration(
        _exchanged(1, 2, "q", "dq", "tau"), ("implausible",), _names(1, 2)),
    "last two joints exchanged": Alteration(
        _exchanged(-2, -1, "q", "dq", "tau"), ("implausible",), _names(-2, -1)),
    "torque in steps of 5": Alteration(_quantised(5.0), ("torque_steps",)),
    "torque in steps of 0.5": Alteration(_quantised(0.5)),
    "torque in steps of 0.05": Alteration(_quantised(0.05)),
    "clock 10 % slow": Alteration(
        _clock(0.9, True), ("clock",), lambda names: {"clock": 1 / 0.9}, speeds=True),
    "clock 10 % slow, no speeds": Alteration(
        _clock(0.9, False), ("clock",), lambda names: {"clock": 1 / 0.9}),
    "speeds lag by 0.05 s": Alteration(_slow_speeds(0.05), ("lag",), speeds=True),
    "speeds lag by 0.2 s": Alteration(_slow_speeds(0.2), ("lag",), speeds=True),
    "without gravity": Alteration(
        _without_gravity, ("no_gravity",), lambda names: {"gravity": "subtracted"}),
    "torque in mN·m": Alteration(_scaled(1e3), ("torque_scale",), _constant(1e-3)),
    "torque before gears of 100": Alteration(
        _scaled(1e-2), ("torque_scale",),
        lambda names: {"torque": "motor", "gear_ratio": dict.fromkeys(names, 100.0)}),
    "joint 2 in mN·m": Alteration(_scaled(1e3, 1), ("torque_scale",), _constant(1e-3, 1)),
    "joint 3 before its gear": Alteration(_scaled(1e-2, 2), ("torque_scale",), _constant(100.0, 2)),
    "joint 2 in per cent of 300": Alteration(_scaled(1 / 3, 1), (), _constant(3.0, 1)),
    "torque of another run": Alteration(
        _torque_of_another_run, ("implausible", "foreign_torque"), several=True),
    "10 Hz": Alteration(_rate(10.0), ("slow_rate",)),
    "20 Hz": Alteration(_rate(20.0)),
    "4096 counts a turn": Alteration(_counted(4096), ("coarse_positions",)),
    "torque late by 20 ms": Alteration(_delayed(0.02)),
}  # fmt: skip
