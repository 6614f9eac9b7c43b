"""The motion about which a start is drawn: standing at a clear posture, or going from end to end.

Where postures are given they stay as they are. The straight motion between them is taken if it is
admissible, then the nearest admissible one to first order. Otherwise a path around is searched, run
through with the same profile of time, and projected onto the family of trajectories:

    min over x  Σ_t |q_x(t) − way(s(t))|² + λ Σ_t |a_x(t)|² T⁴

for a falling weight λ of smoothness.
"""

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import nnls

from excite_cli.arrays import Mask as Mask
from excite_cli.constraints.base import Array
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.errors import NoAdmissibleMotionError
from excite_cli.excitation.boundary import straight_motion
from excite_cli.excitation.path_search import at_length, find_way, lengths, standing_margins
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.start import Start, blocking, clear_posture
from excite_cli.excitation.task import MotionTask

# The least change of a motion that repairs its broken residuals to first order.
#
# Rows that need repair are few: the dips in time of residuals near zero. The shortest change that
# lifts them, in the metric of the task, is a least-distance problem (Lawson and Hanson 1974).

_ROUNDS = 10
# Least residual aimed at, and the residual below which a dip is repaired.
_AIM, _NEAR = 1e-4, 0.05


def corrected(task: MotionTask, x: Array, aim: float = _AIM, enough: float = 0.0) -> Array | None:
    """x with the least corrections, in the metric of the task, that repair linearised residuals.

    `aim` is the residual wanted of the rows that are repaired. None where some stay below `enough`;
    rows that no change of x can repair (given ends) need only be positive.
    """
    factor = np.linalg.cholesky(
        task.metric + 1e-9 * np.trace(task.metric) / task.size * np.eye(task.size)
    )
    near_below = max(_NEAR, 2.0 * aim)
    given = np.isclose(np.abs(task.residuals.grid.orders[0]).max(axis=1), 0.0, atol=1e-9)
    chosen: list[Mask] | None = None
    for _ in range(_ROUNDS):
        states = task.states(x)
        values = task.values(states)
        if lowest(values) > 0 and lowest([value[~given] for value in values]) > enough:
            return x
        near = [(value < near_below) & dips(value) & ~given[:, None] for value in values]
        chosen = [a | b for a, b in zip(chosen or near, near, strict=True)]
        rows = chosen_rows(task, states, chosen)
        scaled = solve_triangular(factor, rows.T, lower=True).T
        correction = least_distance(scaled, aim - gathered(values, chosen))
        if correction is None:
            return None
        x = x + solve_triangular(factor, correction, lower=True, trans="T")
        aim *= 1.5
    return None


def least_distance(rows: Array, bounds: Array) -> Array | None:
    """The shortest y with rows·y ≥ bounds; None if there is none.

    Dual of a non-negative least-squares problem (Lawson and Hanson 1974, algorithm LDP), so it
    needs no library for quadratic programs.
    """
    system = np.vstack([rows.T, bounds])
    target = np.append(np.zeros(rows.shape[1]), 1.0)
    try:
        weights, _ = nnls(system, target)
    except RuntimeError:  # its iteration limit
        return None
    residual = system @ weights - target
    if residual[-1] > -1e-12:
        return None
    return np.asarray(-residual[:-1] / residual[-1])


def chosen_rows(task: MotionTask, states: States, chosen: list[Mask]) -> Array:
    """Derivatives (K, size) of the residuals where `chosen` (T, m), in the order of `gathered`."""
    orders, blocks = task.residuals.grid.orders, [np.zeros((0, task.size))]
    for index, mask in enumerate(chosen):
        rows = task.residuals.rows(states, index, mask)
        block = np.zeros((len(rows.times), task.n, task.k))
        for part, order in zip(rows.parts, orders, strict=False):
            if part is not None:
                block += part[:, :, None] * order[rows.times][:, None, :]
        blocks.append(block.reshape(len(rows.times), task.size))
    return np.vstack(blocks)


def gathered(values: list[Array], chosen: list[Mask]) -> Array:
    """The chosen entries of all constraints in one vector."""
    picked = [value[mask] for value, mask in zip(values, chosen, strict=True)]
    return np.concatenate([np.zeros(0), *picked])


def dips(value: Array) -> Mask:
    """Where each column of (T, m) is not above its neighbours in time."""
    padded = np.pad(value, ((1, 1), (0, 0)), constant_values=np.inf)
    return np.asarray((value <= padded[:-2]) & (value <= padded[2:]))


def lowest(values: list[Array]) -> float:
    """The smallest residual of all."""
    return min((float(value.min()) for value in values), default=np.inf)


_SMOOTHNESS = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 0.0)
_WAYS = 3
_INSTANTS_PER_FUNCTION = 12
# Residual that corrections aim at, so that random motions have room, first much, then little.
_AIMS = (0.05, 0.01, 1e-3)
_SHARE_OF_AIM = 0.6
_MENDED = 2
_INSTANTS = 400


def base_motion(task: MotionTask, seed: int) -> Start:
    """A motion with room around it that starts and ends where the config wants it to.

    Raises
    ------
    NoAdmissibleMotionError
        A given posture breaks a constraint, or no admissible way between the postures was found.
    """
    boundary = task.problem.boundary
    if not boundary.given:
        return clear_posture(task, seed)
    start = boundary.start if boundary.start is not None else boundary.end
    end = boundary.end if boundary.end is not None else boundary.start
    assert start is not None
    assert end is not None
    require_clear(task.problem, start, "trajectory.start")
    require_clear(task.problem, end, "trajectory.end")
    straight = np.zeros(task.size)
    if _room(task, straight) > 0:
        return Start(straight, start, True)
    broken = _broken_in_motion(task, straight)
    block = straight_block(task.problem, start, end)
    if block is None:
        found = _mended(task, straight)
        if found is not None:
            return Start(found, start, True)
        raise NoAdmissibleMotionError(
            f"No admissible motion from trajectory.start to trajectory.end: {broken} does not "
            f"allow it within {task.problem.trajectory.duration:g} s, although every posture on "
            "the straight path is clear. Take a longer trajectory.duration."
        )
    found = _way_round(task, start, end, seed, block)
    note = (
        f"the straight path from start to end is blocked ({block}); "
        "the search began on a path around"
    )
    return Start(found, start, True, note)


def require_clear(problem: Problem, posture: Array, name: str) -> None:
    """Raise NoAdmissibleMotionError if standing at the `posture` (n,) breaks a constraint."""
    found = []
    margins = standing_margins(problem, posture[None])
    for constraint, margin in zip(problem.constraints, margins, strict=True):
        for column in np.flatnonzero(margin[0] <= 0).tolist():
            share = float(margin[0, column] / constraint.scale[column])
            amount = f"{-margin[0, column]:.3g} {constraint.unit_of(column)}"
            words = f"{constraint.name} ({constraint.labels[column]}) by {amount}"
            found.append((share, words))
    if not found:
        return
    found.sort()
    more = f" and {len(found) - 3} more" if len(found) > 3 else ""
    raise NoAdmissibleMotionError(
        f"{name}: standing there breaks {'; '.join(words for _, words in found[:3])}{more}. A "
        "posture that is given is not moved: give one that keeps all constraints, or loosen them."
    )


def straight_block(problem: Problem, start: Array, end: Array) -> str | None:
    """What first blocks the straight path, and where; None if all postures on it are clear."""
    shares = np.linspace(0.0, 1.0, _INSTANTS + 1)
    postures = start + shares[:, None] * (end - start)
    first, words = _INSTANTS + 1, ""
    margins = standing_margins(problem, postures)
    for constraint, margin in zip(problem.constraints, margins, strict=True):
        broken = np.flatnonzero((margin < 0).any(axis=1))
        if len(broken) and broken[0] < first:
            first = int(broken[0])
            inside = margin[broken] / constraint.scale
            column = int(np.argmin(inside[0]))
            last = shares[broken[-1]]
            words = (
                f"{constraint.name}, {constraint.labels[column]}, from {100 * shares[first]:.0f} % "
                f"to {100 * last:.0f} % of the way"
            )
    return words or None


def _way_round(task: MotionTask, start: Array, end: Array, seed: int, block: str) -> Array:
    """Free variables of an admissible motion that follows a path around what is in between."""
    for attempt in range(_WAYS):
        search = find_way(task.problem, start, end, seed + 1000 * attempt)
        if search.way is None:
            words = disconnected(block, search.reached)
            raise NoAdmissibleMotionError(f"trajectory.start, end: {words}")
        tried = [_projected(task, search.way, weight) for weight in _SMOOTHNESS]
        tried.sort(key=lambda x: -_room(task, x))
        if _room(task, tried[0]) > _AIMS[0]:
            return tried[0]
        mended = [x for x in (_mended(task, x) for x in tried[:_MENDED]) if x is not None]
        if mended:
            return max(mended, key=lambda x: _room(task, x))
    broken = _broken_in_motion(task, tried[0])
    raise NoAdmissibleMotionError(
        "No admissible motion from trajectory.start to trajectory.end: the straight path is "
        f"blocked ({block}). A path around it exists, but no motion of this "
        f"trajectory follows it closely enough; {broken} prevents it. Take a longer "
        "trajectory.duration, or more control_points."
    )


def disconnected(block: str, reached: str) -> str:
    """The message that no path was found between two postures."""
    return (
        "no admissible path from the start to the end was found. The straight path is blocked "
        f"({block}), and a search for a path around did not get through: {reached}. The postures "
        "may be disconnected. Give other postures, or loosen that constraint."
    )


def _projected(task: MotionTask, way: Array, weight: float) -> Array:
    """Free variables of the motion nearest to running through `way` (m, n)."""
    trajectory = task.problem.trajectory
    count = _INSTANTS_PER_FUNCTION * trajectory.n_coefficients
    basis = trajectory.basis(np.linspace(0.0, trajectory.duration, count))
    along = lengths(task.problem, way)
    share = basis.position @ straight_motion(trajectory, np.zeros(1), np.ones(1))
    wanted = at_length(way, along, np.clip(share[:, 0], 0.0, 1.0) * along[-1])
    bend = np.sqrt(weight) * trajectory.duration**2 * basis.acceleration
    rows = np.vstack([basis.position, bend])
    target = np.vstack([wanted, np.zeros_like(wanted)]) - rows @ task.offset
    found = np.linalg.lstsq(rows @ task.free, target, rcond=None)[0]
    return task.flat(np.asarray(found))


def _room(task: MotionTask, x: Array) -> float:
    return lowest(task.values(task.states(x)))


def _mended(task: MotionTask, x: Array) -> Array | None:
    """The nearest motion to first order with the most room that can be had; None if with none."""
    for aim in _AIMS:
        found = corrected(task, x, aim, enough=_SHARE_OF_AIM * aim)
        if found is not None:
            return found
    return x if _room(task, x) > 0 else None


def _broken_in_motion(task: MotionTask, x: Array) -> str:
    return blocking(task, task.values(task.states(x)))
