"""Admissible starts by construction: a small motion about a clear posture.

The posture of the config is taken if it is clear; otherwise the nearest clear one is sought by
maximising the smallest residual of standing still. About it a random motion with amplitudes
falling as 1/k is shrunk until every residual is clear.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import lstsq, solve_triangular
from scipy.optimize import minimize

from excite_cli.constraints.base import Array, Constraint
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.errors import NoAdmissibleMotionError
from excite_cli.excitation.task import MotionTask
from excite_cli.trajectory.fade import Segment

# Residuals a start must have: inside, so that a barrier is finite, yet little is given away.
_CLEAR_POSTURE, _CLEAR_MOTION = 0.03, 0.02
# What a motion must keep of the room that its base has, where that is less.
_SHARE_OF_ROOM = 2 / 3
_SHRINK, _SMALLEST = 0.7, 1e-4
_TRIES = 40
# Columns whose residual is beyond this do not bind a posture.
_FAR, _WITHIN = 1.0, 4.0
_TOLD = 8


class NoClearPostureError(NoAdmissibleMotionError):
    """No posture clear of all constraints was found; `posture` (n,) is the best of those tried."""

    def __init__(self, message: str, posture: Array) -> None:
        super().__init__(message)
        self.posture = posture


@dataclass(frozen=True)
class Start:
    """A motion with room around it, as free variables `base` (size,).

    It begins at `posture` (n,): standing there, or on the way to where the motion is to end.
    `as_configured`: the posture is the one that the config gives. `note`: what else to know.
    """

    base: Array
    posture: Array
    as_configured: bool
    note: str = ""


def random_start(task: MotionTask, start: Start, seed: tuple[int, ...]) -> Array:
    """Free variables of a random admissible motion about `start`.

    Raises
    ------
    NoAdmissibleMotionError
        Not even a tiny motion about the posture is admissible.
    """
    rng = np.random.default_rng(seed)
    direction = random_direction(task, rng)
    room = min((float(value.min()) for value in task.values(task.states(start.base))), default=1.0)
    clear = min(_CLEAR_MOTION, _SHARE_OF_ROOM * room)
    amplitude = 1.0
    while amplitude > _SMALLEST:
        x = start.base + amplitude * direction
        values = task.values(task.states(x))
        if all(value.min() > clear for value in values):
            return x
        amplitude *= _SHRINK
    label = blocking(task, task.values(task.states(start.base + amplitude * direction)))
    about = "base motion between the given postures" if task.problem.boundary.given else "posture"
    raise NoAdmissibleMotionError(
        f"No admissible motion: even a tiny one about the {about} breaks {label}. Loosen that "
        "constraint or give another robot.posture."
    )


def random_direction(task: MotionTask, rng: np.random.Generator, slow: float = 1.0) -> Array:
    """A random motion (size,) of unit length in the task's metric, joint by joint.

    With `slow` = 1 it is white in that metric: slow coefficients, which the bounds on acceleration
    hardly see, come out large and fast ones small, whatever the family of trajectories. With 0 all
    coefficients are drawn alike, so that fast ones dominate; values between mix the two.
    """
    factor = np.linalg.cholesky(task.metric + 1e-12 * np.trace(task.metric) * np.eye(task.size))
    white = solve_triangular(factor.T, rng.normal(size=task.size))
    alike = rng.normal(size=task.size)
    x = slow * _unit_by_joint(task, white) + (1.0 - slow) * _unit_by_joint(task, alike)
    return _unit_by_joint(task, x)


def _unit_by_joint(task: MotionTask, x: Array) -> Array:
    """x with every joint's part of unit length in the metric (which does not couple joints)."""
    by_joint = x.reshape(task.n, task.k)
    length = np.sqrt(np.einsum("jk,jk->j", by_joint, (task.metric @ x).reshape(task.n, task.k)))
    return np.asarray((by_joint / length[:, None]).ravel())


def clear_posture(task: MotionTask, seed: int, tries: int = _TRIES, given: bool = True) -> Start:
    """A posture at which standing still keeps every residual clear, sought from `tries` guesses.

    `given`: somebody gave the posture of the config, and is to correct one that no robot can have.

    Raises
    ------
    NoAdmissibleMotionError
        No real robot can stand as configured, or none was found; the message names the constraint
        that prevents it.
    """
    configured = task.problem.robot.posture
    if given:
        refuse_impossible(task, configured, "robot.posture")
    if _standing(task, configured).min() > _CLEAR_POSTURE:
        return _standing_at(task, configured, True)
    rng = np.random.default_rng((seed, 7))
    best, best_clearance = configured, -np.inf
    for attempt in range(tries):
        spread = attempt / max(tries - 1, 1)
        guess = _blend(task, configured, rng, spread)
        found = pushed_clear(task, guess)
        clearance = float(_standing(task, found).min())
        if clearance > _CLEAR_POSTURE:
            return _standing_at(task, found, False)
        if clearance > best_clearance:
            best, best_clearance = found, clearance
    values = task.values(_still(task, best))
    raise NoClearPostureError(
        f"No admissible motion: no posture found that is clear of all constraints "
        f"({tries} tried from robot.posture). Blocked by {blocking(task, values)}. At the best "
        f"of them: {_all_broken(task, best)}. Give a clear robot.posture or loosen the constraint "
        "(pairs that always touch: constraints.self_collision.ignore, "
        "constraints.surroundings.ignore).",
        best,
    )


def broken(task: MotionTask, posture: Array) -> list[tuple[Constraint, tuple[int, ...]]]:
    """Constraints with the columns that standing at `posture` (n,) breaks."""
    return unclear(task, posture, 0.0)


def unclear(
    task: MotionTask, posture: Array, room: float = _CLEAR_POSTURE
) -> list[tuple[Constraint, tuple[int, ...]]]:
    """Constraints with the columns whose residuals at `posture` (n,) leave no `room` to start."""
    found = []
    values = task.values(_still(task, posture))
    for constraint, value in zip(task.problem.constraints, values, strict=True):
        columns = np.flatnonzero(value[0] <= room).tolist()
        if columns:
            found.append((constraint, tuple(columns)))
    return found


def refuse_impossible(task: MotionTask, posture: Array, where: str) -> None:
    """Raise if no real robot can stand at `posture` (n,), which the config gives as `where`.

    Raises
    ------
    NoAdmissibleMotionError
        It stands inside something; the message says what, where and how deep.
    """
    for constraint in task.problem.constraints:
        reason = constraint.why_not(_still(task, posture))
        if reason:
            raise NoAdmissibleMotionError(f"No admissible motion: at {where}, {reason}.")


def _standing_at(task: MotionTask, posture: Array, as_configured: bool) -> Start:
    base = task.variables(task.problem.still(posture))
    return Start(base, posture, as_configured)


def moved_note(task: MotionTask, start: Start) -> str:
    """What was changed of the configured posture and why, or the note of the start."""
    if start.as_configured:
        return start.note
    configured = task.problem.robot.posture
    changed = ", ".join(
        f"{name}: {value:.3f}"
        for name, value, before in zip(
            task.problem.robot.joint_names, start.posture, configured, strict=True
        )
        if abs(value - before) > 1e-3
    )
    broken = blocking(task, task.values(_still(task, configured)))
    return f"robot.posture is too near a bound of {broken}; moved about {{{changed}}} instead"


def _blend(task: MotionTask, posture: Array, rng: np.random.Generator, spread: float) -> Array:
    limits = task.problem.robot.limits
    lower = np.where(np.isfinite(limits.lower), limits.lower, posture - np.pi)
    upper = np.where(np.isfinite(limits.upper), limits.upper, posture + np.pi)
    inner = 0.05 * (upper - lower)
    centred = np.clip(posture, lower + inner, upper - inner)
    return centred + spread * (rng.uniform(lower + inner, upper - inner) - centred)


def _still(task: MotionTask, posture: Array) -> States:
    return States.still(task.problem.kinematics, posture[None])


def _standing(task: MotionTask, posture: Array) -> Array:
    """Residuals of all constraints, in one row, of standing still at `posture`."""
    parts = [value[0] for value in task.values(_still(task, posture))]
    return np.concatenate(parts) if parts else np.array([np.inf])


def pushed_clear(task: MotionTask, guess: Array) -> Array:
    """The posture (n,) with the largest smallest residual, sought from `guess` (n,).

    Maximises s with every residual at least s (SLSQP, exact derivatives).
    """

    # What is farther off does not come into the way; it is seen to when all is judged.
    within = _standing(task, guess) < _WITHIN

    def residuals(z: Array) -> Array:
        return np.minimum(_standing(task, z[:-1])[within], _FAR) - z[-1]

    def jacobian(z: Array) -> Array:
        states, rows = _still(task, z[:-1]), []
        for index, value in enumerate(task.values(states)):
            near = np.ones_like(value, dtype=bool)
            by_q = task.residuals.rows(states, index, near).parts[0]
            part = np.zeros((value.shape[1], task.n)) if by_q is None else by_q
            rows.append(np.where(value[0][:, None] < _FAR, part, 0.0))
        stacked = np.vstack(rows)[within]
        return np.hstack([stacked, -np.ones((len(stacked), 1))])

    limits = task.problem.robot.limits
    slope = np.zeros(task.n + 1)
    slope[-1] = -1.0
    room = float(_standing(task, guess).min())
    result = minimize(
        lambda z: -z[-1],
        np.append(guess, room),
        jac=lambda z: slope,
        method="SLSQP",
        bounds=[*zip(limits.lower, limits.upper, strict=True), (-np.inf, 0.25)],
        constraints=[{"type": "ineq", "fun": residuals, "jac": jacobian}],
        options={"maxiter": 60},
    )
    return np.asarray(result.x[:-1]) if np.all(np.isfinite(result.x)) else guess


def blocking(task: MotionTask, values: list[Array]) -> str:
    """The constraint and column with the smallest residual, in words."""
    smallest, words = np.inf, "nothing"
    for constraint, value in zip(task.problem.constraints, values, strict=True):
        column = int(np.argmin(value.min(axis=0)))
        if value[:, column].min() < smallest:
            smallest = float(value[:, column].min())
            words = f"{constraint.name} ({constraint.labels[column]})"
    return words


def _all_broken(task: MotionTask, posture: Array) -> str:
    """Every constraint column without room at `posture`, worst first, with its margin."""
    states, found = _still(task, posture), []
    for constraint in task.problem.constraints:
        margins = constraint.margins(states)[0]
        for column in np.flatnonzero(margins < _CLEAR_POSTURE * constraint.scale).tolist():
            share = float(margins[column] / constraint.scale[column])
            unit = constraint.unit_of(column)
            found.append((share, f"{constraint.labels[column]} {margins[column]:.3g} {unit}"))
    found.sort()
    more = f" and {len(found) - _TOLD} more" if len(found) > _TOLD else ""
    return "; ".join(words for _, words in found[:_TOLD]) + more


# A motion from elsewhere as the start of the search.
#
# The motion is stretched to the duration of the trajectory that is sought and projected onto it,
#
#     min over x  Σ_t |q_x(t) − q(t·T_given/T)|²,
#
# then drawn towards a motion with room (standing at its mean posture, or what a start without it
# would be drawn about) until every residual is clear: the solver starts from inside.

# Residuals that the start must have, or this share of the room where it is drawn to.
_CLEAR, _ROOM_OF_GIVEN = 0.01, 0.5
_SHARES = np.concatenate([[1.0, 0.99], np.geomspace(0.97, 1e-3, 60)])
_SAME_DURATION = 1e-6
_TOLD_MISFIT = 1e-4


def start_from(task: MotionTask, start: Start, given: Segment) -> tuple[Array, str]:
    """Free variables of an admissible motion like `given`, and how it differs, in words.

    Raises
    ------
    NoAdmissibleMotionError
        Not even a thousandth of the motion's amplitude is admissible.
    """
    trajectory = task.problem.trajectory
    stretched = given.trajectory.slowed(given.trajectory.duration / trajectory.duration)
    basis = task.problem.constraint_basis
    wanted, _, _ = stretched.states(basis.times, given.coefficients)
    rows = basis.position @ task.free
    solution, *_ = lstsq(rows, wanted - basis.position @ task.offset)
    x = task.flat(solution)
    fitted = basis.position @ task.coefficients(x)
    misfit = float(np.sqrt(np.mean((fitted - wanted) ** 2, axis=0)).max())
    anchor = _anchor(task, start, fitted.mean(axis=0))
    clear = min(_CLEAR, _ROOM_OF_GIVEN * _room(task, anchor))
    for share in _SHARES:
        candidate = anchor + share * (x - anchor)
        if _room(task, candidate) > clear:
            return candidate, _words(task, given, misfit, float(share))
    broken = blocking(task, task.values(task.states(x)))
    raise NoAdmissibleMotionError(
        f"--start {given.name}: no admissible start could be made of it, not even a thousandth of "
        f"its amplitude; as it is, it breaks {broken}. Leave --start out, or loosen that "
        "constraint."
    )


def _room(task: MotionTask, x: Array) -> float:
    """The smallest residual of all constraints."""
    return min((float(v.min()) for v in task.values(task.states(x)) if v.size), default=np.inf)


def _anchor(task: MotionTask, start: Start, mean: Array) -> Array:
    """Standing at the motion's mean posture if that has room, else the base of `start`."""
    if not task.problem.boundary.given:
        standing = task.variables(task.problem.still(mean))
        if _room(task, standing) > 2 * _CLEAR:
            return standing
    return start.base


def _words(task: MotionTask, given: Segment, misfit: float, share: float) -> str:
    words = [f"the search started from {given.name}"]
    wanted, there = task.problem.trajectory.duration, given.trajectory.duration
    if abs(there - wanted) > _SAME_DURATION * wanted:
        words.append(f"stretched from {there:.4g} to {wanted:.4g} s")
    if misfit > _TOLD_MISFIT:
        words.append(f"which this trajectory follows to {misfit:.2g} rad (RMS, worst joint)")
    if share < 1.0:
        words.append(f"drawn to {100 * share:.3g} % of its amplitude to be admissible")
    return ", ".join(words)
