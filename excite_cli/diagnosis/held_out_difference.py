"""Why held-out recordings have a far larger error than those that were fitted: what is different.

A robot is another one on another day: warm or cold, with another load, mounted anew. A few such
changes are fitted to what the model leaves of the held-out torque r = τ − τ̂, with few numbers each:

    friction of every joint      r_j = α_j f_j,  f_j the model's friction torque
    offset of every joint        r_j = o_j
    gain of every joint          r_j = γ_j τ̂_j
    a load at the last links     r = Y_ends (m, m c)
    gravity from elsewhere       r = Σ_k δg_k ∂τ̂/∂g_k

each on every other second, and tried on the seconds between. The change with the least error is
told, with what is left by it. Where none explains it, what may be: most of the error is within a
tenth of the time (a push, a touch), or joints go faster or farther than in the training data. This
is a description: nothing is fitted or chosen by it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from excite_cli.diagnosis.records import HELD_OUT_DIFFERS
from excite_cli.dynamics.regressor import PARAMETERS_PER_BODY
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.catalogue import rubs
from excite_cli.identification.averages import apply
from excite_cli.identification.errors_of_torque import FEWEST
from excite_cli.identification.fit_words import relative_in_words, short_number
from excite_cli.identification.identified_model import IdentifiedModel, Prediction
from excite_cli.identification.prepare import PreparedRun
from excite_cli.identification.regression import signals_of, torque_of
from excite_cli.measurement.dataset import Finding
from excite_cli.robot.link_frame import leaves
from excite_cli.robot.model import Array, Robot

# Speaks where the mean error is so many times that of the training data, and by so much more. Of 19
# simulated logs it is 0.5 to 2.0 times as large, of one whose last recording is of another day 5.9.
_TIMES, _LEAST = 2.0, 0.02
_MOST_OF_IT = 0.5  # of the excess: a change that explains less is no explanation
_BRIEF, _NEARLY_ALL = 0.1, 0.7  # of the time; of the squares of all errors
_FASTER, _FARTHER = 1.2, 0.2  # times the training data's speed; of their span of angles
_BLOCK = 1.0  # s
_RIDGE = 1e-6  # of a column's energy


@dataclass(frozen=True)
class _Rows:
    """Of every joint r (M_j,) and its torque, the side (M_j,) of each sample, and columns."""

    left: list[Array]
    size: Array
    side: list[Array]
    columns: dict[str, list[Array]]


def held_out_difference(
    robot: Robot,
    model: IdentifiedModel,
    runs: Sequence[PreparedRun],
    predicted: Sequence[Prediction],
    trained: Sequence[PreparedRun],
    errors: tuple[float, float],
) -> tuple[Finding, ...]:
    """One line on held-out `runs` that differ; none if they do not, or are parts of `trained` ones.

    errors: mean relative error where joints move, on these runs and on the training data.
    """
    now, usual = errors
    if not (now > _TIMES * usual and now > usual + _LEAST):
        return ()
    if {run.run.name for run in runs} & {run.run.name for run in trained}:
        return ()
    rows = _rows(robot, model, runs, predicted)
    names = ", ".join(dict.fromkeys(run.run.name for run in runs))
    said = (
        f"{names} differs from the training recordings: {relative_in_words(now)} of torque RMS is "
        f"left of it, {relative_in_words(usual)} of them. "
    )
    best, numbers, left = "", np.zeros(0), now
    for kind, columns in rows.columns.items():
        shares, found = _tried(rows, columns, kind in _COMMON)
        if np.isfinite(shares).any() and float(np.nanmean(shares)) < left:
            best, numbers, left = kind, found, float(np.nanmean(shares))
    if now - left < _MOST_OF_IT * (now - usual):
        said += "No change of friction, offsets, gains, load or mount explains it"
        said += f": {why}. " if (why := _elsewhere(robot, runs, predicted, trained)) else ". "
    else:
        words = _WORDS[best](robot, numbers)
        said += f"With {words} it would be {relative_in_words(left)}. "
    said += "Have a recording like it among the training ones (--held-out names another)"
    return (Finding(HELD_OUT_DIFFERS, "warning", said, names),)


def _elsewhere(
    robot: Robot,
    runs: Sequence[PreparedRun],
    predicted: Sequence[Prediction],
    trained: Sequence[PreparedRun],
) -> str:
    """What it may be; empty if it is as long, and within the speeds and angles of the others."""
    for run, told in zip(runs, predicted, strict=True):
        counted = run.valid & run.moving
        size = np.sqrt(np.mean(np.square(run.tau), axis=0, where=run.valid))
        wrong = np.where(counted, (run.tau - run.averaged_torque(told.torque)) / size, 0.0)
        energy = np.square(wrong).sum(axis=1)
        width = max(1, round(_BRIEF * len(energy)))
        sums = np.convolve(energy, np.ones(width), "valid")
        start = int(np.argmax(sums))
        if sums[start] > _NEARLY_ALL * energy.sum():
            t = run.averaged(run.t)
            return (
                f"most of it is between {t[start]:.3g} and {t[start + width - 1]:.3g} s of "
                f"{run.run.name} (a push, a touch)"
            )
    now, then = ([np.concatenate([getattr(r, x) for r in some]) for x in ("q", "v")]
                 for some in (runs, trained))  # fmt: skip
    faster = np.abs(now[1]).max(axis=0) > _FASTER * np.abs(then[1]).max(axis=0)
    beyond = np.maximum(now[0].max(0) - then[0].max(0), then[0].min(0) - now[0].min(0))
    farther = beyond > _FARTHER * np.ptp(then[0], axis=0)
    words = []
    for what, joints in (("faster", faster), ("farther", farther)):
        if joints.any():
            words.append(f"{', '.join(np.array(robot.joint_names)[joints])} {what}")
    return f"it moves {' and '.join(words)} than they do" if words else ""


def _rows(
    robot: Robot,
    model: IdentifiedModel,
    runs: Sequence[PreparedRun],
    predicted: Sequence[Prediction],
) -> _Rows:
    n = robot.n
    parts: list[list[list[Array]]] = [[] for _ in range(n)]
    for run, told in zip(runs, predicted, strict=True):
        columns = _columns(robot, model, run, told)
        side = (run.averaged(run.t) // _BLOCK).astype(int) % 2
        for j in range(n):
            kept = run.valid[:, j] & run.moving[:, j]
            own = [apply(run.valid_averages[j], each[:, j])[kept] for each in columns.values()]
            left = run.tau[kept, j] - (run.valid_averages[j] @ told.torque[:, j])[kept]
            parts[j].append([left, run.tau[kept, j], side[kept], *own])
    joined = [[np.concatenate(each) for each in zip(*own, strict=True)] for own in parts]
    size = [np.sqrt(np.mean(own[1] ** 2)) if len(own[1]) >= FEWEST else np.nan for own in joined]
    kinds = {name: [own[3 + k] for own in joined] for k, name in enumerate(columns)}
    return _Rows([own[0] for own in joined], np.array(size), [own[2] for own in joined], kinds)


def _columns(
    robot: Robot, model: IdentifiedModel, run: PreparedRun, told: Prediction
) -> dict[str, Array]:
    """Columns (T, n, k) of every change."""
    signals = signals_of(run, robot, model.phi)
    friction = torque_of(model.effects, model.values, signals, lambda effect: rubs(type(effect)))
    bodies = [PARAMETERS_PER_BODY * body + k for body in leaves(robot) for k in range(4)]
    weights = [
        RigidBody(robot.with_gravity(axis), model.phi, run.q, 0.0 * run.v, 0.0 * run.a).load
        for axis in np.eye(3)
    ]
    found = {
        "friction": friction[:, :, None],
        "offset": np.ones((*run.q.shape, 1)),
        "gain": told.torque[:, :, None],
        "load": signals.body.regressor[:, :, bodies],
    }
    weighs = np.any(robot.model.gravity.linear)
    return {**found, "gravity": np.stack(weights, axis=2)} if weighs else found


_COMMON = ("load", "gravity")


def _tried(rows: _Rows, columns: Sequence[Array], common: bool) -> tuple[Array, Array]:
    """Relative errors (n,) of the other seconds, and numbers (k,) or (n, k) of all."""
    n, squares = len(columns), np.zeros(len(columns))
    known = np.isfinite(rows.size)
    joints = [int(j) for j in np.flatnonzero(known)]
    groups = [joints] if common else [[j] for j in joints]
    numbers = np.zeros((n, columns[0].shape[1]))
    for group in groups:
        fitted = [_solved(rows, columns, group, side) for side in (0, 1, None)]
        numbers[group] = fitted[2]
        for j in group:
            # Each side by the numbers of the other.
            own = np.where(rows.side[j] == 0, columns[j] @ fitted[1], columns[j] @ fitted[0])
            squares[j] = np.mean(np.square(rows.left[j] - own))
    return np.sqrt(squares) / rows.size, numbers


def _solved(rows: _Rows, columns: Sequence[Array], group: Sequence[int], side: int | None) -> Array:
    """Least squares over some joints, each in shares of its torque, on one side or on both."""
    gram = np.zeros((columns[0].shape[1],) * 2)
    rhs = np.zeros(len(gram))
    for j in group:
        at = slice(None) if side is None else rows.side[j] == side
        scaled = columns[j][at] / rows.size[j]
        gram += scaled.T @ scaled
        rhs += scaled.T @ (rows.left[j][at] / rows.size[j])
    norms = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    unit = gram / np.outer(norms, norms) + _RIDGE * np.eye(len(gram))
    return np.asarray(np.linalg.solve(unit, rhs / norms) / norms)


def _of_joints(what: str, sizes: Array, least: float, robot: Robot, change: bool) -> str:
    """`friction of a × 0.7, of b × 1.2`: of joints where it is not next to nothing."""
    told = [
        f"of {name} {'×' if change else ''}{short_number(1.0 + x if change else x, 2)}"
        for name, x in zip(robot.joint_names, sizes, strict=True)
        if abs(x) > least
    ]
    return f"{what} {', '.join(told)}"


def _gravity(robot: Robot, numbers: Array) -> str:
    gravity = np.asarray(robot.model.gravity.linear)
    down, moved = gravity / np.linalg.norm(gravity), gravity + numbers[0]
    cosine = float(moved @ down / max(float(np.linalg.norm(moved)), 1e-9))
    return f"gravity {np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))):.2g}° elsewhere"


_WORDS = {
    "friction": lambda robot, x: _of_joints("friction", x[:, 0], 0.05, robot, True),
    "offset": lambda robot, x: _of_joints("torque offsets", x[:, 0], 0.0, robot, False),
    "gain": lambda robot, x: _of_joints("torques", x[:, 0], 0.02, robot, True),
    "load": lambda robot, x: "another load at the end",
    "gravity": _gravity,
}
