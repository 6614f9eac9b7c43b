"""A gripper whose fingers follow, on a wrist of two motors: from its URDF to a named effect."""

from pathlib import Path

import pytest

from excite_cli import check, diagnose, load_problem, plan, simulate
from excite_cli.proposal.propose import Request, propose
from tests.robot.coupled_robots import HAND, written

pytest.importorskip("mujoco")

JOINTS = ("shoulder", "wrist", "finger_1")
MOTORS = """  transmissions:
    - {joints: [shoulder, wrist], motors: [m1, m2], matrix: [[0.5, 0.5], [0.4, -0.6]],
       limits: {m1: {velocity: 2.0}}}
"""


def test_friction_of_the_gripper_is_found(tmp_path: Path) -> None:
    proposal = propose(Request(Path(written(tmp_path, HAND)).name, tmp_path, JOINTS))
    assert proposal.joints == JOINTS
    assert "moved with finger_1: finger_2" in proposal.notes
    config = tmp_path / "hand.yaml"
    config.write_text(proposal.text.replace("  posture:", f"{MOTORS}  posture:"))
    problem = load_problem(config, ["optimizer.max_iterations=25", "sequence.motions=2"])
    result = plan(problem, output=tmp_path / "hand.h5")
    for each in check(problem, result).values():
        assert not each.violations
        states = {name: state for name, (state, _) in each.states.items()}
        assert states["self_collision"] == states["motor_velocity"] == "proved"
    played = simulate(problem, result, ["viscous_friction@finger_1=2"])
    found = diagnose(problem, played.dataset)
    (named,) = found.effects
    assert (named.effect.kind, named.effect.joints) == ("viscous_friction", ("finger_1",))
    assert named.parameters["viscous"].value == pytest.approx(2.0, rel=0.02)
    assert found.after.mean_relative_moving < 0.01
