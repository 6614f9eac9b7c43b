"""A campaign that begins slowly: no seconds on ways, full pace as soon as the model allows it."""

from pathlib import Path

import pytest

from excite_cli.api import campaign_plans
from excite_cli.api.campaigning import Campaign, CampaignOptions, Simulated, run_campaign
from excite_cli.api.loading import load_case
from excite_cli.config.load_spec import parse_spec
from excite_cli.errors import ConfigError
from excite_cli.store.result_file import read_result
from tests.cli.program import SMOKE

CHANGES = (
    "optimizer.max_iterations=15",
    "optimizer.restarts=1",
    "diagnosis.kinds=[spring, viscous_friction, coulomb_friction]",
)


def _campaign(folder: Path, rounds: int, *changes: str, entry: bool = True) -> Campaign:
    case = load_case(SMOKE, [*CHANGES, *changes])
    measure = Simulated(case, ("spring@elbow=6",))
    asked = CampaignOptions(from_speed=0.4, most_rounds=rounds, entry=entry)
    return run_campaign(case, measure, folder, asked, tell=lambda note: None)


@pytest.mark.parametrize(("allowed", "pace"), [(True, 1.0), (False, 0.8)])
def test_the_second_round_is_as_fast_as_the_model_allows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, allowed: bool, pace: float
) -> None:
    monkeypatch.setattr(campaign_plans, "within_torque", lambda *given: allowed)
    found = _campaign(tmp_path / "a", 2)
    assert found.rounds[0].learned is not None
    assert not found.rounds[0].learned.open
    assert [each.pace for each in found.rounds] == [0.4, pace]
    assert [each.seconds for each in found.motions] == pytest.approx([6.0] * 5)
    assert (found.ended == "complete") == allowed
    for motion in found.motions:
        spec = parse_spec(read_result(tmp_path / "a" / motion.plan).config, motion.plan)
        assert spec.trajectory.at_rest
        assert spec.trajectory.start == "posture"
        limits = spec.constraints.joint_limits
        assert limits is not None
        assert limits.pace == motion.pace


def test_where_the_posture_leaves_no_room_motions_are_entered(tmp_path: Path) -> None:
    """Of the config's trajectory, from the posture all the same."""
    case = load_case(SMOKE, [*CHANGES, "robot.posture.elbow=2.5999"])
    found = _campaign(tmp_path / "a", 1, "robot.posture.elbow=2.5999")
    spec = parse_spec(read_result(tmp_path / "a" / "round_1.h5").config, "round 1")
    assert spec.trajectory == case.spec.trajectory
    assert all(each.seconds > 6.0 for each in found.motions)


def test_without_entry_motions_stay_as_the_config_has_them(tmp_path: Path) -> None:
    _campaign(tmp_path / "a", 1, entry=False)
    spec = parse_spec(read_result(tmp_path / "a" / "round_1.h5").config, "round 1")
    assert not spec.trajectory.at_rest


def test_sizes_of_effects_do_not_end_a_campaign(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"sequence\.until\.power: a campaign plans until"):
        _campaign(tmp_path / "a", 1, "sequence={until: {power: {spring: 1}}}")
    assert not (tmp_path / "a").exists()
