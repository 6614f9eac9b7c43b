"""Could these be the robot's torques? Order and signs, judged with the URDF's inertias.

Torque of every joint is regressed on what the URDF predicts for it plus friction and an offset.
Where the torques of two joints fit the other's prediction much better, columns are swapped; where
the fit wants a negative inertia and negative friction, a sign is. These are not effects of the
robot, and a diagnosis of such data would be wrong from the start.
"""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from excite_cli.errors import FileError
from excite_cli.identification.prepare import PreparedRun
from excite_cli.robot.model import Array, Robot
from excite_cli.robot.regressor import standard_parameters
from excite_cli.robot.rigid_body import RigidBody

_SAMPLES = 600
# Swapped columns leave at most this share of the residual that the order in the file leaves.
_CLEARLY_BETTER = 0.6
_EXPLAINED = 0.5  # and explain at least half of the torque's energy


def check_plausibility(robot: Robot, runs: Sequence[PreparedRun]) -> None:
    """Refuse data whose torque or joint order contradicts the robot.

    Raises
    ------
    FileError
        Columns are swapped, or the torque of a joint counts the other way.
    """
    q, v, a, tau = _thinned(runs)
    names = robot.joint_names
    problems = _wrong_order(robot, q, v, a, tau)
    if not problems:
        wrong = _wrong_signs(robot, q, v, a, tau)
        if len(wrong) == robot.n and robot.n > 1:
            problems = [
                "the torque of every joint has the wrong sign: it opposes what the URDF's inertias "
                "and friction ask for. Set measurement.sign to -1 for all joints "
                f"({{{', '.join(f'{name}: -1' for name in names)}}})."
            ]
        else:
            problems = [
                f"the torque of {names[j]} has the wrong sign: it opposes what the URDF's inertias "
                f"and friction ask for. Set measurement.sign: {{{names[j]}: -1}}, or check the "
                "joint's axis in the URDF."
                for j in wrong
            ]
    if problems:
        raise FileError("the measured data contradict the robot: " + " ".join(problems))


def _thinned(runs: Sequence[PreparedRun]) -> tuple[Array, Array, Array, Array]:
    parts = []
    total = sum(run.averages.shape[0] for run in runs)
    for run in runs:
        stride = max(1, total // _SAMPLES)
        picks = run.averages[::stride]
        parts.append([np.asarray(picks @ x) for x in (run.q, run.v, run.a)] + [run.tau[::stride]])
    q, v, a, tau = (np.concatenate(each) for each in zip(*parts, strict=True))
    return q, v, a, tau


def _wrong_order(robot: Robot, q: Array, v: Array, a: Array, tau: Array) -> list[str]:
    """Sentences on swapped columns: of the torque alone, or of whole joints."""
    straight = _residuals(_load(robot, q, v, a), v, tau)
    best: tuple[float, str] | None = None
    names = robot.joint_names
    for i, j in combinations(range(robot.n), 2):
        order = np.arange(robot.n)
        order[[i, j]] = j, i
        both = [i, j]
        load = _load(robot, q, v, a)
        swapped_torque = _residuals(load, v, tau[:, order])
        load = _load(robot, q[:, order], v[:, order], a[:, order])
        swapped_all = _residuals(load, v[:, order], tau[:, order])
        for residual, joints, words in (
            (swapped_torque, both, "the torque columns of {0} and {1} are swapped"),
            (swapped_all, list(range(robot.n)), "the columns of {0} and {1} are swapped"),
        ):
            better = residual[joints].mean() / max(straight[joints].mean(), 1e-9)
            clear = better < _CLEARLY_BETTER and residual[joints].max() < _EXPLAINED
            if clear and (best is None or better < best[0]):
                best = (better, words.format(names[i], names[j]))
    if best is None:
        return []
    return [
        f"{best[1]}: the other way round they fit the URDF with {best[0]:.0%} of the error. Name "
        "the columns after the joints (measurement.names), in the order of the file."
    ]


def _load(robot: Robot, q: Array, v: Array, a: Array) -> Array:
    return RigidBody(robot, standard_parameters(robot), q, v, a).load


def _columns(load: Array, v: Array) -> Array:
    return np.stack([load, v, np.sign(v), np.ones_like(v)], axis=1)


def _size(x: Array) -> float:
    return float(np.sqrt(np.sum(np.square(x))))


def _residuals(load: Array, v: Array, tau: Array) -> Array:
    """Share (n,) of each torque's RMS that a scaled prediction with friction leaves; scale ≥ 0."""
    left = np.empty(tau.shape[1])
    for j in range(tau.shape[1]):
        x = _columns(load[:, j], v[:, j])
        scale = np.sqrt(np.sum(x**2, axis=0)) + 1e-12
        theta = np.linalg.lstsq(x / scale, tau[:, j], rcond=1e-8)[0]
        if theta[0] < 0:
            theta[1:] = np.linalg.lstsq(x[:, 1:] / scale[1:], tau[:, j], rcond=1e-8)[0]
            theta[0] = 0.0
        residual = tau[:, j] - (x / scale) @ theta
        left[j] = _size(residual) / max(_size(tau[:, j]), 1e-12)
    return left


def _wrong_signs(robot: Robot, q: Array, v: Array, a: Array, tau: Array) -> list[int]:
    """Joints whose torque, on its own, asks for negative inertia or friction."""
    load = _load(robot, q, v, a)
    wrong = []
    for j in range(robot.n):
        x = _columns(load[:, j], v[:, j])
        x = x - x.mean(axis=0)
        y = tau[:, j] - tau[:, j].mean()
        scale = np.sqrt(np.sum(x**2, axis=0)) + 1e-12
        theta = np.linalg.lstsq(x / scale, y, rcond=1e-8)[0]
        explained = 1.0 - _size(y - (x / scale) @ theta) / max(_size(y), 1e-12)
        # Shares of the torque's energy that load and friction account for, with their signs.
        parts = (x / scale) * theta
        by_load = float(np.sign(theta[0]) * _size(parts[:, 0]))
        by_friction = float((parts[:, 1] + parts[:, 2]) @ v[:, j])
        friction_size = _size(parts[:, 1] + parts[:, 2])
        signed = by_load + np.sign(by_friction) * friction_size
        if signed < -0.5 * _size(y) and explained > 0.3:
            wrong.append(j)
    return wrong
