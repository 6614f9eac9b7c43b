"""What differs in held-out recordings is told; it is planted, and read in the sentence."""

from typing import Any

import numpy as np

from excite_cli.config.data_spec import FilterSpec
from excite_cli.diagnosis.held_out_difference import held_out_difference
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.catalogue import straight_friction
from excite_cli.effects.ripple import Ripple
from excite_cli.effects.torque_offset import TorqueOffset
from excite_cli.identification.identified_model import IdentifiedModel, errors_on
from excite_cli.identification.prepare import prepare
from excite_cli.identification.processing import choose_processing
from tests.identification.synthetic import measured
from tests.robot.random_robots import random_robot

ROBOT = random_robot(3, joints=3, prismatic=False)
EFFECTS = tuple(each for j in range(ROBOT.n) for each in straight_friction(j))
VALUES = np.tile([0.5, 1.0], ROBOT.n)
PHI = standard_parameters(ROBOT)


def said(errors: float = 0.01, trained: str = "train", **other: Any) -> str:
    """Of a recording that is not as the model has it."""
    truth = {"robot": ROBOT, "phi": PHI, "values": VALUES, "effects": EFFECTS, **other}
    dataset = measured(noise=0.02, seconds=20.0, seeds=[5], **truth)
    run = prepare(dataset.runs[0], choose_processing(dataset.runs, FilterSpec()))
    model = IdentifiedModel(PHI, EFFECTS, VALUES)
    predicted = [model.predicted(ROBOT, run)]
    now = errors_on(ROBOT, [run], predicted).mean_relative_moving
    found = held_out_difference(ROBOT, model, [run], predicted, [trained], (now, errors))
    return found[0].text if found else ""


def test_a_recording_like_the_others_has_no_line() -> None:
    assert said(errors=0.006) == ""
    assert said(values=0.6 * VALUES, errors=0.5) == ""
    assert said(values=0.6 * VALUES, trained="r1") == ""  # blocks of a recording that was fitted


def test_friction_that_is_less_is_told_joint_by_joint() -> None:
    text = said(values=0.6 * VALUES)
    assert "r1 differs from the training recordings" in text
    assert f"friction of {ROBOT.joint_names[0]} ×0.6, of {ROBOT.joint_names[1]} ×0.6" in text


def test_a_load_is_told() -> None:
    loaded = PHI.copy()
    loaded[-10] += 2.0
    loaded[-10 + 3] += 2.0 * 0.1
    assert "With another load at the end" in said(phi=loaded)


def test_a_mount_is_told_by_its_angle() -> None:
    down = ROBOT.model.gravity.linear
    leaning = ROBOT.with_gravity(np.linalg.norm(down) * np.array([np.sin(0.1), 0.0, -np.cos(0.1)]))
    assert "gravity 5.7° elsewhere" in said(robot=leaning)


def test_offsets_and_gains_are_told_and_what_none_of_these_is() -> None:
    offsets = tuple(TorqueOffset((j,)) for j in range(ROBOT.n))
    text = said(effects=(*EFFECTS, *offsets), values=np.append(VALUES, [3.0, 0.0, -2.0]))
    assert "torque offsets" in text
    ripples = tuple(Ripple((j,), {"periods": 5.0}) for j in range(ROBOT.n))
    text = said(effects=(*EFFECTS, *ripples), values=np.append(VALUES, np.full(2 * ROBOT.n, 4.0)))
    assert "No change of friction, offsets, gains, load or mount explains it" in text
