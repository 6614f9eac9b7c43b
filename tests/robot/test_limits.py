"""Position limits that are equal, reversed or missing: in every format, and through mimic."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.config.load import parse_spec
from excite_cli.config.robot_spec import JointLimits, RobotSpec
from excite_cli.errors import ConfigError, RobotError
from excite_cli.excitation.problem import build_problem
from excite_cli.proposal.joints import choose_joints
from excite_cli.proposal.limits import plan_limits
from excite_cli.proposal.propose import Proposal, Request, propose
from excite_cli.robot.description import load_description
from excite_cli.robot.model import build_robot
from excite_cli.robot.urdf_joints import survey
from excite_cli.shown.note import Level
from excite_cli.summary.problem import problem_notes
from tests.proposal.robots import GOOD, joint, link, written

KINDS = {"revolute": "hinge", "prismatic": "slide"}


def urdf(lower: float, upper: float, kind: str) -> str:
    limit = f'lower="{lower}" upper="{upper}" velocity="3" effort="50"'
    parts = [
        link("base"),
        joint("shoulder", "base", "upper", GOOD),
        link("upper"),
        joint("odd", "upper", "tip", limit, kind),
        link("tip"),
    ]
    return '<robot name="robot">' + "".join(parts) + "</robot>"


def xacro(lower: float, upper: float, kind: str) -> str:
    text = urdf(lower, upper, kind).replace(f'lower="{lower}"', 'lower="${low}"')
    head = '<robot name="robot" xmlns:xacro="http://www.ros.org/wiki/xacro">'
    return text.replace(
        '<robot name="robot">', f'{head}<xacro:property name="low" value="{lower}"/>'
    )


def mjcf(lower: float, upper: float, kind: str, more: str = "") -> str:
    turn = 180 / math.pi if kind == "revolute" else 1.0  # degrees are the default
    bounds = f'range="{lower * turn!r} {upper * turn!r}" {more}'
    shape = '<geom type="box" size="0.05 0.05 0.1" pos="0 0 0.1" mass="1"/>'
    return (
        '<mujoco><worldbody><body name="upper"><joint name="shoulder" axis="0 1 0" '
        f'range="-110 110"/>{shape}<body name="tip" pos="0 0 0.25"><joint name="odd" '
        f'type="{KINDS[kind]}" axis="0 1 0" {bounds}/>{shape}</body></body></worldbody></mujoco>'
    )


def sdf(lower: float, upper: float, kind: str) -> str:
    def link_of(name: str, height: float) -> str:
        inertia = "".join(f"<{k}>0.01</{k}>" for k in ("ixx", "iyy", "izz"))
        return (
            f'<link name="{name}"><pose>0 0 {height} 0 0 0</pose><inertial><mass>1</mass>'
            f"<inertia>{inertia}</inertia></inertial></link>"
        )

    def joint_of(name: str, type_: str, ends: tuple[str, str], low: float, high: float) -> str:
        limit = f"<limit><lower>{low}</lower><upper>{high}</upper><effort>50</effort></limit>"
        between = f"<parent>{ends[0]}</parent><child>{ends[1]}</child>"
        return (
            f'<joint name="{name}" type="{type_}">{between}'
            f"<axis><xyz>0 1 0</xyz>{limit}</axis></joint>"
        )

    return (
        '<sdf version="1.8"><model name="robot">'
        + "".join(link_of(name, k * 0.25) for k, name in enumerate(("base", "upper", "tip")))
        + joint_of("shoulder", "revolute", ("base", "upper"), -2, 2)
        + joint_of("odd", kind, ("upper", "tip"), lower, upper)
        + "</model></sdf>"
    )


FORMATS = {
    "robot.urdf": urdf,
    "robot.urdf.xacro": xacro,
    "robot.xml": mjcf,
    "limited.xml": lambda low, high, kind: mjcf(low, high, kind, 'limited="true"'),
    "robot.sdf": sdf,
}


def made(folder: Path, name: str, lower: float, upper: float, kind: str = "revolute") -> Path:
    path = folder / name
    path.write_text(FORMATS[name](lower, upper, kind), encoding="utf-8")
    return path


def proposed(path: Path, joints: tuple[str, ...] = ()) -> Proposal:
    return propose(Request(path.name, path.parent, joints))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", FORMATS)
def test_equal_limits_hold_a_joint(tmp_path: Path, name: str, kind: str) -> None:
    path = made(tmp_path, name, 0.05, 0.05, kind)
    robot = build_robot(RobotSpec(urdf=path.name), tmp_path)
    assert robot.joint_names == ("shoulder",)
    assert robot.locked == {"odd": pytest.approx(0.05)}
    found = proposed(path)
    assert found.joints == ("shoulder",)
    assert "odd" not in found.settled.tree["robot"].get("limits", {})
    assert found.settled.tree["robot"]["posture"]["odd"] == pytest.approx(0.05)
    assert found.settled.problem.robot.locked == {"odd": pytest.approx(0.05)}
    unit = "m" if kind == "prismatic" else "rad"
    assert f"not moved, held at 0.05 {unit} by equal position limits: odd" in found.notes


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", FORMATS)
def test_reversed_limits_are_taken_the_other_way_round(
    tmp_path: Path, name: str, kind: str
) -> None:
    path = made(tmp_path, name, 0.7, 0.1, kind)
    robot = build_robot(RobotSpec(urdf=path.name), tmp_path)
    np.testing.assert_allclose([robot.limits.lower[1], robot.limits.upper[1]], [0.1, 0.7])
    found = proposed(path)
    limits = found.settled.problem.robot.limits
    np.testing.assert_allclose([limits.lower[1], limits.upper[1]], [0.1, 0.7])
    told = f"the position limits of odd are reversed in {name}, 0.7 to 0.1: they are taken as 0.1"
    assert any(note.startswith(told) for note in found.notes)
    said = list(problem_notes(found.settled.problem))
    assert any(note.text.startswith(told) and note.level is Level.WARNING for note in said)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", FORMATS)
def test_zero_and_zero_is_no_limit(tmp_path: Path, name: str, kind: str) -> None:
    found = proposed(made(tmp_path, name, 0.0, 0.0, kind))
    reach = 0.1 if kind == "prismatic" else 3.1
    assert found.settled.tree["robot"]["limits"]["odd"]["position"] == [-reach, reach]
    assert any(
        "assumed" in note and note.startswith("odd: the URDF gives no") for note in found.notes
    )


def test_a_config_still_moves_what_the_file_holds(tmp_path: Path) -> None:
    spec = RobotSpec(urdf=made(tmp_path, "robot.urdf", 0.5, 0.5).name)
    given = spec.model_copy(update={"limits": {"odd": JointLimits(position=(-1.0, 0.4))}})
    robot = build_robot(given, tmp_path)
    assert (robot.limits.lower[1], robot.limits.upper[1]) == (-1.0, 0.4)
    named = spec.model_copy(update={"joints": ("odd",)})
    with pytest.raises(ConfigError, match=r"'odd' is held at 0.5 .*robot.limits.odd.position"):
        build_robot(named, tmp_path)
    elsewhere = spec.model_copy(update={"posture": {"odd": 0.7}})
    with pytest.raises(ConfigError, match=r"posture.odd: 0.7 is not where it stands, 0.5"):
        build_robot(elsewhere, tmp_path)
    near = spec.model_copy(update={"posture": {"odd": 0.5001}})
    assert build_robot(near, tmp_path).locked == {"odd": 0.5}


def test_a_config_must_give_limits_that_are_missing(tmp_path: Path) -> None:
    spec = RobotSpec(urdf=made(tmp_path, "robot.urdf", 0.0, 0.0).name)
    with pytest.raises(ConfigError, match=r"'odd' has no position limits .*limits.odd.position"):
        build_robot(spec, tmp_path)
    still = spec.model_copy(update={"joints": ("shoulder",), "posture": {"odd": 0.7}})
    assert build_robot(still, tmp_path).locked == {"odd": 0.7}


def test_what_is_held_is_said_of_all_joints(tmp_path: Path) -> None:
    made(tmp_path, "robot.urdf", 0.5, 0.5)
    text = (
        "robot: {urdf: robot.urdf}\ntrajectory: {family: fourier, harmonics: 4, "
        "base_frequency: 1.0}\nsampling: {cost: {samples: 40}, constraints: {samples: 80}}\n"
        "criterion: {kind: log_det}"
    )
    said = [n.text for n in problem_notes(build_problem(parse_spec(text, "a config"), tmp_path))]
    assert "not moved, held by equal position limits: odd at 0.5" in said


def test_joints_that_are_held_cannot_be_asked_for(tmp_path: Path) -> None:
    path = made(tmp_path, "robot.urdf", 0.5, 0.5)
    with pytest.raises(ConfigError, match=r"--joints: 'odd' is held at 0.5 by equal"):
        proposed(path, ("shoulder", "odd"))


def test_a_robot_of_which_nothing_moves(tmp_path: Path) -> None:
    held = 'lower="0.5" upper="0.5" velocity="3" effort="50"'
    path = written(tmp_path, link("base"), joint("odd", "base", "tip", held), link("tip"))
    with pytest.raises(RobotError, match="equal position limits hold every joint"):
        build_robot(RobotSpec(urdf=str(path)))
    with pytest.raises(RobotError, match=r"only held at 0\.5 rad by equal position limits: odd"):
        proposed(path)


@pytest.mark.parametrize(
    ("lower", "upper", "words"),
    [
        ("nan", "1", "is not a number of a real robot"),
        ("1", "nan", "is not a number of a real robot"),
        ("inf", "inf", "no robot can reach"),
        ("-inf", "-1e9", "no robot can reach"),
        ("2e9", "1e9", "no robot can reach"),
    ],
)
def test_limits_that_no_robot_has(tmp_path: Path, lower: str, upper: str, words: str) -> None:
    limit = f'lower="{lower}" upper="{upper}" velocity="3" effort="50"'
    path = written(tmp_path, link("base"), joint("odd", "base", "tip", limit), link("tip"))
    with pytest.raises(RobotError, match=words):
        load_description(str(path))


def follower(folder: Path, driver: str, limits: str, how: str) -> Path:
    """A joint, and one that follows it, with these limits."""
    more = f'<mimic joint="driver" {how}/>'
    return written(
        folder,
        link("base"),
        joint("shoulder", "base", "upper", GOOD),
        link("upper"),
        joint("driver", "upper", "one", f'{driver} velocity="3" effort="50"'),
        link("one"),
        joint("follower", "upper", "two", f'{limits} velocity="3" effort="50"', more=more),
        link("two"),
    )


def test_equal_limits_of_a_follower_hold_its_driver(tmp_path: Path) -> None:
    path = follower(
        tmp_path, 'lower="-1" upper="1"', 'lower="0.5" upper="0.5"', 'multiplier="2" offset="0.5"'
    )
    robot = build_robot(RobotSpec(urdf=str(path)))
    assert robot.joint_names == ("shoulder",)
    assert robot.locked == {"driver": 0.0, "follower": 0.5}
    found = proposed(path)
    assert found.joints == ("shoulder",)
    assert "not moved, held at 0 rad by equal position limits: driver" in found.notes
    assert found.settled.problem.robot.locked == robot.locked


def test_reversed_limits_of_a_follower_narrow_its_driver(tmp_path: Path) -> None:
    path = follower(tmp_path, 'lower="1" upper="-1"', 'lower="0.4" upper="-1"', 'multiplier="2"')
    robot = build_robot(RobotSpec(urdf=str(path)))
    assert (robot.limits.lower[1], robot.limits.upper[1]) == (-0.5, 0.2)
    limits = proposed(path).settled.problem.robot.limits
    assert (limits.lower[1], limits.upper[1]) == (-0.5, 0.2)


def test_followers_that_leave_no_range_do_not_widen_it(tmp_path: Path) -> None:
    path = follower(tmp_path, 'lower="-1" upper="0"', 'lower="0.5" upper="1"', 'multiplier="1"')
    with pytest.raises(ConfigError, match="leave it no range"):
        build_robot(RobotSpec(urdf=str(path)))
    found = proposed(path)
    assert found.joints == ("shoulder",)
    assert "driver" not in found.settled.tree["robot"].get("limits", {})
    with pytest.raises(ConfigError, match="'driver' has no range left"):
        proposed(path, ("driver",))


BOUND = st.one_of(
    st.sampled_from([0.0, -0.0, 0.5, -0.5, 1e-6, 30.0, 1e6, 1e9, -1e9, math.inf, -math.inf]),
    st.floats(-50, 50),
)


@settings(max_examples=300, deadline=None)
@given(lower=BOUND, upper=BOUND, kind=st.sampled_from(list(KINDS)))
def test_what_is_assumed_lies_within_what_is_given(
    tmp_path_factory: pytest.TempPathFactory, lower: float, upper: float, kind: str
) -> None:
    """Whatever a file says, a plan never leaves it: but for 0 and 0, which says nothing."""
    low, high = min(lower, upper), max(lower, upper)
    path = tmp_path_factory.getbasetemp() / "any.urdf"
    path.write_text(urdf(lower, upper, kind), encoding="utf-8")
    try:
        joints = survey(load_description(str(path))).joints
    except RobotError:
        assert low >= 1e9 or high <= -1e9
        return
    choice = choose_joints(joints, "robot", () if low == high != 0 else ("shoulder", "odd"))
    plans = {plan.name: plan for plan in plan_limits(choice.chosen)}
    if low == high != 0.0:
        assert "odd" not in plans
        return
    plan = plans["odd"]
    assert math.isfinite(plan.lower)
    assert math.isfinite(plan.upper)
    assert plan.lower < plan.upper
    if not low == high == 0.0:
        assert low <= plan.lower < plan.upper <= high
    assert ("position" in plan.notes) == ((plan.lower, plan.upper) != (low, high))
