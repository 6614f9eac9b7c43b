"""A biped that squats on a floor in MuJoCo, its log read as if it hung."""

import re

import mujoco
import numpy as np
import pytest

from excite_cli.checks.setup import Samples
from excite_cli.checks.standing_legs import standing_legs
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.robot.model import Robot, build_robot
from tests.base_link.stander import Array

_BONE = 0.35
SIDES, PARTS = ("left", "right"), ("hip", "knee", "ankle")
JOINTS = tuple(f"{side}_{part}" for side in SIDES for part in PARTS)
_SOLE = (
    '<collision><origin xyz="0.02 0 -0.03"/><geometry><box size="0.24 0.12 0.02"/></geometry>'
    "</collision>"
)


def _link(name: str, mass: float, center: str, shape: str = "") -> str:
    return (
        f'<link name="{name}"><inertial><origin xyz="{center}"/><mass value="{mass}"/>'
        '<inertia ixx="0.05" iyy="0.04" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial>'
        f"{shape}</link>"
    )


def _leg(side: str, y: float) -> str:
    bones = [
        _link(f"{side}_thigh", 5.0, "0 0 -0.15"),
        _link(f"{side}_shank", 3.0, "0 0 -0.15"),
        _link(f"{side}_foot", 1.0, "0.02 0 -0.02", _SOLE),
    ]
    names = ["pelvis", *(f"{side}_{bone}" for bone in ("thigh", "shank", "foot"))]
    places = (f"0 {y} 0", f"0 0 {-_BONE}", f"0 0 {-_BONE}")
    for part, parent, child, place in zip(PARTS, names, names[1:], places, strict=False):
        bones.append(
            f'<joint name="{side}_{part}" type="revolute"><parent link="{parent}"/>'
            f'<child link="{child}"/><origin xyz="{place}"/><axis xyz="0 1 0"/>'
            '<limit lower="-2.5" upper="2.5" velocity="5" effort="900"/></joint>'
        )
    return "".join(bones)


PELVIS = _link("pelvis", 30.0, "0.02 0 0.2")
URDF = f'<robot name="biped">{PELVIS}{_leg("left", 0.12)}{_leg("right", -0.12)}</robot>'


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    path = tmp_path_factory.mktemp("biped") / "biped.urdf"
    path.write_text(URDF, encoding="utf-8")
    return build_robot(RobotSpec(urdf=str(path)))


def squatting(standing: bool) -> Samples:
    """On the floor, or with the pelvis held in the air: positions and torques of the motors."""
    extra = '<mujoco><compiler fusestatic="false" discardvisual="true"/></mujoco></robot>'
    spec = mujoco.MjSpec.from_string(URDF.replace("</robot>", extra))
    pelvis = spec.body("pelvis")
    height = 2 * _BONE + 0.04
    pelvis.pos = [0, 0, height]
    if standing:
        pelvis.add_freejoint()
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[2, 2, 0.1])
    for name in JOINTS:
        motor = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        motor.gainprm[0], motor.biasprm[1], motor.biasprm[2] = 3000.0, -3000.0, -100.0
        motor.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    model = spec.compile()
    model.opt.timestep = 1e-3
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    data = mujoco.MjData(model)
    dofs = [model.joint(name).dofadr[0] for name in JOINTS]
    places = [model.joint(name).qposadr[0] for name in JOINTS]
    rows: list[tuple[Array, ...]] = []
    for k in range(6000):
        bend = 0.4 - 0.35 * np.cos(0.8 * data.time)
        data.ctrl[:] = np.tile([-bend, 2.0 * bend, -bend], 2) * min(1.0, data.time)
        mujoco.mj_step(model, data)
        if k > 2500 and k % 20 == 0:
            seen = data.qpos[places], data.qvel[dofs], data.qacc[dofs], data.actuator_force
            rows.append(tuple(each.copy() for each in seen))
    if standing:
        assert data.qpos[2] > 0.6 * height  # it has not fallen
        assert data.ncon >= 4
    q, v, a, tau = (np.array(x) for x in zip(*rows, strict=True))
    yes = np.ones(q.shape, bool)
    return Samples(q, v, a, tau, tau[None], yes, yes)


def test_legs_that_carry_are_told_from_legs_that_hang(robot: Robot) -> None:
    words = (
        r"stands on left_foot and right_foot, not of one that hangs .* \(1\d\d N at left_foot, "
        r"1\d\d N at right_foot; it weighs 471 N\) explain 8\d% of what the URDF leaves. Declare "
        r"robot.base: floating"
    )
    (found,) = standing_legs(robot, squatting(standing=True))
    assert found.status == "fault"
    assert re.search(words, found.evidence)
    assert not standing_legs(robot, squatting(standing=False))
    # Wrong masses and loads do not stand. What hangs and is not as the URDF says is pulled down by
    # it, or little.
    hanging = squatting(standing=False)
    heavier = Samples(**{**vars(hanging), "tau": 1.6 * hanging.tau})
    lighter = Samples(**{**vars(hanging), "tau": 0.5 * hanging.tau})
    opposite = Samples(**{**vars(hanging), "tau": -hanging.tau})
    for each in (heavier, lighter, opposite):
        assert not standing_legs(robot, each)
