"""Exported actuators give the drive's torque in MuJoCo."""

import numpy as np
import pytest

from excite_cli.config.data_spec import EffectSpec
from excite_cli.export.mjcf import mjcf
from excite_cli.robot.model import Robot
from tests.export.drives import KD, KP, LIMIT, drive, identified, ur10

mujoco = pytest.importorskip("mujoco")


@pytest.fixture(scope="module")
def robot() -> Robot:
    return ur10()


def test_the_law_is_the_force(robot: Robot) -> None:
    exported = mjcf(robot, identified(robot), drive())
    model = mujoco.MjModel.from_xml_string(exported.text)
    data = mujoco.MjData(model)
    rng = np.random.default_rng(0)
    data.qpos[:], data.qvel[:], data.ctrl[:] = rng.normal(size=(3, 6))
    mujoco.mj_forward(model, data)
    law = KP * (data.ctrl - data.qpos) - KD * data.qvel
    assert (np.abs(law) > LIMIT).any(), "one is at its limit"
    assert data.qfrc_actuator == pytest.approx(np.clip(law, -LIMIT, LIMIT))
    assert [model.actuator(j).name for j in range(6)] == list(robot.joint_names)
    assert exported.notes[0] == "it has no shapes or sensors"
    assert "<position" in exported.text


def test_what_was_found_of_the_law_is_in_the_actuators(robot: Robot) -> None:
    found = identified(
        robot,
        EffectSpec(kind="torque_gain", joints=("elbow_joint",)),
        EffectSpec(kind="torque_offset", joints=("elbow_joint",)),
        EffectSpec(kind="armature", joints=("elbow_joint",)),
        numbers=(0.25, 5.0, 0.3),
    )
    exported = mjcf(robot, found, drive())
    assert not any("cannot hold" in note for note in exported.notes)
    assert any("torque_gain" in note for note in mjcf(robot, found).notes), "there is no actuator"
    model = mujoco.MjModel.from_xml_string(exported.text)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.ctrl[:] = 0.1, 0.2, 0.15
    mujoco.mj_forward(model, data)
    wanted = KP * 0.05 - KD * 0.2
    wanted[2] = (wanted[2] - 5.0) / 1.25
    assert data.qfrc_actuator == pytest.approx(wanted)
    assert model.dof_armature[2] == 0.3


@pytest.mark.skipif(not hasattr(mujoco.MjModel, "actuator_delay"), reason="MuJoCo has no delays")
@pytest.mark.parametrize("step", [2e-3, 5e-4])
def test_set_points_act_late(robot: Robot, step: float) -> None:
    exported = mjcf(robot, identified(robot), drive(delay=0.01))
    assert any("actuators delay ctrl by 0.01 s" in note for note in exported.notes)
    model = mujoco.MjModel.from_xml_string(exported.text)
    model.opt.timestep = step
    model.opt.gravity[:] = 0.0
    data = mujoco.MjData(model)
    data.ctrl[:] = 0.5
    began = None
    while began is None and data.time < 0.1:
        mujoco.mj_step(model, data)
        if np.abs(data.qfrc_actuator).max() > 1.0:
            began = data.time
    assert began == pytest.approx(0.01, abs=1.5 * step)


def test_a_mujoco_without_delays_has_the_number(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("excite_cli.export.mjcf._knows_delays", lambda: False)
    exported = mjcf(robot, identified(robot), drive(delay=0.01))
    assert "<!-- A set point acts 0.01 s after it was sent" in exported.text
    assert any("no delays: delay ctrl by 0.01 s yourself" in note for note in exported.notes)
    model = mujoco.MjModel.from_xml_string(exported.text)
    assert model.numeric("command_delay").data == [0.01]
