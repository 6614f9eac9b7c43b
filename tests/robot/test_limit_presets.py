"""Limits of a robot's manual: which joints they are of, and what the config states beside them."""

from typing import Any

import numpy as np
import pytest

from excite_cli.config.robot_spec import LIMIT_PRESETS, JointLimits, RobotSpec
from excite_cli.errors import ConfigError
from excite_cli.robot.model import Robot, build_robot

ARM = tuple(f"panda_joint{k}" for k in range(1, 8))


def panda(**given: Any) -> Robot:
    spec = RobotSpec(
        urdf="example-robot-data:panda", joints=ARM, limits_preset="franka_emika_panda", **given
    )
    return build_robot(spec)


@pytest.mark.parametrize("name", LIMIT_PRESETS)
def test_every_preset_says_where_it_is_from_and_has_a_number_per_joint(name: str) -> None:
    preset = LIMIT_PRESETS[name]
    assert preset.source.startswith("https://")
    for key in ("position", "velocity", "acceleration", "jerk", "effort"):
        values = getattr(preset, key)
        assert len(values) in (0, len(preset.joints))
        assert (
            all(low < high for low, high in values)
            if key == "position"
            else min(values, default=1) > 0
        )


def test_limits_are_those_of_the_manual_and_fingers_keep_their_own() -> None:
    limits = panda().limits
    assert limits.lower == pytest.approx(
        [-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973]
    )
    assert limits.upper == pytest.approx([2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973])
    assert limits.velocity == pytest.approx([2.175] * 4 + [2.61] * 3)
    assert limits.acceleration == pytest.approx([15, 7.5, 10, 12.5, 15, 20, 20])
    assert limits.jerk == pytest.approx([7500, 3750, 5000, 6250, 7500, 10000, 10000])
    assert limits.effort == pytest.approx([87] * 4 + [12] * 3)
    preset = LIMIT_PRESETS["franka_emika_panda"]
    names = [*ARM, "panda_finger_joint1", "panda_finger_joint2"]
    assert [name for name, _ in preset.of_joints(names)] == list(ARM)


@pytest.mark.parametrize(
    ("preset", "names"),
    [
        ("franka_research_3", [f"left_fr3_joint{k}" for k in range(1, 8)]),
        ("kuka_lbr_iiwa_14", [f"iiwa_joint_{k}" for k in range(1, 8)]),
        ("kuka_lbr_iiwa_14", [f"lbr_A{k}" for k in range(1, 8)]),
        ("ur5e", ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint",
                  *(f"wrist_{k}_joint" for k in (1, 2, 3))]),
    ],
)  # fmt: skip
def test_joints_are_known_by_how_their_names_end(preset: str, names: list[str]) -> None:
    assert not LIMIT_PRESETS[preset].missing(names)
    assert [name for name, _ in LIMIT_PRESETS[preset].of_joints(names)] == names


def test_what_the_config_states_stands_before_the_preset() -> None:
    own = {
        "panda_joint1": JointLimits(velocity=1.0),
        "panda_joint2": JointLimits(effort_by_speed=((0.0, 50.0), (2.0, 20.0))),
    }
    limits = panda(limits=own).limits
    assert limits.velocity[:2] == pytest.approx([1.0, 2.175])
    assert limits.jerk[:2] == pytest.approx([7500, 3750])
    assert limits.effort[:3] == pytest.approx([87, 50, 87])
    np.testing.assert_allclose(limits.curves[1].effort(np.array([-1.0, 1.0, 3.0])), [50, 35, 5])


def test_a_preset_of_another_robot_is_refused() -> None:
    spec = RobotSpec(urdf="example-robot-data:ur10", limits_preset="franka_emika_panda")
    told = (
        r"robot.limits_preset: Franka .* joint 1, 2, 3, 4, 5, 6, 7 .* Joints: shoulder_pan_joint,"
    )
    with pytest.raises(ConfigError, match=told):
        build_robot(spec)
