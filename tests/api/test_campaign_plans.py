"""What the motions of a campaign are planned for."""

import numpy as np
import pytest

from excite_cli.api.campaign_plans import at_pace, from_rest, on_robot
from excite_cli.api.loading import Case, load_case, load_problem, problem_of
from excite_cli.config.load_spec import load_spec
from excite_cli.diagnosis.records import EffectRecord
from excite_cli.excitation.time_scaling import PaceLimits
from tests.cli.program import SMOKE
from tests.excitation.smoke import one_motion

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
