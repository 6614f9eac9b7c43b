"""A gripper whose fingers follow, on a wrist of two motors: from its URDF to a named effect."""

from pathlib import Path

import numpy as np
import pytest

from excite_cli import (
    check,
    diagnose,
    identify,
    load_data,
    load_problem,
    plan,
    simulate,
    write_dataset,
)
from excite_cli.excitation.problem import Problem
from excite_cli.measurement.hdf5_writer import new_hdf5
from excite_cli.proposal.propose import Request, propose
from excite_cli.robot.model import Array
from excite_cli.simulation.simulate import Simulation
from tests.robot.coupled_robots import HAND, written

pytest.importorskip("mujoco")

JOINTS = ("shoulder", "wrist", "finger_1")
MATRIX = np.array([[0.5, 0.5], [0.4, -0.6]])
MOTORS = """  transmissions:
    - {joints: [shoulder, wrist], motors: [m1, m2], matrix: [[0.5, 0.5], [0.4, -0.6]],
       limits: {m1: {velocity: 2.0}}}
"""


@pytest.fixture(scope="module")
def config(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("hand")
    proposal = propose(Request(Path(written(folder, HAND)).name, folder, JOINTS))
    assert proposal.joints == JOINTS
    assert "moved with finger_1: finger_2" in proposal.notes
    path = folder / "hand.yaml"
    path.write_text(proposal.text.replace("  posture:", f"{MOTORS}  posture:"))
    return path


@pytest.fixture(scope="module")
def problem(config: Path) -> Problem:
    return load_problem(config, ["optimizer.max_iterations=25", "sequence.motions=2"])


@pytest.fixture(scope="module")
def played(problem: Problem, config: Path) -> Simulation:
    result = plan(problem, output=config.parent / "hand.h5")
    inspections = check(problem, result)
    assert not any(each.violations for each in inspections.values())
    for each in inspections.values():
        states = {name: state for name, (state, _) in each.states.items()}
        assert states["self_collision"] == states["motor_velocity"] == "proved"
    return simulate(problem, result, ["viscous_friction@finger_1=2"])


def test_friction_of_the_gripper_is_found(problem: Problem, played: Simulation) -> None:
    found = diagnose(problem, played.dataset)
    (named,) = found.effects
    assert (named.effect.kind, named.effect.joints) == ("viscous_friction", ("finger_1",))
    assert named.parameters["viscous"].value == pytest.approx(2.0, rel=0.02)
    assert found.after.mean_relative_moving < 0.01


def test_a_log_of_the_motors_gives_the_same_fit(
    config: Path, played: Simulation, tmp_path: Path
) -> None:
    at_joints = tmp_path / "joints.h5"
    write_dataset(at_joints, played.dataset, {})
    at_motors = tmp_path / "motors.h5"
    with new_hdf5(at_motors) as file:
        file.attrs["joint_names"] = ["m1", "m2", "finger_1"]
        for run in played.dataset.runs:
            group = file.create_group(f"runs/{run.name}")
            group["t"] = run.t
            for name, x, back in (
                ("q", run.q, np.linalg.inv(MATRIX).T),
                ("dq", run.dq, np.linalg.inv(MATRIX).T),
                ("tau", run.tau, MATRIX),
            ):
                assert x is not None
                whole: Array = x.copy()
                whole[:, :2] = x[:, :2] @ back
                group[name] = whole
    changes = ["effects=[{kind: viscous_friction}]"]
    of_joints = load_problem(config, changes)
    of_motors = load_problem(
        config, [*changes, "measurement.torque=motor", "measurement.position=motor"]
    )
    one = identify(of_joints, load_data(of_joints, at_joints)).fit
    other = identify(of_motors, load_data(of_motors, at_motors)).fit
    np.testing.assert_allclose(one.values, other.values, rtol=1e-5, atol=1e-7)
