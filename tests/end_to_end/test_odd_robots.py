"""Small and odd robots end with a motion or with one clear sentence, never with a bug."""

from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.load_spec import parse_spec
from excite_cli.errors import ConfigError, NoAdmissibleMotionError
from excite_cli.excitation.admissible import verdicts
from excite_cli.excitation.problem import Problem, build_problem
from tests.excitation.smoke import planned
from tests.urdf_elements import link, robot_text

SETTINGS = "trajectory: {harmonics: 3}\noptimizer: {max_iterations: 8}\n"


def _problem(folder: Path, joints: list[str], settings: str = SETTINGS) -> Problem:
    parts = [link("l0", 1, "0.1 0.1 0.1", "0.1 0 0.2")]
    for number, joint in enumerate(joints, start=1):
        parts.append(link(f"l{number}", 2, "0.1 0.1 0.1", "0.1 0 0.2"))
        parts.append(
            f'<joint name="j{number}" {joint}<parent link="l{number - 1}"/>'
            f'<child link="l{number}"/><origin xyz="0 0.1 0.3"/></joint>'
        )
    (folder / "r.urdf").write_text(robot_text("r", *parts))
    return build_problem(parse_spec(f"robot: {{urdf: r.urdf}}\n{settings}"), folder)


def _turns(axis: str, limit: str = 'lower="-2" upper="2" velocity="2" effort="9"') -> str:
    return f'type="revolute"><axis xyz="{axis}"/><limit {limit}/>'


def _solve(problem: Problem) -> float:
    motion = planned(problem).motions[0]
    assert all(worst.violations == 0 for worst in motion.margins.values())
    return motion.stacked_condition_number


FREE = 'type="continuous"><axis xyz="{}"/>'
ONE_SIDED = [_turns("0 1 0", 'lower="0.1" upper="1e10" velocity="2" effort="9"'), _turns("1 0 0")]


@pytest.mark.parametrize(
    "joints", [[FREE.format("0 1 0"), FREE.format("1 0 0")], [_turns("0 1 0")], ONE_SIDED]
)
def test_joints_without_bounds_alone_or_with_bounds_on_one_side(
    tmp_path: Path, joints: list[str]
) -> None:
    assert _solve(_problem(tmp_path, joints)) < 1e6


def test_one_base_parameter_has_no_condition_number(tmp_path: Path) -> None:
    slides = (
        'type="prismatic"><axis xyz="1 0 0"/><limit lower="0" upper="1" velocity="1" effort="9"/>'
    )
    with pytest.raises(ConfigError, match=r"one base parameter.*log_det"):
        _problem(tmp_path, [slides])


def test_placeholder_velocities_lose_no_parameters(tmp_path: Path) -> None:
    joints = [_turns("0 1 0"), _turns("1 0 0")]
    sane = _problem(tmp_path, joints)
    wild = _problem(tmp_path, [joint.replace('velocity="2"', 'velocity="1e6"') for joint in joints])
    assert wild.base.rank == sane.base.rank


def test_a_trajectory_too_poor_to_show_everything(tmp_path: Path) -> None:
    poor = "sampling: {cost: {samples: 40, step: 1.0e-12}}\n" + SETTINGS.replace("3", "1")
    problem = _problem(tmp_path, [_turns("0 1 0"), _turns("1 0 0"), _turns("0 0 1")], settings=poor)
    with pytest.raises(NoAdmissibleMotionError, match=r"all .* base parameters|not finite"):
        _solve(problem)


def test_a_bound_on_one_side_is_proved_too(tmp_path: Path) -> None:
    """Standing at the posture keeps it; standing beyond it does not."""
    problem = _problem(tmp_path, ONE_SIDED)
    posture = problem.robot.posture
    assert posture[0] == pytest.approx(0.6)
    assert all(verdict.proved for verdict in verdicts(problem, problem.still(posture)))
    beyond = np.where(problem.robot.limits.lower == 0.1, 0.09, posture)
    assert not np.array_equal(beyond, posture)
    states = {verdict.name: verdict.state for verdict in verdicts(problem, problem.still(beyond))}
    assert states["joint_position"] == "broken"
    assert states["joint_velocity"] == "proved"
