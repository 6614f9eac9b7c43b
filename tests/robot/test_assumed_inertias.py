"""Inertias of shapes at one density are MuJoCo's of the same shapes."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.robot.model import Robot, build_robot
from tests.proposal.robots import GOOD, joint, link, written

# Corners of a wedge, which is its own hull and not symmetric.
CORNERS = ((0, 0, 0), (0.3, 0, 0), (0, 0.2, 0), (0, 0, 0.4))
OBJ = "".join(f"v {x} {y} {z}\n" for x, y, z in CORNERS) + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
SHAPES = {
    "box": ('<box size="0.2 0.3 0.4"/>', 'type="box" size="0.1 0.15 0.2"'),
    "sphere": ('<sphere radius="0.2"/>', 'type="sphere" size="0.2"'),
    "cylinder": (
        '<cylinder radius="0.1" length="0.5"/>',
        'type="cylinder" size="0.1 0.25"',
    ),
    "mesh": ('<mesh filename="m.obj" scale="1 2 1"/>', 'type="mesh" mesh="m"'),
}
PLACES = (("0.1 -0.2 0.3", "0.4 -0.3 0.2"), ("-0.3 0.1 0.1", "0 0.5 0"))


def ours(folder: Path, shape: str, kind: str = "collision") -> Robot:
    items = "".join(
        f'<{kind}><origin xyz="{xyz}" rpy="{rpy}"/><geometry>{shape}</geometry></{kind}>'
        for xyz, rpy in PLACES
    )
    bare = f'<link name="arm">{items}</link>'
    written(folder, link("base"), joint("j", "base", "arm", GOOD), bare)
    return build_robot(RobotSpec(urdf="robot.urdf", density=1200.0), folder)


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("kind", ["collision", "visual"])
def test_they_are_those_of_mujoco(tmp_path: Path, name: str, kind: str) -> None:
    (tmp_path / "m.obj").write_text(OBJ)
    shape, geom = SHAPES[name]
    geoms = "".join(
        f'<geom {geom} pos="{xyz}" euler="{rpy}" density="1200"/>' for xyz, rpy in PLACES
    )
    path = tmp_path / "robot.xml"
    path.write_text(
        '<mujoco><compiler angle="radian" eulerseq="XYZ" inertiafromgeom="true"/>'
        f'<asset><mesh name="m" file="{tmp_path}/m.obj" scale="1 2 1"/></asset>'
        f'<worldbody><body name="arm"><joint/>{geoms}</body></worldbody></mujoco>'
    )
    theirs = mujoco.MjModel.from_xml_path(str(path)).body("arm")
    found = ours(tmp_path, shape, kind).model.inertias[1]
    close = 2e-2 if name == "cylinder" else 1e-6  # a rim of corners
    assert found.mass == pytest.approx(float(theirs.mass[0]), rel=close)
    np.testing.assert_allclose(found.lever, theirs.ipos, atol=1e-6 + close * 1e-2)
    moments = np.sort(np.linalg.eigvalsh(found.inertia))[::-1]
    np.testing.assert_allclose(moments, theirs.inertia, rtol=2 * close)


def test_exports_start_from_the_urdf_as_given(tmp_path: Path) -> None:
    """With the masses, and its joints as they are; links that have mass keep it."""
    arm = link("arm", mass=-1)
    turning = joint("j", "base", "arm", kind="continuous")
    written(tmp_path, link("base"), turning, arm, joint("k", "arm", "tip", GOOD), link("tip", 0.7))
    robot = build_robot(RobotSpec(urdf="robot.urdf", density=1000.0), tmp_path)
    assert 'type="continuous"' in robot.description.urdf
    assert robot.description.urdf.count("<mass") == 3
    assert robot.model.inertias[2].mass == 0.7


def test_shapes_that_are_missing_or_flat_leave_a_link_without_mass(tmp_path: Path) -> None:
    assert ours(tmp_path, '<mesh filename="none.stl"/>').model.inertias[1].mass == 0.0
    assert ours(tmp_path, '<box size="0.1 0.1 0"/>').model.inertias[1].mass == 0.0


def test_a_mesh_that_changes_is_read_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))

    def mass(height: str) -> float:
        (tmp_path / "m.obj").write_text(OBJ.replace("0.4", height))
        return float(ours(tmp_path, '<mesh filename="m.obj"/>').model.inertias[1].mass)

    assert mass("0.4") == mass("0.4")
    assert mass("0.8") == pytest.approx(2 * mass("0.4"))
