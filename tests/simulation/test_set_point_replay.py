"""Set points on models with actuators: the true model moves as the robot did, others do not."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.export.drive import Drive
from excite_cli.export.mjcf import mjcf
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.robot.model import Array, Robot
from excite_cli.simulation.set_point_replay import (
    SetPointErrors,
    SetPointInput,
    set_point_errors,
)
from excite_cli.simulation.simulate import Simulation
from tests.simulation.arms import IDEAL, planted, played, states
from tests.simulation.test_position_drive import DRIVE, KD, KP

mujoco = pytest.importorskip("mujoco")
HORIZONS = (0.1, 1.0, 3.0)


@pytest.fixture(scope="module")
def simulation(robot: Robot) -> Simulation:
    frictions = [planted("coulomb_friction", (j,), c) for j, c in enumerate((4, 6, 4, 1, 1, 0.5))]
    rotors = [planted("armature", (j,), c) for j, c in enumerate((1, 1, 0.5, 0.2, 0.2, 0.1))]
    settings = replace(IDEAL, drive=DRIVE, lead_in=1.0)
    return played(robot, *frictions, *rotors, settings=settings)


def truth(simulation: Simulation) -> IdentifiedModel:
    effects = simulation.truth.effects
    values = np.concatenate([each.values for each in effects])
    return IdentifiedModel(simulation.truth.phi, tuple(e.effect for e in effects), values)


def drive(delay: float = 0.0, limit: float = np.inf) -> Drive:
    return Drive(np.array(KP), np.array(KD), np.full(6, limit), np.zeros(6), delay)


def recorded(simulation: Simulation, first: int = 50) -> SetPointInput:
    (run,) = simulation.dataset.runs
    q, v, _ = states(run)
    return SetPointInput(run.t[first:], q[first:], v[first:], run.t, run.extra["q_cmd"])


def errors(
    robot: Robot, model: IdentifiedModel, run: SetPointInput, delay: float = DRIVE.delay
) -> SetPointErrors:
    return set_point_errors(mjcf(robot, model, drive()).text, [run], delay, HORIZONS)


@pytest.mark.long
def test_the_true_robot_is_followed_and_another_is_not(
    robot: Robot, simulation: Simulation
) -> None:
    run = recorded(simulation)
    true = errors(robot, truth(simulation), run)
    assert true.whole.max() < 5e-4
    assert true.after.max() < 5e-4
    assert not true.lost
    untuned = errors(robot, IdentifiedModel(standard_parameters(robot)), run)
    assert untuned.whole.max() > 8 * true.whole.max()
    assert (untuned.after[:, 1:] > 5 * true.after[:, 1:]).all(), "the first joint has no gravity"
    assert errors(robot, truth(simulation), run, delay=0.01).whole.max() > 10 * true.whole.max()


@pytest.mark.long
def test_errors_are_those_at_the_horizon_over_starts(robot: Robot, simulation: Simulation) -> None:
    """One more joint angle in what was measured at the ends alone shows at that horizon alone."""
    run = recorded(simulation)
    found = errors(robot, truth(simulation), run)
    assert found.starts.tolist() == [40, 40, 40]
    shifted = run.q.copy()
    shifted[-1, 2] += 0.5  # no start is there, and one end of each horizon is
    other = errors(robot, truth(simulation), replace(run, q=shifted))
    for h in range(len(HORIZONS)):
        assert other.after[h, 2] == pytest.approx(0.5 / np.sqrt(40), rel=0.02)
    np.testing.assert_allclose(other.after[:, :2], found.after[:, :2])
    assert other.whole[2] == pytest.approx(0.5 / np.sqrt(len(run.t) - 1), rel=0.05)


def test_logs_shorter_than_a_horizon_have_no_error_there(
    robot: Robot, simulation: Simulation
) -> None:
    run = recorded(simulation)
    short = replace(run, t=run.t[:400], q=run.q[:400], v=run.v[:400])
    found = errors(robot, truth(simulation), short)
    assert found.starts.tolist() == [40, 0, 0]
    assert np.isnan(found.after[1:]).all()
    assert np.isfinite(found.after[0]).all()
    both = set_point_errors(mjcf(robot, truth(simulation), drive()).text, [run, short], 0.02)
    assert both.starts[0] == 40, "runs have shares of the starts"


def test_a_model_that_falls_over_is_reported(robot: Robot, simulation: Simulation) -> None:
    run = recorded(simulation)
    weak = mjcf(robot, truth(simulation), drive(limit=1.0)).text
    found = set_point_errors(weak, [run], DRIVE.delay, HORIZONS)
    assert found.lost
    assert found.whole.max() <= np.pi


def test_the_exported_file_moves_as_the_replay(robot: Robot, simulation: Simulation) -> None:
    """With its own delay, stepped by MuJoCo alone, to rounding."""
    if not hasattr(mujoco.MjModel, "actuator_delay"):
        pytest.skip("MuJoCo has no delays")
    run = recorded(simulation)
    model = mujoco.MjModel.from_xml_string(mjcf(robot, truth(simulation), drive(DRIVE.delay)).text)
    data = mujoco.MjData(model)
    substeps = round((run.t[1] - run.t[0]) / model.opt.timestep)
    whole = recorded(simulation, 0)
    data.qpos[:], data.qvel[:] = run.q[0], run.v[0]
    moved = []
    lead = round(DRIVE.delay / model.opt.timestep)
    times = run.t[0] - DRIVE.delay + np.arange(lead + 400 * substeps) * model.opt.timestep
    newest = np.searchsorted(whole.sent, times + 1e-6, side="right") - 1
    for k, ctrl in enumerate(whole.ctrl[newest]):
        data.ctrl[:] = ctrl
        if k < lead:  # only the history of set points is filled
            mujoco.mj_step(model, data)
            data.qpos[:], data.qvel[:] = run.q[0], run.v[0]
            continue
        mujoco.mj_step(model, data)
        moved.append(data.qpos.copy())
    ends = np.array(moved)[substeps - 1 :: substeps]
    cut = replace(run, t=run.t[:401], q=run.q[:401], v=run.v[:401])
    predicted: Array = ends - cut.q[1:]
    found = errors(robot, truth(simulation), cut)
    rms = np.sqrt(np.mean(predicted**2, axis=0))
    np.testing.assert_allclose(rms, found.whole, rtol=1e-6)
