"""Whether a round may be played at full pace: by the torques that the fitted model expects."""

from collections.abc import Sequence

import numpy as np

from excite_cli.api.model import Model
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.stack import Stack
from excite_cli.robot.model import Array
from excite_cli.trajectory.fade import Segment

_SIGMAS = 3.0
_STEP = 0.02  # [s]


def torque_deviation(known: tuple[Problem, Stack], times: Array, states: Sequence[Array]) -> Array:
    """Standard deviation (T, n) of the model's torque [N·m; N] at states q, v, a (T, n).

    √diag(Y M⁻¹ Yᵀ), with Y the columns of base parameters and effects and M = RᵀR + CᵀC what the
    prior and the data say of them (`excitation/prediction.py`). `known`: the problem in which they
    are unknown, and the data C on its columns. Of effects that the model has not, the prior is
    narrower where a share of the usual torque, RMS, would be far more at its largest: Stribeck
    friction that ends at 0.02 rad/s is no 40 N·m.
    """
    problem, stack = known
    prediction = problem.prediction
    assert prediction is not None
    rows = problem.objective().block_of(times, *states)
    torques = rows.reshape(len(times), -1, rows.shape[1]) / problem.weighting.rows[:, None]
    largest = np.max(np.abs(torques).max(axis=0) / prediction.usual[:, None], axis=0)
    slices = prediction.extension.columns().slices
    first = slices[prediction.declared].start if prediction.declared < len(slices) else None
    added = np.square(np.maximum(largest[prediction.rank :] / prediction.shares, 1.0)) - 1.0
    added[:first] = 0.0
    information = prediction.information(stack.factor)
    information[np.diag_indices(len(information))] += np.append(np.zeros(prediction.rank), added)
    spread = np.linalg.solve(information, rows.T)
    variance = np.sum(rows * spread.T, axis=1).reshape(len(times), -1)
    return np.asarray(np.sqrt(variance) / problem.weighting.rows)


def within_torque(
    model: Model, known: tuple[Problem, Stack], motions: Sequence[Segment], sigmas: float = _SIGMAS
) -> bool:
    """Whether torques keep the effort limits along `motions`, so many standard deviations aside.

    Of motors that have less torque at speed: that of the speed, which braking need not keep.
    """
    curves = known[0].robot.limits.curves
    for motion in motions:
        times = np.arange(0.0, motion.trajectory.duration, _STEP)
        states = motion.trajectory.states(times, motion.coefficients)
        most = np.abs(model.torque(*states, t=times))
        most += sigmas * torque_deviation(known, times, states)
        speed = np.abs(states[1])
        if any(np.any(most[:, j] > curve.effort(speed[:, j])) for j, curve in enumerate(curves)):
            return False
    return True
