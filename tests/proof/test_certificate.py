"""A limit broken for two milliseconds between samples is found, whatever the limit.

Every constraint of the program is met with a motion about a posture that is swollen until the
margin is negative for about two milliseconds: what samples every 20 ms may well miss.
"""

from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.load_spec import parse_spec
from excite_cli.constraints.base import Constraint
from excite_cli.excitation.admissible import lacking_margins, path_of, verdicts
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.proof.certificate import certify
from excite_cli.trajectory.base import Trajectory
from excite_cli.trajectory.bspline import BSplineTrajectory
from excite_cli.trajectory.fourier import FourierTrajectory

DATA = Path(__file__).parents[2] / "data"
CONFIG = """
robot:
  urdf: smoke_arm.urdf
  posture: {shoulder_pitch: 0.9, elbow: 1.0, slide: 0.07}
  limits: {elbow: {effort_by_speed: [[0, 20], [0.3, 18], [0.8, 9], [2, 6]]}}
  payload: {link: tool, mass: 0.5, center: [0, 0, 0.1], start: [0, 0, 0.08], end: [0, 0, 0.14],
            radius: 0.03}
trajectory: {family: fourier, harmonics: 3, base_frequency: 1.2}
constraints:
  joint_limits: {acceleration: 10.0, jerk: 12.0}
  torque: {scale: 0.6}
  balance: {kind: polygon, vertices: [[-0.14, -0.14], [0.14, -0.14], [0.14, 0.14], [-0.14, 0.14]]}
  contact:
    vertices: [[-0.25, -0.25], [0.25, -0.25], [0.25, 0.25], [-0.25, 0.25]]
    friction: 0.3
    torsion: 0.2
  self_collision: {margin: 0.01}
  surroundings:
    floor: 0.0
    walls: {side: {point: [0, -0.75, 0], normal: [0, 1, 0]}}
    boxes:
      shelf: {size: [0.3, 0.6, 0.05], position: [0.75, 0.1, 0.75], orientation: [0, 0.3, 0.2]}
    ignore: [[base, floor]]
  keep_out: {corner: {shoulder_pitch: [1.4, 2.2], elbow: [1.4, 2.6]}}
"""
UNCERTAIN = CONFIG + "uncertainty: {mass: 0.05, center_of_mass: 0.005, inertia: 0.1}\n"
FAMILIES = {"fourier": FourierTrajectory(3, 1.2), "bspline": BSplineTrajectory(5.0, 12, 5)}
KINDS = [
    "joint_position", "joint_velocity", "joint_acceleration", "joint_jerk", "joint_torque",
    "balance", "zmp", "contact", "self_collision", "surroundings", "keep_out",
]  # fmt: skip


@pytest.fixture(scope="module", params=["known", "uncertain"])
def problem(request: pytest.FixtureRequest) -> Problem:
    text = CONFIG if request.param == "known" else UNCERTAIN
    return build_problem(parse_spec(text, "arm.yaml"), DATA)


def swollen(problem: Problem, family: Trajectory, seed: int, share: float) -> np.ndarray:
    """A random motion about the posture with amplitudes falling with the frequency."""
    rng = np.random.default_rng(seed)
    shape = (family.n_coefficients, problem.robot.n)
    return family.constant(problem.robot.posture) + share * rng.normal(size=shape) * [
        1.0, 0.8, 0.8, 1.0, 0.03
    ]  # fmt: skip


def broken_time(path, constraint: Constraint, times: np.ndarray) -> tuple[float, float]:
    """For how long the margin is negative, and an instant at which it is."""
    margins = constraint.margins(path.states_at(times)).min(axis=1)
    step = times[1] - times[0]
    return float((margins < 0).sum() * step), float(times[int(np.argmin(margins))])


def barely_broken(problem: Problem, family: Trajectory, constraint: Constraint, seed: int):
    """A motion that breaks the constraint for about 2 ms, and when; None if none is found."""
    coarse = np.linspace(0.0, family.duration, 801)

    def path(share: float):
        return path_of(problem, family, swollen(problem, family, seed, share))

    low, high = 0.0, None
    for share in np.geomspace(0.03, 1.2, 25):
        if broken_time(path(share), constraint, coarse)[0] > 0:
            high = float(share)
            break
        low = float(share)
    if high is None or low == 0.0:
        return None
    for _ in range(30):
        middle = (low + high) / 2
        lasting, when = broken_time(path(middle), constraint, coarse)
        fine = np.linspace(max(0.0, when - 0.004), min(family.duration, when + 0.004), 161)
        lasting, when = broken_time(path(middle), constraint, fine)
        if 0.001 <= lasting <= 0.003:
            return path(middle), when
        low, high = (low, middle) if lasting > 0.002 else (middle, high)
    return None


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("kind", KINDS)
def test_two_milliseconds_are_found(problem: Problem, family: str, kind: str) -> None:
    constraint = next(c for c in problem.constraints if c.name == kind)
    for seed in range(12):
        found = barely_broken(problem, FAMILIES[family], constraint, seed)
        if found is not None:
            break
    else:
        pytest.fail(f"no motion of the test breaks {kind} briefly")
    path, when = found
    (verdict,) = certify(path, [constraint])
    assert verdict.state == "broken"
    assert verdict.time == pytest.approx(when, abs=0.005)
    assert verdict.margin < 0
    assert verdict.lacking.max() > 0
    assert verdict.label in constraint.labels


@pytest.mark.parametrize("family", FAMILIES)
def test_what_is_proved_holds_at_random_instants(problem: Problem, family: str) -> None:
    trajectory = FAMILIES[family]
    proved = 0
    for seed in range(4):
        path = path_of(problem, trajectory, swollen(problem, trajectory, seed, 0.15))
        times = np.random.default_rng(seed).uniform(0, trajectory.duration, 3000)
        states = path.states_at(times)
        for verdict, constraint in zip(
            certify(path, problem.constraints), problem.constraints, strict=True
        ):
            least = constraint.margins(states).min()
            if verdict.proved:
                proved += 1
                assert least >= 0, constraint.name
            assert verdict.state != "broken" or verdict.margin < 0
            assert least > 1e-6 or verdict.state != "sampled"
    assert proved > 10


def test_a_constraint_without_a_bound_is_sampled_only(
    problem: Problem, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is called proved for want of a bound, or by one that is no number."""
    first = problem.constraints[0]
    path = path_of(problem, problem.trajectory, problem.still(problem.robot.posture))
    monkeypatch.setattr(type(first), "least", lambda self, motion: None)
    (verdict,) = certify(path, [first])
    assert verdict.state == "sampled"
    assert "no bound" in verdict.reason
    assert not verdict.bounded
    nothing = np.nan * np.zeros(len(first.labels))
    monkeypatch.setattr(type(first), "least", lambda self, m: np.tile(nothing, (m.count, 1)))
    (verdict,) = certify(path, [first])
    assert verdict.state == "sampled"
    assert "too many intervals" in verdict.reason


def test_lacking_margins_speak_of_all_instants(problem: Problem) -> None:
    still = problem.still(problem.robot.posture)
    assert not any(lack.any() for lack in lacking_margins(problem, still))
    assert all(verdict.proved for verdict in verdicts(problem, still))
    moved = still.copy()
    moved[-1, 1] = 2.3  # the shoulder beyond its limit
    lacking = lacking_margins(problem, moved)[0]
    assert lacking.max() == pytest.approx(0.1, abs=1e-9)
