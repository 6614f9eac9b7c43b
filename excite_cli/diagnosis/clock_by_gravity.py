"""A clock that is off, as gravity shows it where no speeds were recorded.

With a recorded second that lasts c seconds, speeds are v/c and accelerations a/c². Inertias,
friction of every kind and offsets adapt to that; what does not is g: the same masses that are
accelerated are weighed. So all inertias and friction are fitted to the torques for some c, and the
c that leaves least is told if it leaves far less than c = 1 does. Robots whose torque is friction
or weight alone do not show it, and large effects that are not in this model hide it.
"""

from collections.abc import Sequence

import numpy as np
from scipy.linalg import solve

from excite_cli.diagnosis.torque_shares import Samples
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.measurement.dataset import Finding, Run
from excite_cli.robot.model import Array, Robot

_TRIED = (0.85, 1.0, 1.18)  # c
_STEPS = 3  # by a parabola through three c, each time nearer
_OFF = 0.03  # |c − 1| from which it is told
_LESS = 0.6  # RMS of what is left, over that at c = 1
_FEWEST = 50  # instants of a joint
_RIDGE = 1e-9  # of the largest column: base parameters are a part of the standard ones


def check_clock(robot: Robot, runs: Sequence[Run], samples: Samples) -> tuple[Finding, ...]:
    """A warning where time stamps contradict gravity; `runs` with recorded speeds are not judged.

    `samples` are those of the runs, filtered.
    """
    if any(run.dq is not None for run in runs) or not samples.moves.any():
        return ()
    tried = {c: _left(robot, samples, c) for c in _TRIED}
    for _ in range(_STEPS):
        c = _lowest(tried)
        tried[c] = _left(robot, samples, c)
    best = min(tried, key=lambda c: tried[c])
    if abs(best - 1) < _OFF or tried[best] > _LESS * tried[1.0]:
        return ()
    text = (
        f"time and gravity contradict each other: with the stamps as they are, {tried[1.0]:.1%} of "
        f"the torque do not fit any inertias and friction; with {best:.3g} s in a recorded second "
        f"{tried[best]:.1%}. If the clock is off, write measurement.clock: {best:.3g}. If the data "
        "are right as they are, say so: measurement.trust: true"
    )
    return (Finding("clock", "warning", text),)


def _lowest(tried: dict[float, float]) -> float:
    """Where a parabola through the best c and its neighbours is lowest, within what was tried."""
    every = sorted(tried)
    at = int(np.clip(np.argmin([tried[c] for c in every]), 1, len(every) - 2))
    three = every[at - 1 : at + 2]
    bend, slope, _ = np.polyfit(np.log(three), [tried[c] ** 2 for c in three], 2)
    lowest = float(np.exp(-slope / (2 * bend))) if bend > 0 else three[1]
    return float(np.clip(lowest, three[0], three[-1]))


def _left(robot: Robot, samples: Samples, c: float) -> float:
    """Share of the torques, each over its own deviation, that inertias and friction leave at c."""
    v, a = samples.v / c, samples.a / c**2
    regressor = RigidBody(robot, standard_parameters(robot), samples.q, v, a).regressor
    blocks, torques = [], []
    for j in range(robot.n):
        rows = samples.moves[:, j] & samples.known[:, j]
        tau = samples.tau[rows, j]
        if len(tau) < _FEWEST or not np.ptp(tau):
            continue
        friction = np.zeros((len(tau), robot.n, 5))
        speed = v[rows, j]
        friction[:, j] = np.column_stack(
            [speed, np.sign(speed), np.cbrt(speed), a[rows, j], np.ones_like(speed)]
        )
        columns = np.hstack([regressor[rows, j], friction.reshape(len(tau), -1)])
        blocks.append(columns / tau.std())
        torques.append(tau / tau.std())
    return _rest(np.vstack(blocks), np.concatenate(torques)) if blocks else 0.0


def _rest(columns: Array, torque: Array) -> float:
    size = np.linalg.norm(columns, axis=0)
    columns = columns[:, size > 0] / size[size > 0]
    gram = columns.T @ columns
    gram[np.diag_indices(len(gram))] += _RIDGE
    rest = torque - columns @ solve(gram, columns.T @ torque, assume_a="pos")
    return float(np.linalg.norm(rest) / np.linalg.norm(torque))
