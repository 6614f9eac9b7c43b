"""Full pace is taken where the model keeps the limits of torque, for what is not known of it."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.api.campaign_pace import torque_deviation, within_torque
from excite_cli.api.model import Model
from excite_cli.dynamics.regressor import InverseDynamics
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.stack import Stack
from excite_cli.robot.effort_curve import EffortCurve
from excite_cli.robot.model import Array
from excite_cli.trajectory.fade import Segment
from tests.excitation.smoke import drawn, prediction_of, smoke, stacked


@pytest.fixture(scope="module")
def problem() -> Problem:
    return smoke("criterion.kind=predicted_torque")


def test_the_deviation_is_that_of_models_drawn_from_what_the_data_say(problem: Problem) -> None:
    """What is only possible has no more than its share of the usual torque, at no instant."""
    prediction, stack = prediction_of(problem), stacked(problem, 1, 2)
    times: Array = np.linspace(0.0, 5.0, 7)
    states = problem.trajectory.states(times, drawn(problem, 0.3, 5))
    rows = problem.objective().block_of(times, *states)
    torques = rows.reshape(len(times), problem.robot.n, -1) / problem.weighting.rows[:, None]
    usual = prediction.usual[:, None] * prediction.shares
    peaks = np.max(np.abs(torques[:, :, prediction.rank :]) / usual, axis=(0, 1))
    precision = prediction.information(stack.factor)
    for k, peak in enumerate(peaks, start=prediction.rank):
        precision[k, k] += max(peak, 1.0) ** 2 - 1.0
    assert max(peaks) > 3.0
    covariance = np.linalg.inv(precision)
    z = np.random.default_rng(1).multivariate_normal(np.zeros(len(covariance)), covariance, 20_000)
    drawn_ = np.einsum("tjc,zc->ztj", torques, z)
    found = torque_deviation((problem, stack), times, states)
    np.testing.assert_allclose(found, drawn_.std(axis=0), rtol=0.03)


def test_the_prior_of_what_the_model_has_stays_as_wide_as_it_is() -> None:
    narrow = "{kind: stribeck_friction, joints: [elbow], shape: {stribeck_speed: 0.002}}"
    declared = smoke("criterion.kind=predicted_torque", f"effects=[{narrow}]")
    times: Array = np.linspace(0.0, 6.0, 3001)
    states = declared.trajectory.states(times, drawn(declared, 0.3, 5))
    nothing = Stack.empty(declared.columns)
    prediction = prediction_of(declared)
    own = int(prediction.first_columns[0])
    column = declared.objective().block_of(times, *states)[:, own]
    alone = np.abs(column.reshape(len(times), -1) / declared.weighting.rows).max()
    assert torque_deviation((declared, nothing), times, states).max() > 0.99 * alone


class _Urdf(Model):
    """The torque of the URDF's inertias."""

    def __init__(self, problem: Problem) -> None:
        object.__setattr__(self, "dynamics", InverseDynamics(problem.robot))

    def torque(self, q: Array, v: Array, a: Array, **others: object) -> Array:  # type: ignore[override]
        found: Array = self.dynamics.torques(q, v, a)  # type: ignore[attr-defined]
        return found


@pytest.mark.parametrize("sigmas", [0.0, 3.0])
def test_limits_of_torque_are_kept_with_standard_deviations(
    problem: Problem, sigmas: float
) -> None:
    stack, model = stacked(problem, 1, 2), _Urdf(problem)
    motion = Segment("motion", problem.trajectory, drawn(problem, 0.2, 5))
    times = np.arange(0.0, problem.trajectory.duration, 0.02)
    states = motion.trajectory.states(times, motion.coefficients)
    aside = sigmas * torque_deviation((problem, stack), times, states)
    most = (np.abs(model.torque(*states)) + aside).max(axis=0)

    def kept(efforts: Array, data: Stack = stack) -> bool:
        return within_torque(model, (_limited(problem, efforts), data), [motion], sigmas)

    assert kept(1.001 * most)
    for joint in range(problem.robot.n):
        assert not kept(np.where(np.arange(problem.robot.n) == joint, 0.999, 1.001) * most)
    assert kept(1.001 * most, Stack.empty(problem.columns)) == (sigmas == 0.0)


def _limited(problem: Problem, efforts: Array) -> Problem:
    curves = tuple(EffortCurve.constant(effort) for effort in efforts)
    limits = replace(problem.robot.limits, curves=curves)
    return replace(problem, robot=replace(problem.robot, limits=limits))
