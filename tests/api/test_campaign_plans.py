"""What the motions of a campaign are planned for."""

from excite_cli.api.campaign_plans import at_pace, on_robot
from excite_cli.api.loading import load_problem
from excite_cli.config.load_spec import load_spec
from excite_cli.diagnosis.records import EffectRecord
from tests.cli.program import SMOKE


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


def test_what_is_played_slowly_is_planned_for_any_lower_speed() -> None:
    spec = load_spec(SMOKE)
    assert not spec.constraints.any_speed
    assert at_pace(0.4, spec).constraints.any_speed
    assert at_pace(1.0, spec) == spec
    names = {each.name for each in load_problem(SMOKE, ["constraints.any_speed=true"]).constraints}
    assert "joint_torque_standing" in names
