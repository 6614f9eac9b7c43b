"""A constraint that the program has never seen, in one file and a line of the catalogue."""

import numpy as np
import pytest

from excite_cli.config.load_spec import parse_spec, spec_as_yaml
from excite_cli.constraints.catalogue import CONSTRAINTS
from excite_cli.errors import ConfigError
from excite_cli.excitation.admissible import path_of, worst_margins
from excite_cli.excitation.inspection import Look, inspect
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.report.motion_chart import margin_charts
from excite_cli.summary.result_page import margin_section, motion_section
from excite_cli.trajectory.fade import Segment
from excite_cli.view.instants import instants_of
from excite_cli.view.scene import build_scene
from tests.excitation.smoke import planned, smoke

from .joint_power import JointPower

COMMON = ["optimizer.max_iterations=40", "sequence.motions=1"]
LIMIT = 4.0  # [W]


@pytest.fixture(scope="module", autouse=True)
def catalogue_line() -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(CONSTRAINTS.members, "joint_power", JointPower)
        yield


def _problem(*settings: str) -> Problem:
    return smoke(*COMMON, *settings)


@pytest.fixture(scope="module")
def kept() -> tuple[Problem, Result]:
    problem = _problem(f"constraints.own.joint_power.limit={LIMIT}")
    return problem, planned(problem)


@pytest.mark.long
def test_with_it_the_limit_holds_and_without_it_is_broken(kept: tuple[Problem, Result]) -> None:
    problem, result = kept
    assert problem.constraints[-1].name == "joint_power"
    assert worst_margins(problem, result.motions[0].coefficients)["joint_power"].margin >= 0
    free = planned(_problem()).motions[0]
    assert "joint_power" not in free.margins
    broken = worst_margins(problem, free.coefficients)["joint_power"]
    assert broken.margin < -0.5
    assert broken.unit == "W"


def test_check_judges_it(kept: tuple[Problem, Result]) -> None:
    problem, result = kept
    (motion,) = result.motions

    def judged(coefficients: np.ndarray) -> tuple[int, str]:
        path = path_of(problem, problem.trajectory, coefficients)
        found = inspect(problem, path, None, Look(rate=200.0))
        return found.worst["joint_power"].violations, found.states["joint_power"][0]

    assert judged(motion.coefficients) == (0, "sampled")
    violations, state = judged(2.0 * motion.coefficients)
    assert violations > 0
    assert state == "broken"


def test_reports_and_views_show_it(kept: tuple[Problem, Result]) -> None:
    problem, result = kept
    (motion,) = result.motions
    assert "Joint power" in str(margin_section(result, problem))
    assert motion_section(result, problem).blocks
    assert "[W]" in str(margin_charts(problem, motion)["joint_power"])
    segment = Segment("motion_1", problem.trajectory, motion.coefficients)
    shown = instants_of(problem, segment, np.linspace(0.0, 6.0, 5))
    assert shown.margins[-1].name == "joint_power"
    assert build_scene(problem, [shown.q]).capsules
    stored = parse_spec(spec_as_yaml(problem.spec))
    assert stored.constraints.own == {"joint_power": {"limit": LIMIT}}


@pytest.mark.parametrize(
    ("own", "words"),
    [
        ("{joint_powr: {limit: 3}}", "own.joint_powr: there is no .* Did you mean 'joint_power'"),
        (
            "{torque: {scale: 1}}",
            "own.torque: there is no constraint 'torque'.* Known: joint_power",
        ),
        ("{joint_power: {limits: 3}}", "own.joint_power: .*'limit'.* Settings: limit"),
        ("{joint_power: {}}", "own.joint_power: missing .*'limit'"),
    ],
)
def test_wrong_names_are_told(own: str, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        _problem(f"constraints.own={own}")


def test_without_any_there_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also not one with a section of its own."""
    monkeypatch.delitem(CONSTRAINTS.members, "joint_power")
    with pytest.raises(ConfigError, match=r"own\.torque: there is no constraint .* Known: none"):
        _problem("constraints.own={torque: {scale: 1}}")


def test_two_of_one_name_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Verdicts go by name: one would hide the other."""
    monkeypatch.setattr(JointPower, "name", "joint_torque")
    with pytest.raises(ConfigError, match="2 are called 'joint_torque'"):
        _problem("constraints.own.joint_power.limit=3")
