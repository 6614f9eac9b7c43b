"""The description alone: mistakes planted into random arms of solid bodies, and sound ones."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from excite_cli.api.inspecting import inspect
from excite_cli.api.loading import load_case
from excite_cli.checks.all_checks import row_names, rows_of_description
from excite_cli.checks.check_result import CheckResult
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.config.spec import Spec
from excite_cli.robot.model import Array, build_robot
from tests import urdf_elements

Link = dict[str, Any]
_SIDES = ("left", "right")


def arms(seed: int, joints: int = 4) -> list[Link]:
    """Links of two arms, the right one the left's mirror image: many points of mass in a box.

    Each link stands out along x from its joint, as long as its next joint is away. Its frame and
    the axes of its inertia are turned.
    """
    rng = np.random.default_rng(seed)
    links = []
    for k in range(joints):
        size = np.array([rng.uniform(0.2, 0.5), *rng.uniform(0.08, 0.12, 2)])
        mass = rng.uniform(300.0, 2000.0) * float(size.prod())
        angles = rng.uniform(-1.0, 1.0, 3)
        points = (rng.random((200, 3)) - [0.0, 0.5, 0.5]) * size
        for side, turn in zip(_SIDES, (1.0, -1.0), strict=True):
            own = points * [1.0, turn, 1.0]
            centre = own.mean(axis=0)
            links.append({
                "name": f"{side}_{k}", "parent": f"{side}_{k - 1}" if k else "base", "mass": mass,
                "size": size, "at": links[-2]["size"][0] if k else 0.0, "centre": centre,
                "inertia": mass * inertia_of(own - centre), "turn": turn * angles,
                "limit": 'velocity="2" effort="50"',
            })  # fmt: skip
    return links


def inertia_of(points: Array) -> Array:
    """About the origin (3, 3) [m²], of points (N, 3) that weigh 1 kg together."""
    second = points.T @ points / len(points)
    return np.asarray(np.trace(second) * np.eye(3) - second)


def urdf_of(links: list[Link]) -> str:
    parts = ['<link name="base"/>']
    for link in links:
        c, s, axes = link["centre"], link["size"], Rotation.from_euler("xyz", link["turn"])
        i = axes.as_matrix().T @ link["inertia"] @ axes.as_matrix()
        moments = i[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        centre, size, turn, inertia = (
            " ".join(map(str, each)) for each in (c, s, link["turn"], moments)
        )
        shape, ends = urdf_elements.box(size, f"{s[0] / 2} 0 0"), (link["parent"], link["name"])
        limits = f'lower="-1" upper="1" {link["limit"]}'
        parts += [
            urdf_elements.link(link["name"], link["mass"], inertia, centre, shape, turn),
            urdf_elements.joint(
                f"to_{link['name']}", ends, f"{link['at']} 0 0", limits=limits, turn=turn
            ),
        ]
    return urdf_elements.robot_text("arms", *parts)


def judged(links: list[Link], **keys: Any) -> list[CheckResult]:
    """What is doubted, but for what test_bodies.py tries."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "arms.urdf").write_text(urdf_of(links), encoding="utf-8")
        spec = Spec(robot=RobotSpec(urdf="arms.urdf", **keys))
        found = rows_of_description(build_robot(spec.robot, Path(folder)), spec)
    return [each for each in found if each.kind != "impossible_body"]


seeds = st.integers(0, 10_000)
few_examples = settings(max_examples=20, deadline=None)


@few_examples
@given(seeds)
def test_sound_arms_are_quiet(seed: int) -> None:
    assert judged(arms(seed)) == []


def scaled(link: Link, mass: float = 1.0, inertia: float = 1.0, off: float = 0.0) -> None:
    """With its centre so many lengths farther off."""
    link["mass"] *= mass
    link["inertia"] = link["inertia"] * inertia
    link["centre"] = link["centre"] + off * link["size"][0]


@few_examples
@given(seeds, st.integers(0, 3))
@pytest.mark.parametrize(
    ("change", "kind"),
    [
        ({"mass": 1e3, "inertia": 1e3}, "density"),
        ({"mass": 1e-4, "inertia": 1e-4}, "density"),
        ({"inertia": 1e3}, "outside_shape"),  # in grams
        ({"off": 1.5}, "outside_shape"),
    ],
)
def test_one_link_that_does_not_fit_its_shape(
    change: dict[str, float], kind: str, seed: int, at: int
) -> None:
    links = arms(seed)
    for link in links[2 * at : 2 * at + 2]:  # the same on both sides
        scaled(link, **change)
    found = judged(links)
    assert [(each.kind, each.status) for each in found] == [(kind, "doubt")]
    assert set(found[0].joints) == {f"to_left_{at}", f"to_right_{at}"}
    assert f"left_{at}" in found[0].evidence
    assert f"right_{at}" in found[0].evidence


@few_examples
@given(seeds)
def test_links_that_are_held_stand_in_their_own_frames(seed: int) -> None:
    links = arms(seed)
    assert judged(links, joints=["to_left_0"]) == []
    scaled(links[4], off=1.5)
    found = judged(links, joints=["to_left_0"])
    assert [each.joints for each in found] == [("to_left_0",)]
    assert found[0].evidence.startswith("left_2: ")


@few_examples
@given(seeds)
def test_inertias_about_the_frames_of_the_links(seed: int) -> None:
    links = arms(seed)
    for link in links:
        link["inertia"] = link["inertia"] + link["mass"] * inertia_of(link["centre"][None])
    found = judged(links)
    assert [each.kind for each in found] == ["inertia_frame"]
    moved = sum(link["mass"] for link in links)
    shown = {f"to_{link['name']}" for link in links if link["mass"] > 0.01 * moved}
    assert set(found[0].joints) == shown


@few_examples
@given(seeds, st.floats(1.6, 1.9), st.sampled_from(["mass", "inertia"]))
def test_halves_that_differ(seed: int, factor: float, what: str) -> None:
    links = arms(seed)
    links[3][what] = links[3][what] * factor
    found = [each for each in judged(links) if each.kind == "unequal_halves"]
    assert len(found) == 1
    assert "left_1 and right_1" in found[0].evidence
    links[3][what] = links[2][what] * 1.4
    assert all(each.kind != "unequal_halves" for each in judged(links))


@pytest.mark.parametrize(
    ("left", "right", "two_sides"),
    [
        ("l_arm", "r_arm", True),
        ("arm_L", "arm_R", True),
        ("LArmLink", "RArmLink", True),
        ("FL_hip", "FR_hip", True),
        ("LH_HIP", "RH_HIP", True),
        ("LeftFoot", "RightFoot", True),
        ("L_l1", "R_l1", True),
        ("L_lf_1", "L_rf_1", False),  # a little and a ring finger
    ],
)
def test_names_of_two_sides(left: str, right: str, two_sides: bool) -> None:
    links = arms(1, joints=1)
    links[0]["name"], links[1]["name"] = left, right
    links[1]["mass"] *= 2.0
    told = [each.evidence for each in judged(links)]
    assert [f"{left} and {right}" in words for words in told] == [True] * two_sides


@pytest.mark.parametrize("key", ["velocity", "effort"])
def test_limits_of_zero(key: str) -> None:
    links = arms(2)
    links[2]["limit"] = links[2]["limit"].replace(f'{key}="', f'{key}="0" was="')
    found = judged(links)
    assert [(each.kind, each.joints) for each in found] == [(f"zero_{key}", ("to_left_1",))]
    assert f"robot.limits.to_left_1.{key}" in found[0].evidence
    assert judged(links, limits={"to_left_1": {key: 3.0}}) == []
    assert judged(links, joints=["to_right_1"]) == []


def test_shapes_that_cannot_be_read_are_none(tmp_path: Path) -> None:
    links = arms(3)
    for link in links[:4]:
        scaled(link, 1e3, 1e3)
    text = urdf_of(links).replace('<box size="', '<mesh filename="missing.stl" was="', 2)
    (tmp_path / "arms.urdf").write_text(text, encoding="utf-8")
    spec = Spec(robot=RobotSpec(urdf="arms.urdf"))
    found = rows_of_description(build_robot(spec.robot, tmp_path), spec)
    assert [each.joints for each in found] == [("to_left_1", "to_right_1")]
    # Rows of inspect without data.
    (tmp_path / "arms.urdf").write_text(urdf_of(arms(5)), encoding="utf-8")
    found = inspect(load_case({"robot": {"urdf": str(tmp_path / "arms.urdf")}}))
    assert tuple(each.name for each in found.results) == row_names()[:4]
    assert all(each.status == "ok" for each in found.results)


def test_the_ground_is_in_no_torque() -> None:
    links = arms(4, joints=2)
    for link in links:
        scaled(link, inertia=1e3)
    joints = ["to_left_1", "to_right_1"]
    assert judged(links, joints=joints)[0].joints == tuple(joints)
    floating = judged(links, joints=joints, base="floating", rows=("base", "joints"))
    assert "left_0" in floating[0].evidence
