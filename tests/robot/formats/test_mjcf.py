"""MJCF as a robot: the same torques as MuJoCo's, shapes, limits, couplings, what is told."""

from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from excite_cli.config.constraints_spec import SelfCollisionSpec
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.errors import RobotError
from excite_cli.geometry.capsules import fit_capsules
from excite_cli.geometry.link_shapes import collision_model, link_shapes
from excite_cli.geometry.mesh_distances import MeshDistances
from excite_cli.robot.description import load_description
from excite_cli.robot.loops import Mimic
from excite_cli.robot.model import Robot, build_robot

ODD = Path(__file__).parent / "odd_arm.xml"


def _written(folder: Path, bodies: str, more: str = "") -> Path:
    path = folder / "robot.xml"
    path.write_text(f"<mujoco><worldbody>{bodies}</worldbody>{more}</mujoco>")
    return path


def _body(name: str, inside: str = "", joint: str = '<joint name="{}_j" axis="0 1 0"/>') -> str:
    shape = '<geom type="box" size="0.05 0.05 0.1" pos="0 0 0.1" mass="1"/>'
    return f'<body name="{name}" pos="0 0 0.25">{joint.format(name)}{shape}{inside}</body>'


def _worst(robot: Robot, path: Path) -> float:
    """Largest difference [N·m or N] from MuJoCo's inverse dynamics over random states."""
    model = mujoco.MjModel.from_xml_path(str(path))
    model.dof_damping[:] = model.dof_frictionloss[:] = model.dof_armature[:] = 0.0
    off = mujoco.mjtDisableBit
    model.opt.disableflags |= off.mjDSBL_CONTACT | off.mjDSBL_CONSTRAINT
    data, own = mujoco.MjData(model), robot.model.createData()
    worst = 0.0
    for q, v, a in zip(*robot.draw_states(50, 3), strict=True):
        for k, name in enumerate(robot.joint_names):
            joint = model.joint(name)
            data.qpos[joint.qposadr[0]] = q[k]
            data.qvel[joint.dofadr[0]], data.qacc[joint.dofadr[0]] = v[k], a[k]
        mujoco.mj_inverse(model, data)
        theirs = [data.qfrc_inverse[model.joint(n).dofadr[0]] for n in robot.joint_names]
        worst = max(worst, float(np.abs(pin.rnea(robot.model, own, q, v, a) - theirs).max()))
    return worst


def test_torques_are_those_of_mujoco() -> None:
    """Joints off the body's origin, two in one body, a reference angle, a slide, degrees."""
    robot = build_robot(RobotSpec(urdf=str(ODD)))
    assert robot.joint_names == ("j1", "j2", "j3a", "j3b", "slide")
    assert _worst(robot, ODD) < 1e-11
    np.testing.assert_allclose(np.degrees(robot.limits.upper[:4]), [170, 100, 120, 90])
    assert robot.limits.effort.tolist() == [150.0, 150.0, 60.0, 60.0, 300.0]


def test_shapes_are_where_mujoco_has_them() -> None:
    """Distances of links by coal against MuJoCo's own."""
    robot = build_robot(RobotSpec(urdf=str(ODD)))
    model = mujoco.MjModel.from_xml_path(str(ODD))
    data, meshes = mujoco.MjData(model), MeshDistances(robot)
    for q in robot.draw_states(20, 5)[0]:
        for k, name in enumerate(robot.joint_names):
            data.qpos[model.joint(name).qposadr[0]] = q[k]
        mujoco.mj_forward(model, data)
        first, second = (model.body(name).geomadr[0] for name in ("base", "l4"))
        theirs = mujoco.mj_geomDistance(model, data, first, second, 10.0, np.zeros(6))
        if theirs > 1e-3:
            assert meshes.distance(["base"], ["l4"], q) == pytest.approx(theirs, abs=1e-6)
    assert {c.links[0] for c in fit_capsules(robot, SelfCollisionSpec())} >= {"base", "l1", "l4"}


def test_meshes_are_scaled_and_placed(tmp_path: Path) -> None:
    """MuJoCo recentres meshes; what is written of them stays where they are."""
    corners = " ".join(f"{x} {y} {z}" for x in (0, 1) for y in (0, 2) for z in (0, 3))
    asset = f'<asset><mesh name="m" vertex="{corners}" scale="0.1 0.1 0.1"/></asset>'
    geom = '<geom type="mesh" mesh="m" pos="0.5 0 0" euler="0 0 90" mass="1"/>'
    body = f'<body name="a"><joint name="j" range="-90 90"/>{geom}</body>'
    robot = build_robot(RobotSpec(urdf=str(_written(tmp_path, body, asset))))
    (shape,) = link_shapes(robot, collision_model(robot))
    np.testing.assert_allclose(shape.points.min(axis=0), [0.3, 0.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(shape.points.max(axis=0), [0.5, 0.1, 0.3], atol=1e-6)


def test_couplings_are_mimic_joints(tmp_path: Path) -> None:
    more = '<equality><joint joint1="b_j" joint2="a_j" polycoef="0.1 -0.5 0 0 0"/></equality>'
    described = load_description(str(_written(tmp_path, _body("a", _body("b")), more)))
    assert described.mimicking == {"b_j": Mimic("a_j", -0.5, 0.1)}
    assert '<mimic joint="a_j" multiplier="-0.5" offset="0.1"' in described.xml


def test_what_a_urdf_cannot_hold_is_told(tmp_path: Path) -> None:
    free = _body("ball", joint="<freejoint/>")
    loop = '<equality><connect body1="b" body2="a" anchor="0 0 0"/></equality>'
    joint = '<joint name="{}_j" axis="0 1 0" armature="0.1"/>'
    tendon = '<tendon><fixed name="t"><joint joint="a_j" coef="1"/></fixed></tendon>'
    path = _written(tmp_path, _body("a", _body("b"), joint) + free, loop + tendon)
    told = " | ".join(load_description(str(path)).notes)
    loops = "a closed loop is cut between b and a: in the model, b_j move on their own"
    for words in ("left out: ball", loops, "1 tendon(s)", "kind: armature"):
        assert words in told


@pytest.mark.parametrize(
    ("bodies", "words"),
    [
        ('<geom type="box" size="1 1 1"/>', "no body has a joint that could be moved"),
        ('<body><geom type="nonsense"/></body>', "MuJoCo cannot compile it"),
    ],
)
def test_what_is_no_robot_is_refused(tmp_path: Path, bodies: str, words: str) -> None:
    with pytest.raises(RobotError, match=words):
        load_description(str(_written(tmp_path, bodies)))


def test_what_floats_and_what_damping_holds(tmp_path: Path) -> None:
    """A robot that floats is its own root; a joint that cannot be turned stays."""
    path = _written(tmp_path, _body("trunk", _body("a"), "<freejoint/>"))
    robot = build_robot(RobotSpec(urdf=str(path), base="floating", rows=("base", "joints")))
    assert robot.joint_names == ("a_j",)
    assert robot.model.inertias[1].mass == 1.0
    held = '<joint name="{}_j" axis="0 1 0" damping="1e11"/>'
    robot = build_robot(RobotSpec(urdf=str(_written(tmp_path, _body("a", _body("b"), held)))))
    assert robot.joint_names == ("b_j",)
    assert "their damping holds these joints: a_j" in robot.description.notes
