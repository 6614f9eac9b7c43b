"""Capsules of least volume, those of links, and what is stored of them."""

import os
from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.config.constraints_spec import CapsuleSpec, SelfCollisionSpec
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.errors import ConfigError, RobotError
from excite_cli.geometry import capsules as module
from excite_cli.geometry.capsule_fit import (
    capsule_volume,
    hull_points,
    minimum_volume_capsule,
    quick_capsule_volume,
)
from excite_cli.geometry.capsules import (
    _content,
    cover_key,
    fit_capsules,
    link_joints,
    store_capsules,
)
from excite_cli.geometry.link_shapes import collision_model, link_shapes, placed_shapes
from excite_cli.robot.model import Robot, build_robot
from tests.urdf_elements import joint, link, robot_text

from .fitted_robots import capsules_of, robot_of


@pytest.fixture(autouse=True)
def _own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


def box_robot(tmp_path: Path, collision: str):
    path = tmp_path / "box.urdf"
    parts = '<link name="base"/>', link("arm", shapes=collision), joint("j", ("base", "arm"))
    path.write_text(robot_text("box", *parts))
    return build_robot(RobotSpec(urdf=str(path)))


def gaps(points: np.ndarray, start: np.ndarray, end: np.ndarray, radius: float) -> np.ndarray:
    """How far points lie outside a capsule."""
    along = end - start
    share = np.clip((points - start) @ along / max(along @ along, 1e-30), 0, 1)
    return np.linalg.norm(points - start - share[:, None] * along, axis=1) - radius


@pytest.mark.long
@pytest.mark.parametrize(("name", "most"), [("talos", 45), ("ur10", 15), ("panda", 16)])
def test_every_mesh_lies_inside_few_capsules_of_its_link(name: str, most: int) -> None:
    robot, capsules = robot_of(name), capsules_of(name)
    assert len(capsules) <= most
    assert len({capsule.name for capsule in capsules}) == len(capsules)
    rng = np.random.default_rng(0)
    for shape in link_shapes(robot, collision_model(robot)):
        own = [c for c in capsules if shape.links[0] in c.links]
        assert own, shape.links
        assert {c.joint for c in own} == {shape.joint}
        share = rng.uniform(size=(len(shape.edges), 1))  # edges must not leave between the capsules
        first, second = shape.points[shape.edges[:, 0]], shape.points[shape.edges[:, 1]]
        points = np.vstack([shape.points, share * first + (1 - share) * second])
        outside = np.min([gaps(points, c.start, c.end, c.radius) for c in own], axis=0)
        assert outside.max() < 1e-9, shape.links


@pytest.mark.long
def test_capsules_of_a_humanoid() -> None:
    """Its right arm is the left arm's mesh with a negative scale: its capsules are mirrored."""
    by_name = {c.name: c for c in capsules_of("talos")}
    assert "torso_2_link#2" in by_name
    gripper = [c for c in by_name.values() if "gripper_left_fingertip_1_link" in c.links]
    assert len(gripper) <= 2, "small parts share a capsule"
    assert len(gripper[0].links) >= 6
    left, right = by_name["arm_left_3_link"], by_name["arm_right_3_link"]
    assert right.radius == pytest.approx(left.radius, abs=2e-3)
    mirrored = (left.start + left.end) / 2 * [1, -1, 1]
    np.testing.assert_allclose((right.start + right.end) / 2, mirrored, atol=5e-3)
    assert abs(mirrored[1]) > 0.01
    joints = link_joints(robot_of("panda"))
    assert joints["panda_link0"] == 0
    assert joints["panda_hand"] == joints["panda_link7"] == 7


def test_turned_base_turns_fixed_capsules() -> None:
    plain = build_robot(RobotSpec(urdf="example-robot-data:ur10"))
    turned = robot_of("ur10")
    one = next(s for s in link_shapes(plain, collision_model(plain)) if s.joint == 0)
    two = next(s for s in link_shapes(turned, collision_model(turned)) if s.joint == 0)
    cos, sin = np.cos(0.5), np.sin(0.5)
    turn = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
    np.testing.assert_allclose(two.points, one.points @ turn.T, atol=1e-12)


BY_HAND = CapsuleSpec(start=(0, 0, 0), end=(0, 0, 0.3), radius=0.123)


def test_capsule_by_hand_replaces_the_fitted_one(tmp_path: Path) -> None:
    found = fit_capsules(robot_of("ur10"), SelfCollisionSpec(capsules={"wrist_3_link": BY_HAND}))
    (own,) = (c for c in found if "wrist_3_link" in c.links)
    assert (own.name, own.joint, own.radius, own.by_hand) == ("wrist_3_link", 6, 0.123, True)
    assert any(c.links == ("ee_link",) for c in found)
    bare = box_robot(tmp_path, "")
    with pytest.raises(RobotError, match=r"no collision geometry.*drop constraints"):
        fit_capsules(bare, SelfCollisionSpec())
    assert len(fit_capsules(bare, SelfCollisionSpec(capsules={"arm": BY_HAND}))) == 1


def test_unknown_link_is_refused_with_the_nearest_name() -> None:
    with pytest.raises(ConfigError, match=r"no link 'wrist_3_lnk'. Did you mean 'wrist_3_link'"):
        fit_capsules(robot_of("ur10"), SelfCollisionSpec(capsules={"wrist_3_lnk": BY_HAND}))
    with pytest.raises(ConfigError, match=r"ignore: the robot has no link 'nothing'"):
        fit_capsules(robot_of("ur10"), SelfCollisionSpec(ignore=(("nothing", "base_link"),)))


@pytest.mark.parametrize(
    ("geometry", "radius", "length"),
    [
        ('<sphere radius="0.1"/>', 0.1, 0.0),
        ('<cylinder radius="0.02" length="1"/>', 0.02, 1.0),
        ('<box size="0.02 0.02 1"/>', 0.0141, 1.0),
    ],
)
def test_primitives(tmp_path: Path, geometry: str, radius: float, length: float) -> None:
    collision = f'<collision><origin xyz="0.3 0 0"/><geometry>{geometry}</geometry></collision>'
    (capsule,) = fit_capsules(box_robot(tmp_path, collision), SelfCollisionSpec())
    assert radius <= capsule.radius + 1e-4
    assert capsule.radius == pytest.approx(radius, rel=0.06)
    assert np.linalg.norm(capsule.end - capsule.start) == pytest.approx(length, abs=0.03)
    np.testing.assert_allclose((capsule.start + capsule.end) / 2, [0.3, 0, 0], atol=2e-3)


@pytest.fixture
def fits(monkeypatch: pytest.MonkeyPatch) -> Mock:
    """Called as often as capsules are fitted, not read."""
    counted = Mock(side_effect=module.cover)
    monkeypatch.setattr(module, "cover", counted)
    return counted


def the_box(tmp_path: Path, size: str = "0.1 0.2 0.3") -> Robot:
    shape = f'<collision><geometry><box size="{size}"/></geometry></collision>'
    return box_robot(tmp_path, shape)


def test_cache_is_used_and_damaged_or_edited_content_is_not(tmp_path: Path, fits: Mock) -> None:
    robot = the_box(tmp_path)
    first = fit_capsules(robot, SelfCollisionSpec())
    (stored,) = (tmp_path / "excite").glob("meshes-*.npz")
    whole = stored.read_bytes()
    again = fit_capsules(robot, SelfCollisionSpec())
    assert fits.call_count == 1
    np.testing.assert_array_equal(again[0].start, first[0].start)
    assert again[0].links == first[0].links
    with np.load(stored) as content:
        arrays = dict(content)
    for content in (b"", whole[: len(whole) // 2], arrays | {"radii": arrays["radii"] / 2}):
        stored.unlink()
        if isinstance(content, bytes):
            stored.write_bytes(content)
        else:
            np.savez_compressed(stored, **content)
        fits.reset_mock()
        repaired = fit_capsules(robot, SelfCollisionSpec())
        assert fits.call_count == 1
        assert repaired[0].radius == first[0].radius
    assert not list((tmp_path / "excite").glob(".meshes-*"))


def test_capsules_of_another_robot_are_not_taken(tmp_path: Path, fits: Mock) -> None:
    fit_capsules(the_box(tmp_path), SelfCollisionSpec())
    (stored,) = (tmp_path / "excite").glob("meshes-*.npz")
    robot = the_box(tmp_path, "0.4 0.2 0.3")
    first = fit_capsules(robot, SelfCollisionSpec())
    (own,) = set((tmp_path / "excite").glob("meshes-*.npz")) - {stored}
    own.write_bytes(stored.read_bytes())
    fits.reset_mock()
    assert fit_capsules(robot, SelfCollisionSpec())[0].radius == first[0].radius
    assert fits.call_count == 1


def test_stored_capsules_that_do_not_hold_the_link_are_fitted_anew(
    tmp_path: Path, fits: Mock
) -> None:
    """Even under a digest that is right: proofs rest on what was measured in this run."""
    robot = the_box(tmp_path)
    first = fit_capsules(robot, SelfCollisionSpec())
    key = cover_key(placed_shapes(robot, collision_model(robot)), ())
    small = [replace(capsule, radius=capsule.radius * 0.99) for capsule in first]
    moved = [replace(c, start=c.start + 1e-3, end=c.end + 1e-3) for c in first]
    named = [replace(capsule, links=("other",)) for capsule in first]
    for forged in (small, moved, named, first[1:], []):
        store_capsules(key, forged)
        fits.reset_mock()
        again = fit_capsules(robot, SelfCollisionSpec())
        assert fits.call_count == 1
        assert [(c.radius, c.joint) for c in again] == [(c.radius, c.joint) for c in first]


def test_a_mesh_changed_in_place_is_fitted_anew(tmp_path: Path) -> None:
    """With the size and the time of the file as before."""
    mesh = tmp_path / "box.obj"

    def written(size: float) -> float:
        corners = [(x, y, z) for x in (0, size) for y in (0, 1.0) for z in (0, 1.0)]
        faces = [(1, 2, 3), (2, 3, 4), (5, 6, 7), (6, 7, 8), (1, 2, 5), (2, 5, 6)]
        lines = [f"v {x:.3f} {y:.3f} {z:.3f}" for x, y, z in corners]
        mesh.write_text("\n".join(lines + [f"f {a} {b} {c}" for a, b, c in faces]) + "\n")
        os.utime(mesh, (1e9, 1e9))
        _content.cache_clear()  # of this process; the next one reads the file
        shape = f'<collision><geometry><mesh filename="{mesh}"/></geometry></collision>'
        (capsule,) = fit_capsules(box_robot(tmp_path, shape), SelfCollisionSpec())
        return capsule.radius + float(np.linalg.norm(capsule.end - capsule.start)) / 2

    small, size = written(1.0), mesh.stat().st_size
    large = written(3.0)
    assert mesh.stat().st_size == size
    assert large > small + 0.5


def test_cache_that_cannot_be_written_is_no_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert len(fit_capsules(the_box(tmp_path), SelfCollisionSpec())) == 2


def sphere(rng: np.random.Generator, count: int) -> np.ndarray:
    points = rng.normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1), st.integers(1, 80), st.integers(0, 3))
def test_contains_every_point(seed: int, count: int, flat_axes: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-3, 1)
    points[:, :flat_axes] = 0.3  # down to a line and a single point
    start, end, radius = minimum_volume_capsule(points)
    assert gaps(points, start, end, radius).max() < 1e-9


@settings(max_examples=6, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1))
def test_recovers_the_capsule_that_points_came_from(seed: int) -> None:
    rng = np.random.default_rng(seed)
    axis, radius, length = sphere(rng, 1)[0], 0.1, rng.uniform(0.1, 0.5)
    ball = radius * sphere(rng, 1500)
    points = np.vstack([ball, ball + length * axis])
    start, end, fitted = minimum_volume_capsule(points)
    true = capsule_volume(np.zeros(3), length * axis, radius)
    assert capsule_volume(start, end, fitted) <= true * (1 + 1e-6)
    assert fitted == pytest.approx(radius, rel=0.03)
    assert abs((end - start) @ axis) == pytest.approx(length, rel=0.03)


def test_a_ball_gives_a_sphere() -> None:
    """A point one of no size."""
    center = np.array([1.0, 2.0, 3.0])
    points = 0.2 * sphere(np.random.default_rng(1), 800) + center
    start, end, radius = minimum_volume_capsule(points)
    assert radius == pytest.approx(0.2, abs=1e-3)
    np.testing.assert_allclose([start, end], [center, center], atol=5e-3)
    start, end, radius = minimum_volume_capsule(center[None])
    np.testing.assert_array_equal([start, end], [center, center])
    assert radius < 1e-9


def test_a_long_box_is_fitted_as_small_as_by_hand() -> None:
    points = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.1, 0.1) for z in (-0.1, 0.1)])
    start, end, radius = minimum_volume_capsule(points)
    by_hand = capsule_volume(np.zeros(3), np.array([1.0, 0, 0]), np.hypot(0.1, 0.1))
    assert capsule_volume(start, end, radius) <= by_hand * (1 + 1e-6)
    assert abs(end - start)[0] > 0.9
    assert abs(end - start)[1:].max() < 1e-3


def test_does_not_depend_on_the_frame() -> None:
    rng = np.random.default_rng(5)
    points = rng.normal(size=(100, 3)) * [0.05, 0.1, 0.3]
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    plain = capsule_volume(*minimum_volume_capsule(points))
    turned = capsule_volume(*minimum_volume_capsule(points @ turn.T + 4.0))
    assert turned == pytest.approx(plain, rel=1e-3)
    assert 0.9 * plain < quick_capsule_volume(points) < 1.4 * plain


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.array([[0.0, np.nan, 0.0]])])
def test_refuses_no_or_infinite_points(points: np.ndarray) -> None:
    with pytest.raises(ValueError, match="at least one point"):
        minimum_volume_capsule(points)


def test_hull_points_keep_the_extremes_of_flat_clouds() -> None:
    rng = np.random.default_rng(0)
    flat = np.column_stack([rng.normal(size=(60, 2)), np.full(60, 0.5)]) @ sphere(rng, 3).T
    for direction in sphere(rng, 20):
        assert (hull_points(flat) @ direction).max() == pytest.approx((flat @ direction).max())
    line = np.outer(np.linspace(0, 1, 9), [1.0, 2.0, 3.0])
    assert len(hull_points(line)) == 2
    assert len(hull_points(np.ones((5, 3)))) == 1
