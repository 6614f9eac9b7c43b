"""A motion from elsewhere as the start of the search.

The motion is stretched to the duration of the trajectory that is sought and projected onto it,

    min over x  Σ_t |q_x(t) − q(t·T_given/T)|²,

then drawn towards a motion with room (standing at its mean posture, or what a start without it
would be drawn about) until every residual is clear: the solver starts from inside.
"""

import numpy as np
from scipy.linalg import lstsq

from excite_cli.constraints.base import Array
from excite_cli.errors import NoAdmissibleMotionError
from excite_cli.excitation.start import Start, blocking
from excite_cli.excitation.task import MotionTask
from excite_cli.trajectory.chain import Segment

# Residuals that the start must have, or this share of the room where it is drawn to.
_CLEAR, _SHARE_OF_ROOM = 0.01, 0.5
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
    clear = min(_CLEAR, _SHARE_OF_ROOM * _room(task, anchor))
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
