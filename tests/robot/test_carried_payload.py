"""A payload of the config is the same as a link of that inertia, fixed to the link in the URDF."""

from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.constraints_spec import SelfCollisionSpec
from excite_cli.config.robot_spec import PayloadSpec, RobotSpec
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.forward_kinematics import BatchKinematics, States
from excite_cli.dynamics.regressor import InverseDynamics, payload_parameters, standard_parameters
from excite_cli.dynamics.whole_robot import CenterOfMass
from excite_cli.errors import ConfigError
from excite_cli.export.mjcf import mjcf
from excite_cli.export.urdf import updated_urdf
from excite_cli.geometry.capsules import fit_capsules
from excite_cli.geometry.collision_pairs import choose_pairs
from excite_cli.geometry.reasons import Why
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.robot.model import Robot, build_robot
from excite_cli.simulation.build import true_inertias
from excite_cli.simulation.mujoco_model import build_plant
from tests.robot.smoke_arm import ARM as SMOKE

from .random_robots import random_urdf

MASS, CENTER, INERTIA = 2.5, (0.1, -0.2, 0.3), (0.02, 0.03, 0.04)
CAPSULE = {"start": (0.0, 0.0, 0.1), "end": (0.0, 0.2, 0.1), "radius": 0.05}
FIXED = (
    '<link name="load"><inertial><origin xyz="0.1 -0.2 0.3"/><mass value="2.5"/><inertia '
    'ixx="0.02" iyy="0.03" izz="0.04" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    '<joint name="fixture" type="fixed"><parent link="{link}"/><child link="load"/></joint>'
)


def payload(link: object, **changes: object) -> PayloadSpec:
    given = {"link": link, "mass": MASS, "center": CENTER, "inertia": INERTIA, **CAPSULE}
    return PayloadSpec.model_validate({**given, **changes})


def smoke(**payload_changes: object) -> Robot:
    return build_robot(
        RobotSpec(urdf=str(SMOKE), payload=payload(**{"link": "tool", **payload_changes}))
    )


# On a moved link, on one that is locked on it, and on the base.
@pytest.mark.parametrize("link", ["link_4", "link_2", "link_0"])
@pytest.mark.parametrize("base", ["fixed", "floating"])
@pytest.mark.parametrize("seed", range(2))
def test_as_a_link_of_the_urdf(tmp_path: Path, seed: int, base: str, link: str) -> None:
    text = random_urdf(np.random.default_rng(seed), 4)
    (tmp_path / "plain.urdf").write_text(text, encoding="utf-8")
    loaded = text.replace("</robot>", FIXED.format(link=link) + "</robot>")
    (tmp_path / "loaded.urdf").write_text(loaded, encoding="utf-8")
    common = {"base": base, "base_orientation": (0.3, -0.2, 0.5), "posture": {"joint_2": 0.2}}
    common["joints"] = ("joint_1", "joint_3", "joint_4")
    robot, bare, reference = (
        build_robot(RobotSpec.model_validate({**common, **given}), tmp_path)
        for given in (
            {"urdf": "plain.urdf", "payload": payload(link)},
            {"urdf": "plain.urdf"},
            {"urdf": "loaded.urdf"},
        )
    )
    phi = standard_parameters(robot)
    assert phi == pytest.approx(standard_parameters(reference), abs=1e-12)
    assert phi - payload_parameters(robot) == pytest.approx(standard_parameters(bare), abs=1e-12)
    q, v, a = robot.draw_states(5, 3)
    expected = InverseDynamics(reference).torques(q, v, a)
    assert InverseDynamics(robot).torques(q, v, a) == pytest.approx(expected, abs=1e-10)
    states = States(BatchKinematics(robot), q, v, a)
    expected = CenterOfMass(reference).position(states)
    assert CenterOfMass(robot).position(states) == pytest.approx(expected, abs=1e-12)
    assert np.abs(CenterOfMass(bare).position(states) - expected).max() > 1e-3


def test_regressor_and_fingerprint_do_not_change_but_phi_does() -> None:
    bare, robot = build_robot(RobotSpec(urdf=str(SMOKE))), smoke()
    assert robot.fingerprint() == bare.fingerprint()
    first, second = find_base_parameters(bare), find_base_parameters(robot)
    assert np.array_equal(first.mapping, second.mapping)
    change = standard_parameters(robot) - standard_parameters(bare)
    assert np.flatnonzero(change).min() >= 40  # the tool is the last of five bodies
    assert change[40] == MASS
    shape = smoke(mass=0.0, inertia=(0.0, 0.0, 0.0))
    assert np.array_equal(standard_parameters(shape), standard_parameters(bare))
    assert "payload" in {c.name for c in fit_capsules(shape, SelfCollisionSpec())}


def test_mujoco_carries_it_too() -> None:
    mujoco = pytest.importorskip("mujoco")
    robot = smoke()
    plant = build_plant(robot, true_inertias(robot, 0.0, 1))
    data = plant.new_data()
    q, v, a = robot.draw_states(5, 2)
    expected = InverseDynamics(robot).torques(q, v, a)
    for t in range(5):
        data.qpos[plant.motor], data.qvel[plant.motor], data.qacc[plant.motor] = q[t], v[t], a[t]
        mujoco.mj_inverse(plant.model, data)
        assert data.qfrc_inverse[plant.motor] == pytest.approx(expected[t], abs=1e-8)


def test_capsule_is_in_the_frame_of_the_joint(tmp_path: Path) -> None:
    """UR10's tool0 is turned and shifted on its last joint."""
    robot = build_robot(RobotSpec(urdf="example-robot-data:ur10", payload=payload("tool0")))
    assert robot.payload is not None
    capsule = robot.payload.capsule
    frame = robot.model.frames[robot.model.getFrameId("tool0")]
    assert (capsule.joint, capsule.links) == (frame.parentJoint, ("payload",))
    homogeneous = frame.placement.homogeneous
    assert np.abs(homogeneous - np.eye(4)).max() > 0.05
    assert capsule.end == pytest.approx((homogeneous @ [*CAPSULE["end"], 1.0])[:3])
    # A link of the same name is told apart.
    text = SMOKE.read_text(encoding="utf-8").replace('"tool"', '"payload"')
    (tmp_path / "arm.urdf").write_text(text, encoding="utf-8")
    robot = build_robot(RobotSpec(urdf="arm.urdf", payload=payload("payload")), tmp_path)
    names = [capsule.name for capsule in fit_capsules(robot, SelfCollisionSpec())]
    assert {"payload", "robot.payload"} <= set(names)


def test_neighbour_of_its_own_link_only() -> None:
    """On the wrist: never checked against it, checked against the links before and after."""
    robot = smoke(link="wrist", start=(0.2, 0, 0), end=(0.2, 0, 0.1))

    def chosen(**spec: object) -> tuple[set[frozenset[str]], dict[frozenset[str], Why]]:
        asked = SelfCollisionSpec.model_validate(spec)
        capsules = fit_capsules(robot, asked)
        assert [c.name for c in capsules if c.by_hand] == ["payload"]
        pairs = choose_pairs(robot, capsules, asked)
        checked = {frozenset((capsules[i].name, capsules[j].name)) for i, j in pairs.checked}
        return checked, {frozenset((d.first, d.second)): d.reason.why for d in pairs.dropped}

    checked, reasons = chosen()
    assert reasons[frozenset(("payload", "wrist"))] is Why.SAME_BODY
    for other in ("forearm", "tool", "upper_arm", "base"):
        assert reasons.get(frozenset(("payload", other))) is not Why.ADJACENT
    pair = frozenset(("payload", "upper_arm"))
    assert pair in checked
    assert chosen(ignore=(("payload", "upper_arm"),))[1][pair] is Why.IGNORED


def test_exported_urdf_is_the_robot_without_it(tmp_path: Path) -> None:
    """Loaded again with the same payload it gives what was identified, and not twice the load."""
    robot = smoke()
    phi = true_inertias(robot, 0.1, 3)
    exported = updated_urdf(robot, IdentifiedModel(phi))
    assert any("payload (2.5 kg on tool) is not in it" in note for note in exported.notes)
    path = tmp_path / "identified.urdf"
    path.write_text(exported.text, encoding="utf-8")
    again = build_robot(RobotSpec(urdf=str(path), payload=payload("tool")))
    assert standard_parameters(again) == pytest.approx(phi, abs=1e-12)
    unchanged = updated_urdf(robot, IdentifiedModel(standard_parameters(robot))).text
    path.write_text(unchanged, encoding="utf-8")
    bare = build_robot(RobotSpec(urdf=str(path)))
    expected = standard_parameters(build_robot(RobotSpec(urdf=str(SMOKE))))
    assert standard_parameters(bare) == pytest.approx(expected, abs=1e-12)
    assert any("is part of its body" in note for note in mjcf(robot, IdentifiedModel(phi)).notes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"link": "tol"}, r"robot.payload.link: the robot has no link 'tol'. Did you mean 'tool'"),
        ({"mass": 0.0}, r"it has an inertia but no mass"),
        ({"inertia": (0.1, 0.1, 0.3)}, r"no body has the moments 0.1, 0.1, 0.3"),
    ],
)
def test_what_cannot_be_is_refused(changes: dict[str, object], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        smoke(**changes)
