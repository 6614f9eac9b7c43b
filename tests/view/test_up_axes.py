"""Meshes stand as URDFs mean them: coordinates as in the file, nodes of the scene in their places.

What a COLLADA file calls up does not turn it, as in RViz and Pinocchio. Nodes of glTF count, those
of a single root too, as trimesh reads them and as collision meshes of real robots confirm.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excite_cli.config.load import load_spec
from excite_cli.geometry.link_shapes import collision_model, link_shapes
from excite_cli.robot.model import Array, Robot, build_robot
from excite_cli.view.geometry import robot_bodies
from tests.view.small_meshes import CORNERS, MESH, QUARTER_ABOUT_X, write_collada, write_gltf

TURNED = CORNERS @ np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])  # a quarter about x
AWAY = np.array([10.0, 0.0, 0.0])
INERTIAL = (
    '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    "</inertial>"
)
URDF = """<robot name="r"><link name="a">{inertial}</link><link name="b">{inertial}<visual>
<origin xyz="0 0 1"/><geometry><mesh filename="{mesh}" scale="2 2 2"/></geometry></visual></link>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>"""


def robot_with(mesh: Path, visual_shapes: bool = False) -> Robot:
    """A robot whose second link looks like the mesh, twice as large and 1 m up."""
    folder = mesh.parent
    (folder / "r.urdf").write_text(URDF.format(inertial=INERTIAL, mesh=mesh.name))
    (folder / "r.yaml").write_text("robot: {urdf: r.urdf}\n")
    robot = build_robot(load_spec(folder / "r.yaml").robot, folder)
    return replace(robot, visual_shapes=visual_shapes)


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


def test_numbers_of_gltf_may_be_in_another_file(tmp_path: Path) -> None:
    mesh = tmp_path / "m.gltf"
    write_gltf(mesh, [{"children": [1], **ROOT}, CHILD], [0], beside=True)
    np.testing.assert_allclose(seen(mesh), in_order(TURNED + AWAY), atol=1e-5)


def test_visual_shapes_that_keep_links_apart_stand_there_too(tmp_path: Path) -> None:
    mesh = tmp_path / "m.glb"
    write_gltf(mesh, [{"children": [1], **ROOT}, CHILD], [0])
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
