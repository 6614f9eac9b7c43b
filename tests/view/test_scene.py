from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.excitation.problem import Problem
from excite_cli.geometry.link_shapes import collision_model, link_shapes
from excite_cli.robot.model import Array, Robot, build_robot
from excite_cli.trajectory.fade import Segment
from excite_cli.view.geometry import robot_bodies
from excite_cli.view.scene import Scene, build_scene
from excite_cli.view.surface import box_triangles
from excite_cli.view.translucent import wall_surface
from tests.urdf_elements import joint, link, robot_text
from tests.view.small_meshes import CORNERS, MESH, QUARTER_ABOUT_X, write_collada, write_gltf

SPHERE = '<geometry><sphere radius="0.1"/></geometry>'
BOX = '<geometry><box size="0.2 0.2 0.2"/></geometry>'
ROUND = f"<collision>{SPHERE}</collision>"
RED = '<material name="red"><color rgba="0.9 0.1 0.2 1"/></material>'


@pytest.fixture(scope="module")
def scene(problem: Problem, segment: Segment) -> Scene:
    times = np.linspace(0.0, 6.0, 20)
    return build_scene(problem, [segment.trajectory.states(times, segment.coefficients)[0]])


def _robot(folder: Path, first: str, second: str) -> Robot:
    """With these shapes on its two links."""
    links = link("a", shapes=first), link("b", shapes=second)
    text = robot_text("r", *links, joint("j", ("a", "b"), "0 0 0.5", "0 1 0"))
    (folder / "robot.urdf").write_text(text)
    return build_robot(RobotSpec(urdf="robot.urdf"), folder)


def test_everything_of_the_problem_is_there(scene: Scene) -> None:
    assert [name for name, _ in scene.boxes] == ["shelf"]
    assert [wall.name for wall in scene.walls] == ["left"]
    assert scene.ground == -0.6
    assert "payload" in [body.name for body in scene.bodies]
    assert "payload" in [capsule.name for capsule in scene.capsules]
    assert len(scene.capsule_surfaces) == len(scene.capsules)
    assert scene.region is not None
    middle = scene.region.corners.mean(axis=0)
    inner = np.linalg.norm(scene.region.corners - middle, axis=1)
    np.testing.assert_allclose(inner, 0.2, rtol=1e-6)
    # Walls stand on the ground in their plane.
    surface = wall_surface(scene.walls[0], scene)
    np.testing.assert_allclose(surface.points[:, 1], 1.2)
    assert surface.points[:, 2].min() == pytest.approx(scene.ground)
    a, b, c = surface.points[surface.faces[0]]
    assert np.cross(b - a, c - a) @ scene.walls[0].normal > 0


def test_visual_shapes_with_their_colours_or_what_there_is(tmp_path: Path) -> None:
    """Collision shapes where nothing is visual, sticks where there is nothing."""
    box = f"<collision>{BOX}</collision>"
    bodies, note = robot_bodies(_robot(tmp_path, f"<visual>{SPHERE}{RED}</visual>", box))
    assert note == ""
    assert [(body.joint, body.colour) for body in bodies] == [(0, pytest.approx((0.9, 0.1, 0.2)))]
    bodies, _ = robot_bodies(_robot(tmp_path, "", box))
    assert [body.joint for body in bodies] == [1]
    np.testing.assert_allclose(np.abs(bodies[0].surface.points), 0.1)
    lost = '<visual><geometry><mesh filename="lost.stl"/></geometry></visual>'
    bodies, note = robot_bodies(_robot(tmp_path, lost, box))
    assert len(bodies) == 1
    assert "lost.stl" in note
    assert "collision shapes are shown" in note
    bodies, note = robot_bodies(_robot(tmp_path, "", ""))
    assert "sticks" in note
    assert bodies[0].joint == 0
    assert bodies[0].surface.points[:, 2].max() == pytest.approx(0.52, abs=0.002)


def test_a_missing_mesh_costs_no_other_shape(tmp_path: Path) -> None:
    """The link is shown without it, and named; what else the URDF shows is shown."""
    missing = f'<visual><geometry><mesh filename="none.stl"/></geometry></visual>{ROUND}'
    shown = f"<visual>{BOX}</visual>"
    bodies, note = robot_bodies(_robot(tmp_path, shown, missing))
    assert [body.name for body in bodies] == ["a_0"]
    assert note.startswith("b is drawn without what cannot be read: ")
    assert "the visual mesh 'none.stl' was not found" in note
    bodies, note = robot_bodies(_robot(tmp_path, missing + shown, missing))
    assert [len(body.surface.faces) for body in bodies] == [12]  # the box
    assert note.startswith("a, b are drawn without what cannot be read: ")


def test_mirrored_meshes_face_outwards(tmp_path: Path) -> None:
    box = box_triangles(np.array([0.1, 0.2, 0.3]))
    lines = [f"v {x} {y + 0.5} {z}" for x, y, z in box.points]
    lines += [f"f {a} {b} {c}" for a, b, c in box.faces + 1]
    (tmp_path / "box.obj").write_text("\n".join(lines) + "\n")
    mesh = '<visual><geometry><mesh filename="box.obj" scale="1 {} 1"/></geometry></visual>'
    bodies, note = robot_bodies(_robot(tmp_path, mesh.format(1), mesh.format(-1)))
    assert note == ""
    for body, side in zip(bodies, (1, -1), strict=True):
        points, faces = body.surface.points, body.surface.faces
        assert points[:, 1].mean() == pytest.approx(0.5 * side)
        a, b, c = (points[faces[:, k]] for k in range(3))
        assert np.einsum("kx,kx->k", a, np.cross(b, c)).sum() / 6 == pytest.approx(0.048)


def test_the_ground_is_the_floor_or_the_plane_of_the_base(
    problem: Problem, scene: Scene, tmp_path: Path
) -> None:
    """Where it is, however far below a motion reaches, and called what it is."""
    assert (scene.ground_words, scene.solid) == ("floor at -0.6 m", True)
    bare = replace(problem, constraints=())
    up = np.zeros((1, problem.robot.n))
    down = up.copy()
    down[0, problem.robot.joint_names.index("shoulder_pitch")] = 3.0
    reached = build_scene(bare, [up, down])
    foot = min(body.surface.points[:, 2].min() for body in reached.bodies if body.joint == 0)
    assert reached.ground == foot
    assert reached.low[2] < foot
    assert reached.ground_words == f"plane of the base at {foot:.3g} m, no floor is modelled"
    assert not reached.solid
    # A base without shapes has no plane.
    still = replace(bare, robot=_robot(tmp_path, "", f"<collision>{BOX}</collision>"))
    lowest = build_scene(still, [np.zeros((1, 1))])
    assert lowest.ground_words == "lowest point at 0.4 m, no floor is modelled"


TURNED = CORNERS @ np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])  # a quarter about x
AWAY = np.array([10.0, 0.0, 0.0])


def robot_with(mesh: Path, visual_shapes: bool = False) -> Robot:
    """A robot whose second link looks like the mesh, twice as large and 1 m up."""
    shape = f'<geometry><mesh filename="{mesh.name}" scale="2 2 2"/></geometry>'
    visual = f'<visual><origin xyz="0 0 1"/>{shape}</visual>'
    return replace(_robot(mesh.parent, "", visual), visual_shapes=visual_shapes)


def seen(mesh: Path) -> Array:
    """Corners [m] of what is shown, in the mesh's own frame and size."""
    bodies, note = robot_bodies(robot_with(mesh))
    assert note == ""
    assert [body.name for body in bodies] == ["b_0"]
    return in_order((bodies[0].surface.points - [0, 0, 1]) / 2)


def in_order(points: Array) -> Array:
    return np.unique(np.round(points, 5) + 0.0, axis=0)


@pytest.mark.parametrize("up", ["", "X_UP", "Y_UP", "Z_UP"])
def test_up_axes_of_collada_turn_nothing(tmp_path: Path, up: str) -> None:
    mesh = tmp_path / "m.dae"
    write_collada(mesh, up, f'<node id="n">{MESH}</node>')
    np.testing.assert_allclose(seen(mesh), in_order(CORNERS), atol=1e-5)


@pytest.mark.parametrize("up", ["Y_UP", "Z_UP"])
def test_nodes_of_collada_count(tmp_path: Path, up: str) -> None:
    mesh = tmp_path / "m.dae"
    inner = f'<node id="m"><translate>10 0 0</translate>{MESH}</node>'
    write_collada(mesh, up, f'<node id="n"><rotate>1 0 0 90</rotate>{inner}</node>')
    np.testing.assert_allclose(seen(mesh), in_order(TURNED + AWAY), atol=1e-5)


ROOT: dict[str, Any] = {"rotation": QUARTER_ABOUT_X}
CHILD: dict[str, Any] = {"mesh": 0, "translation": AWAY.tolist()}
BOTH = np.vstack([TURNED, TURNED + AWAY])


@pytest.mark.long
@pytest.mark.parametrize(
    ("nodes", "roots", "expected"),
    [
        ([{"mesh": 0}], [0], CORNERS),
        ([{"mesh": 0, **ROOT}], [0], TURNED),
        ([{"children": [1], **ROOT}, CHILD], [0], TURNED + AWAY),
        ([CHILD, {"children": [0], **ROOT}], [1], TURNED + AWAY),
        ([{"mesh": 0, "children": [1], **ROOT}, CHILD], [0], BOTH),
        ([{"mesh": 0, **ROOT}, CHILD], [0, 1], np.vstack([TURNED, CORNERS + AWAY])),
        ([{"children": [1], "scale": [3, 3, 3]}, {"mesh": 0}], [0], 3 * CORNERS),
    ],
)
@pytest.mark.parametrize("suffix", [".glb", ".gltf", ".GLB"])
def test_nodes_of_gltf_count(
    tmp_path: Path, nodes: list[dict[str, Any]], roots: list[int], expected: Array, suffix: str
) -> None:
    mesh = tmp_path / f"m{suffix.lower()}"
    write_gltf(mesh, nodes, roots)
    mesh = mesh.rename(tmp_path / f"m{suffix}")
    np.testing.assert_allclose(seen(mesh), in_order(expected), atol=1e-5)


def test_visual_shapes_that_keep_links_apart_stand_there_too(tmp_path: Path) -> None:
    """Numbers of glTF may be in another file."""
    mesh = tmp_path / "m.gltf"
    write_gltf(mesh, [{"children": [1], **ROOT}, CHILD], [0], beside=True)
    np.testing.assert_allclose(seen(mesh), in_order(TURNED + AWAY), atol=1e-5)
    robot = robot_with(mesh, visual_shapes=True)
    (shape,) = link_shapes(robot, collision_model(robot))
    expected = in_order(2 * (TURNED + AWAY) + [0, 0, 1])
    np.testing.assert_allclose(in_order(shape.points), expected, atol=1e-5)


@pytest.mark.parametrize("content", [b"glTF", b"{}", b"glTF\2\0\0\0\xff\0\0\0", b"\0" * 40])
def test_what_is_no_gltf_is_refused(tmp_path: Path, content: bytes) -> None:
    mesh = tmp_path / "m.glb"
    mesh.write_bytes(content)
    _, note = robot_bodies(robot_with(mesh))
    assert "m.glb cannot be loaded" in note
