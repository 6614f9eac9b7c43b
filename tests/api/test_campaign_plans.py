"""What the motions of a campaign are planned for."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.api.campaign_plans import (
    at_pace,
    from_rest,
    on_robot,
    torque_deviation,
    within_torque,
)
from excite_cli.api.loading import Case, load_case, load_problem, problem_of
from excite_cli.api.model import Model
from excite_cli.config.load_spec import load_spec
from excite_cli.diagnosis.records import EffectRecord
from excite_cli.dynamics.regressor import InverseDynamics
from excite_cli.excitation.entry import PaceLimits
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.problem import Problem
from excite_cli.robot.effort_curve import EffortCurve
from excite_cli.robot.model import Array
from excite_cli.trajectory.fade import Segment
from tests.cli.program import SMOKE
from tests.excitation.smoke import drawn, one_motion, prediction_of, smoke, stacked

ROBOT = load_case(SMOKE).robot


def test_effects_of_a_measured_base_alone_are_not_planned_for() -> None:
    """Data of a robot that stands have the six joints of its base before its own."""
    robot = load_problem(SMOKE, []).robot
    first, *others = robot.joint_names
    records = [
        EffectRecord("torque_offset", ("base_x",), {}, (1.0,)),
        EffectRecord("base_tilt", ("base_x", "base_y", first, *others), {"pitch": 0.1}, (0.1,)),
        EffectRecord("spring", (first,), {}, (4.0,)),
    ]
    told = on_robot(records, robot)
    assert [(each.kind, each.joints) for each in told] == [
        ("base_tilt", robot.joint_names),
        ("spring", (first,)),
    ]
    assert told[0].shape == {"pitch": 0.1}


def test_a_first_round_is_planned_within_a_share_of_the_limits() -> None:
    spec = load_spec(SMOKE)
    full, slow = (
        PaceLimits.of(problem.constraints, problem.robot.n).largest
        for share in (1.0, 0.4)
        for problem in [problem_of(Case(at_pace(share, spec), SMOKE.parent, ROBOT))]
    )
    bounded = np.isfinite(full)
    assert bounded[:2].all()
    np.testing.assert_allclose(slow[bounded], 0.4 * full[bounded])
    assert at_pace(1.0, spec) == spec


def test_what_is_slowed_down_is_planned_for_any_lower_speed() -> None:
    spec = load_spec(SMOKE, ["constraints.joint_limits=null"])
    assert not spec.constraints.any_speed
    assert at_pace(0.4, spec).constraints.any_speed
    assert at_pace(1.0, spec) == spec
    names = {each.name for each in load_problem(SMOKE, ["constraints.any_speed=true"]).constraints}
    assert "joint_torque_standing" in names


@pytest.mark.long
@pytest.mark.parametrize(
    "trajectory",
    [
        "{harmonics: 4, base_frequency: 1.0471975511965976}",
        "{harmonics: 4, base_frequency: 1.0471975511965976, at_rest: true}",
        "{family: bspline, duration: 6}",
    ],
)
def test_a_campaign_moves_from_rest_to_rest(trajectory: str) -> None:
    spec = from_rest(load_spec(SMOKE, [f"trajectory={trajectory}"]))
    built = problem_of(Case(spec, SMOKE.parent, ROBOT))
    q, v, a = built.trajectory.states(
        np.array([0.0, built.trajectory.duration]), one_motion(built).coefficients
    )
    np.testing.assert_allclose(q, np.array([built.robot.posture] * 2), atol=1e-9)
    np.testing.assert_allclose([v, a], 0.0, atol=1e-9)


@pytest.mark.parametrize(
    "trajectory",
    [
        "{harmonics: 2}",
        "{family: bspline, duration: 6, control_points: 11, at_rest: false}",
        "{at_rest: true, start: {elbow: 0.5}}",
    ],
)
def test_what_cannot_begin_there_or_begins_elsewhere_stays(trajectory: str) -> None:
    spec = load_spec(SMOKE, [f"trajectory={trajectory}"])
    assert from_rest(spec) == spec


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
