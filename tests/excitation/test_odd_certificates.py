"""What a review of the certificates found, kept from coming back."""

from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.load import parse_spec
from excite_cli.excitation.admissible import path_of, verdicts
from excite_cli.excitation.inspection import Look, inspect, mesh_check_of
from excite_cli.excitation.problem import Problem, build_problem

DATA = Path(__file__).parents[2] / "data"
HEAD = "robot: {urdf: smoke_arm.urdf, posture: {shoulder_pitch: 0.6, elbow: 0.8, slide: 0.05}"


def problem_of(text: str, folder: Path = DATA) -> Problem:
    return build_problem(parse_spec(text, "arm.yaml"), folder)


@pytest.mark.parametrize(
    "trajectory", ["", "trajectory: {family: bspline, duration: 4, degree: 7, control_points: 14}"]
)
def test_standing_at_a_limit_is_allowed(trajectory: str) -> None:
    head = "robot: {urdf: smoke_arm.urdf, posture: {shoulder_yaw: 2.9, slide: 0.15}}\n"
    problem = problem_of(head + trajectory)
    still = problem.still(problem.robot.posture)
    assert all(verdict.proved for verdict in verdicts(problem, still))
    seen = inspect(problem, path_of(problem, problem.trajectory, still), None, Look())
    assert seen.violations == 0


def test_pairs_beyond_the_limits_are_checked_where_limits_are_not_kept() -> None:
    narrow = HEAD + ", limits: {elbow: {position: [0, 1]}}}\n"
    rest = "constraints: {joint_limits: {position: %s}, self_collision: {margin: 0.0}}\n"
    free, kept = problem_of(narrow + rest % "false"), problem_of(narrow + rest % "true")
    count = {
        name: len(next(c for c in of.constraints if c.name == "self_collision").labels)
        for name, of in (("free", free), ("kept", kept))
    }
    assert count["free"] > count["kept"]
    folded = free.still(np.array([0.0, 0.6, 3.0, 0.0, 0.05]))
    states = {v.name: v.state for v in verdicts(free, folded)}
    assert states["self_collision"] == "broken"


def test_distances_are_not_proved_beyond_the_limits_they_were_chosen_for() -> None:
    problem = problem_of(
        HEAD + "}\nconstraints: {self_collision: {margin: 0.0}}\n"
        "trajectory: {harmonics: 2, base_frequency: 1.0}"
    )
    beyond = problem.still(np.array([3.2, 0.6, 0.8, 0.0, 0.05]))
    seen = inspect(problem, path_of(problem, problem.trajectory, beyond), None, Look(rate=10))
    assert seen.states["joint_position"][0] == "broken"
    state, reason = seen.states["self_collision"]
    assert state == "sampled"
    assert "position limits" in reason


@pytest.mark.parametrize("joint", ["slide", "wrist_roll", "elbow"])
def test_one_moved_joint(joint: str) -> None:
    head = f"robot: {{urdf: smoke_arm.urdf, joints: [{joint}], posture: {{slide: 0.05}}}}\n"
    problem = problem_of(
        head + "criterion: {kind: log_det}\nconstraints: {self_collision: {margin: 0.0}}\n"
    )
    still = problem.still(problem.robot.posture)
    check = mesh_check_of(problem)
    seen = inspect(problem, path_of(problem, problem.trajectory, still), check, Look(rate=10))
    assert seen.violations == 0
    assert all(seen.certified.values())


def test_capsules_by_hand_on_a_robot_without_meshes(tmp_path: Path) -> None:
    import re

    bare = re.sub(r"<collision>.*?</collision>", "", (DATA / "smoke_arm.urdf").read_text())
    (tmp_path / "smoke_arm.urdf").write_text(bare)
    capsule = "{start: [0, 0, 0], end: [0, 0, 0.1], radius: 0.03}"
    problem = problem_of(
        HEAD + "}\nconstraints:\n  self_collision: {margin: 0.0, capsules: {base: "
        f"{capsule}, forearm: {capsule}, tool: {capsule}}}}}\n",
        tmp_path,
    )
    assert mesh_check_of(problem) is None
    assert any(c.name == "self_collision" for c in problem.constraints)
