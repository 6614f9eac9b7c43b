"""The drive of a config, and what an identified model corrects of it."""

import numpy as np
import pytest

from excite_cli.config.data_spec import EffectSpec
from excite_cli.errors import ConfigError
from excite_cli.export.drive import drive_of
from tests.export.drives import KD, KP, drive, identified, spec_with, ur10

NAMES = ("hip", "knee")


def test_numbers_for_all_joints_or_one_by_one() -> None:
    command = {"kp": {"hip": 20.0, "knee": 30.0}, "kd": 1.5, "delay": 0.004, "limit": 23.7}
    found = drive_of(spec_with(command), NAMES)
    assert found is not None
    assert found.kp.tolist() == [20.0, 30.0]
    assert found.kd.tolist() == [1.5, 1.5]
    assert found.limit.tolist() == [23.7, 23.7]
    assert found.delay == 0.004
    bare = drive_of(spec_with({"kp": 20, "limit": {"knee": 5}}), NAMES)
    assert bare is not None
    assert (bare.kd.tolist(), bare.limit.tolist(), bare.delay) == ([0, 0], [np.inf, 5.0], 0.0)


def test_measured_torques_have_no_drive() -> None:
    assert drive_of(spec_with({"kp": 20}, torque="link"), NAMES) is None


def test_gains_that_nobody_knows_are_asked_for() -> None:
    with pytest.raises(ConfigError, match=r"measurement\.command\.kp: no gain is given"):
        drive_of(spec_with({}), NAMES)


def test_gain_and_offset_of_the_law_are_those_of_the_drive() -> None:
    """τ_log = (1 + g) τ + b."""
    robot = ur10()
    model = identified(
        robot,
        EffectSpec(kind="torque_gain", joints=("elbow_joint",)),
        EffectSpec(kind="torque_offset", joints=("elbow_joint",)),
        numbers=(0.25, 5.0),
    )
    found = drive().corrected(model)
    share = np.array([1.0, 1.0, 0.8, 1.0, 1.0, 1.0])
    assert found.kp == pytest.approx(share * KP)
    assert found.kd == pytest.approx(share * KD)
    assert found.limit[2] == 80.0
    assert found.bias.tolist() == [0.0, 0.0, -4.0, 0.0, 0.0, 0.0]
