"""What differs in held-out recordings is told; it is planted, and read in the sentence."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

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


def said(
    errors: float = 0.01, seeds: tuple[int, int] = (5, 6), push: float = 0.0, **other: Any
) -> str:
    """Of a recording r2 that is not as the model has it; r1 is fitted. `push` [N·m] for 1.5 s.

    `mounted`: the robot as the model has it, too.
    """
    robot = other.pop("mounted", ROBOT)
    truth = {"robot": robot, "phi": PHI, "values": VALUES, "effects": EFFECTS, **other}
    dataset = measured(noise=0.02, seconds=20.0, seeds=seeds, **truth)
    one, other_ = dataset.runs
    pushed = push * ((other_.t > 8.0) & (other_.t < 9.5))
    recorded = (one, replace(other_, tau=other_.tau + pushed[:, None]))
    trained, run = (prepare(r, choose_processing(recorded, FilterSpec())) for r in recorded)
    model = IdentifiedModel(PHI, EFFECTS, VALUES)
    predicted = [model.predicted(robot, run)]
    now = errors_on(robot, [run], predicted).mean_relative_moving
    found = held_out_difference(robot, model, [run], predicted, [trained], (now, errors))
    return found[0].text if found else ""


def test_a_recording_like_the_others_has_no_line() -> None:
    assert said(errors=0.006) == ""
    assert said(values=0.6 * VALUES, errors=0.5) == ""


def test_friction_that_is_less_is_told_joint_by_joint() -> None:
    text = said(values=0.6 * VALUES)
    assert "r2 differs from the training recordings" in text
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


def test_without_gravity_no_mount_is_sought() -> None:
    weightless = ROBOT.with_gravity(np.zeros(3))
    assert "friction of" in said(mounted=weightless, values=0.6 * VALUES)


def test_offsets_and_gains_are_told_and_what_none_of_these_is() -> None:
    offsets = tuple(TorqueOffset((j,)) for j in range(ROBOT.n))
    text = said(effects=(*EFFECTS, *offsets), values=np.append(VALUES, [3.0, 0.0, -2.0]))
    assert "torque offsets" in text
    ripples = tuple(Ripple((j,), {"periods": 5.0}) for j in range(ROBOT.n))
    text = said(effects=(*EFFECTS, *ripples), values=np.append(VALUES, np.full(2 * ROBOT.n, 4.0)))
    assert "No change of friction, offsets, gains, load or mount explains it" in text


def test_a_push_is_told_by_its_time_and_nothing_is_guessed() -> None:
    text = said(push=20.0)
    assert "explains it: most of it is between" in text
    start, end = re.findall(r"between ([0-9.]+) and ([0-9.]+) s", text)[0]
    assert float(start) == pytest.approx(8.0, abs=0.7)
    assert float(end) == pytest.approx(9.5, abs=0.7)
    ripples = tuple(Ripple((j,), {"periods": 5.0}) for j in range(ROBOT.n))
    other = {"effects": (*EFFECTS, *ripples), "values": np.append(VALUES, np.full(6, 4.0))}
    assert "explains it. Have" in said(seeds=(5, 5), **other)


def test_parts_of_a_recording_that_was_fitted_have_no_line() -> None:
    runs = measured(ROBOT, PHI, seeds=[5]).runs
    run = prepare(runs[0], choose_processing(runs, FilterSpec()))
    model = IdentifiedModel(PHI)
    predicted = [model.predicted(ROBOT, run)]
    assert held_out_difference(ROBOT, model, [run], predicted, [run], (0.9, 0.01)) == ()
