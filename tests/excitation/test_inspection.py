"""Motions judged between the instants looked at: a second computation of distances, true meshes,
certificates in odd cases, and the instant at which something is nearest.
"""

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from excite_cli.config.load_spec import parse_spec
from excite_cli.constraints.self_collision import SelfCollision
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.excitation.admissible import Path as MotionPath
from excite_cli.excitation.admissible import path_of, verdicts
from excite_cli.excitation.inspection import Inspection, Look, inspect, mesh_check_of, mesh_verdict
from excite_cli.excitation.nearest import closest_time, nearest_bodies
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.geometry.link_meshes import Poses
from excite_cli.geometry.mesh_check import MeshCheck
from excite_cli.geometry.mesh_distances import CoalDistances
from excite_cli.geometry.obstacle_pairs import ObstacleDistances
from excite_cli.geometry.pair_distances import PairDistances
from excite_cli.trajectory.fade import Segment
from tests.excitation.smoke import CONFIG, drawn, smoke

AROUND = (
    "constraints.surroundings={floor: -0.6, boxes: {shelf: {size: [0.2, 0.4, 0.05], position: "
    "[0.6, 0, 0.2], orientation: [0.1, 0.2, 0.3]}}, walls: {left: {point: [0, 1.2, 0], normal: "
    "[0.1, -1, 0]}}}"
)


@pytest.fixture(scope="module")
def problem() -> Problem:
    return smoke(AROUND)


def _seen(
    problem: Problem, alpha: np.ndarray, check: MeshCheck | None = None, **look: float
) -> Inspection:
    path = path_of(problem, problem.trajectory, alpha)
    return inspect(problem, path, check, Look(**look))


def _inspected(problem: Problem) -> Inspection:
    return _seen(problem, problem.still(problem.robot.posture) + drawn(problem, 0.15), rate=200.0)


def test_both_computations_agree(problem: Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    found = _inspected(problem)
    assert [each.name for each in found.second] == ["self_collision", "surroundings"]
    for each in found.second:
        assert each.difference < 1e-9
        assert each.agrees
        assert 250 <= each.instants < each.of == 1201
    assert not found.disagreeing
    own = PairDistances.distances
    monkeypatch.setattr(PairDistances, "distances", lambda *args, **kw: own(*args, **kw) + 5e-7)
    again = _inspected(problem)
    assert not again.disagreeing
    worst = again.worst["self_collision"]
    assert worst == found.worst["self_collision"], "it is that of the second computation"


@pytest.mark.parametrize(
    ("kind", "name"), [(PairDistances, "self_collision"), (ObstacleDistances, "surroundings")]
)
def test_a_wrong_distance_of_our_own_is_found(
    problem: Problem, monkeypatch: pytest.MonkeyPatch, kind: type, name: str
) -> None:
    """One millimetre too much, for one pair, in a tenth of its range."""
    before, own = _inspected(problem).violations, kind.distances

    def wrong(self: PairDistances, q: States, **kw: float) -> np.ndarray:
        found = own(self, q, **kw).copy()
        column = found[:, 0]
        column[column < np.quantile(column, 0.1)] += 1e-3
        return found

    monkeypatch.setattr(kind, "distances", wrong)
    found = _inspected(problem)
    (off,) = found.disagreeing
    assert off.name == name
    assert off.difference == pytest.approx(1e-3, rel=1e-6)
    assert off.label == next(c for c in problem.constraints if c.name == name).labels[0]
    assert found.violations == before + 1


CLEAR = np.array([0.0, 0.6, 0.8, 0.0, 0.05])
IN_CONTACT = np.array([0.87, -1.65, -2.39, -1.81, 0.07])


@pytest.fixture(scope="module")
def clear() -> Problem:
    return smoke()


@pytest.fixture(scope="module")
def meshes(clear: Problem) -> MeshCheck:
    found = mesh_check_of(clear)
    assert found is not None
    return found


def towards_contact(clear: Problem, share: float) -> np.ndarray:
    """One swing from a clear posture towards one in contact."""
    still = clear.still(CLEAR + share * (IN_CONTACT - CLEAR) / 2)
    harmonics = (len(still) - 1) // 2
    still[harmonics] = share * (IN_CONTACT - CLEAR) / 2  # cosine of the base frequency
    return still


def test_a_short_contact_between_samples_is_found(clear: Problem, meshes: MeshCheck) -> None:
    def path(share: float) -> MotionPath:
        return path_of(clear, clear.trajectory, towards_contact(clear, share))

    fine = np.linspace(0, 6.0, 6001)
    low, high = 0.0, 1.0
    for _ in range(40):
        share = (low + high) / 2
        gaps = meshes.least(path(share).states_at(fine[:200]).q)
        touching = sum(gap.touching for gap in gaps.broken)  # half of it, the swing being even
        if touching == 1:
            break
        low, high = (low, share) if touching > 1 else (share, high)
    assert touching == 1
    away = np.linspace(0.05, 5.95, 60)  # none at the moment of contact
    verdict = mesh_verdict(path(share), meshes, away)
    assert not verdict.gaps.broken
    assert verdict.state == "broken"
    assert "between" in verdict.reason
    apart = mesh_verdict(path(0.3), meshes, np.linspace(0, 6, 100))
    assert apart.proved
    assert apart.worst().margin > 0


def test_inspection_counts_what_is_only_between(clear: Problem, meshes: MeshCheck) -> None:
    """A limit broken between the instants that were looked at counts as one violation."""
    alpha = clear.still(CLEAR)
    alpha[-1, 0], alpha[0, 0] = 1.9, 1.0 + 1e-3  # the yaw swings a thousandth too far, at 1.5 s
    seen = _seen(clear, alpha, rate=1.0)  # t = 0, 1, … 6: not at 1.5
    assert all(worst.violations == 0 for worst in seen.worst.values())
    assert seen.violations == 1
    margin = seen.margins["joint_position"]
    assert margin.margin == pytest.approx(-1e-3, abs=2e-4)
    assert margin.time == pytest.approx(1.5, abs=0.1)
    assert seen.certified["joint_position"] is False
    assert seen.meshes is None
    still = _seen(clear, clear.still(CLEAR), meshes, rate=10.0, random=20)
    assert still.violations == 0
    assert all(still.certified.values())


DATA = CONFIG.parents[1] / "data"
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
    assert _seen(problem, still).violations == 0


def test_pairs_beyond_the_limits_are_checked_where_limits_are_not_kept() -> None:
    narrow = HEAD + ", limits: {elbow: {position: [0, 1]}}}\n"
    rest = "constraints: {joint_limits: {position: %s}, self_collision: {margin: 0.0}}\n"
    free, kept = problem_of(narrow + rest % "false"), problem_of(narrow + rest % "true")
    apart = [
        next(c for c in of.constraints if c.name == "self_collision").labels for of in (free, kept)
    ]
    assert len(apart[0]) > len(apart[1])
    folded = free.still(np.array([0.0, 0.6, 3.0, 0.0, 0.05]))
    states = {v.name: v.state for v in verdicts(free, folded)}
    assert states["self_collision"] == "broken"


def test_distances_are_not_proved_beyond_the_limits_they_were_chosen_for() -> None:
    problem = problem_of(
        HEAD + "}\nconstraints: {self_collision: {margin: 0.0}}\n"
        "trajectory: {harmonics: 2, base_frequency: 1.0}"
    )
    seen = _seen(problem, problem.still(np.array([3.2, 0.6, 0.8, 0.0, 0.05])), rate=10)
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
    seen = _seen(problem, problem.still(problem.robot.posture), mesh_check_of(problem), rate=10)
    assert seen.violations == 0
    assert all(seen.certified.values())


def test_capsules_by_hand_on_a_robot_without_meshes(tmp_path: Path) -> None:
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


def _moving(problem: Problem) -> Segment:
    wild = problem.still(problem.robot.posture) + drawn(problem, 0.15)
    return Segment("motion", problem.trajectory, wild)


def test_no_other_instant_is_nearer(clear: Problem) -> None:
    """By distances of coal."""
    segment = _moving(clear)
    kept = next(each for each in clear.constraints if isinstance(each, SelfCollision))
    coal = CoalDistances(clear.robot, kept.capsules, kept.pairs.checked)
    at = closest_time(clear, segment)
    times = np.linspace(0.0, segment.trajectory.duration, 400)
    q = segment.trajectory.states(np.append(times, at), segment.coefficients)[0]
    distances = coal.distances(q).min(axis=1)
    assert distances[-1] <= distances[:-1].min() + 2e-3
    assert distances[-1] < np.median(distances) - 0.01


def test_without_distances_it_is_the_start_and_nothing_is_near() -> None:
    problem = smoke("constraints.self_collision=null")
    segment = _moving(problem)
    assert closest_time(problem, segment) == 0.0
    at = np.array([1.0])
    states = States.along(problem.kinematics, segment.trajectory, segment.coefficients, at)
    margins = [constraint.margins(states) for constraint in problem.constraints]
    assert nearest_bodies(problem, Poses.of(problem.robot, states.q), margins) is None


def test_of_several_distances_the_least_counts() -> None:
    t = np.linspace(0.0, 1.0, 101)
    kept = [2.0 - t, 1.0 + 4.0 * np.square(t - 0.25) - 0.5]  # least: 1 at the end, 0.5 at 0.25
    constraints = [
        SimpleNamespace(
            margins=lambda states, m=m: m[:, None], drawing=SimpleNamespace(capsules=True)
        )
        for m in kept
    ]
    trajectory = SimpleNamespace(
        duration=1.0, orders=lambda times, coefficients: (times[:, None],) * 4
    )
    problem: Any = SimpleNamespace(kinematics=None, constraints=constraints)
    segment: Any = SimpleNamespace(trajectory=trajectory, coefficients=None)
    assert closest_time(problem, segment) == pytest.approx(0.25)
