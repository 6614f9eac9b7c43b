"""Plant and recover with an engine that is not ours: MuJoCo plays, we identify."""

from dataclasses import dataclass

import numpy as np
import pytest

from excite_cli.config.load import parse_spec
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.catalogue import declared_effects
from excite_cli.identification.identify import Identification, identify
from excite_cli.robot.model import Array, Robot, build_robot
from excite_cli.simulation.planned_motion import PlannedMotion
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate
from excite_cli.trajectory.fourier import FourierTrajectory

pytest.importorskip("mujoco")
SPEC = parse_spec(
    "{robot: {urdf: x}, effects: [{kind: viscous_friction}, {kind: coulomb_friction}]}"
)


def lively(robot: Robot, seed: int) -> PlannedMotion:
    rng = np.random.default_rng(seed)
    trajectory = FourierTrajectory(5, 2 * np.pi / 8.0)
    coefficients = 0.1 * rng.normal(size=(trajectory.n_coefficients, robot.n))
    coefficients[-1] = rng.uniform(-1.0, 1.0, robot.n)
    return PlannedMotion(f"m{seed}", trajectory, coefficients)


@dataclass(frozen=True)
class Recovered:
    found: Identification
    truth: Array  # base parameters, then friction
    cad: Array


@pytest.fixture(scope="module")
def recovered() -> Recovered:
    robot = build_robot(RobotSpec(urdf="example-robot-data:ur10"))
    base = find_base_parameters(robot)
    motions = [lively(robot, seed) for seed in (1, 2, 3)]
    effects = declared_effects(SPEC.effects, robot)
    settings = SimulationSettings(torque_noise=0.02, noise_correlation=0.9)
    played = simulate(robot, motions, settings, declared=effects)
    found = identify(robot, base, played.dataset, SPEC)
    friction = np.concatenate([planted.values for planted in played.truth.effects])
    truth = np.append(base.mapping @ played.truth.phi, friction)
    return Recovered(found, truth, base.mapping @ standard_parameters(robot))


def test_true_inertias_and_friction_lie_within_their_intervals(recovered: Recovered) -> None:
    fit = recovered.found.fit
    z = (fit.values - recovered.truth) / fit.std
    assert np.abs(z).max() < 4.0
    assert (
        np.abs(fit.values - recovered.truth)[: fit.rank].max()
        < 0.2 * np.abs(recovered.cad - recovered.truth[: fit.rank]).max()
    )


def test_the_error_on_the_held_out_run_is_the_noise(recovered: Recovered) -> None:
    error = recovered.found.error
    assert error.mean_relative < 0.03
    for joint, raw in error.rms_raw.items():
        assert error.rms[joint] < 1.2 * raw


def test_real_bodies_explain_it_as_well(recovered: Recovered) -> None:
    consistent = recovered.found.fit.consistent
    assert consistent is not None
    assert consistent.solved
    assert consistent.eigenvalues.min() > 0
    assert consistent.cost < 10
