"""What a model predicts for a run is what its regression says, and errors are counted from it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from excite_cli.config.data_spec import FilterSpec
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Effect
from excite_cli.effects.coulomb_friction import CoulombFriction
from excite_cli.effects.load_dependent_friction import LoadDependentFriction
from excite_cli.effects.payload import Payload
from excite_cli.effects.sign import smooth_sign
from excite_cli.effects.torque_delay import TorqueDelay
from excite_cli.effects.viscous_friction import ViscousFriction
from excite_cli.identification.identified_model import IdentifiedModel, errors_on
from excite_cli.identification.prepare import PreparedRun, prepare
from excite_cli.identification.processing import choose_processing
from excite_cli.identification.regression import build_regression, rebuilt
from excite_cli.measurement.run_identity import RunId
from excite_cli.robot.model import Array
from tests.identification.synthetic import measured
from tests.robot.random_robots import random_robot

ROBOT = random_robot(4, joints=3, branches=False, prismatic=False)


@pytest.fixture(scope="module")
def runs() -> list[PreparedRun]:
    data = measured(ROBOT, standard_parameters(ROBOT), noise=0.5, seconds=5.0)
    processing = choose_processing(data.runs, FilterSpec())
    return [prepare(run, processing) for run in data.runs]


def effects() -> tuple[Effect, ...]:
    return (
        ViscousFriction((0,)),
        CoulombFriction((2,)),
        LoadDependentFriction((1,)),
        Payload((0, 1, 2), {}, ("r2",)),
    )


def torque(
    phi: Array, kinds: Sequence[Effect], values: Array, run: PreparedRun, name: RunId
) -> Array:
    return (
        IdentifiedModel(phi, tuple(kinds), values).predicted(ROBOT, replace(run, run=name)).torque
    )


def test_prediction_is_columns_times_parameters(runs: list[PreparedRun]) -> None:
    """On inertias other than the URDF's; one effect looks at the load, one is in one run only."""
    rng = np.random.default_rng(0)
    phi = standard_parameters(ROBOT) * rng.uniform(0.8, 1.2, 10 * ROBOT.n_bodies)
    kinds = effects()
    values = rng.uniform(0.1, 0.5, sum(len(e.parameters) for e in kinds))
    regression = build_regression(ROBOT, find_base_parameters(ROBOT), kinds, runs, phi)
    regression = rebuilt(regression, phi, values)  # the payload is part of the load
    for run, columns in zip(runs, regression.runs, strict=True):
        tau = torque(phi, kinds, values, run, run.run)
        assert tau.shape == run.q.shape
        modelled = columns.inertial @ (regression.base.mapping @ phi) + columns.effects @ values
        assert run.averaged_for_fit(tau) == pytest.approx(modelled, rel=1e-9, abs=1e-9)


def test_an_effect_acts_in_its_runs_by_the_name_that_is_given(runs: list[PreparedRun]) -> None:
    phi = standard_parameters(ROBOT)
    payload = (Payload((0, 1, 2), {}, ("r2",)),)
    values = np.full(len(payload[0].parameters), 0.3)
    one, two = (torque(phi, payload, values, runs[0], RunId(name)) for name in ("r1", "r2"))
    load = RigidBody(ROBOT, phi, runs[0].q, runs[0].v, runs[0].a).load
    assert np.array_equal(one, load)
    assert np.abs(two - load).max() > 0.1
    # Gears carry the payload too.
    run, (payload, friction) = runs[0], (Payload((0, 1, 2)), LoadDependentFriction((1,)))
    mass, ratio = np.array([2.0, 0.0, 0.0, 0.1, 0.01, 0.0, 0.01, 0.0, 0.0, 0.01]), np.array([0.2])
    alone, carrying = (
        torque(phi, kinds, values, run, run.run)
        for kinds, values in (
            ((payload,), mass),
            ((payload, friction), np.append(mass, ratio)),
        )
    )
    sign = smooth_sign(run.v[:, 1])
    assert carrying[:, 1] - alone[:, 1] == pytest.approx(0.2 * np.abs(alone[:, 1]) * sign)


def test_a_delay_acts_on_all_torque_that_the_robot_makes(runs: list[PreparedRun]) -> None:
    """τ(t − δ) with τ = load + friction, to first order, and no delay of the delayed."""
    phi, run = standard_parameters(ROBOT), runs[0]
    kinds = (ViscousFriction((1,)), TorqueDelay((1,)))
    tau = torque(phi, kinds, np.array([30.0, 0.01]), run, RunId("r1"))
    whole = RigidBody(ROBOT, phi, run.q, run.v, run.a).load.copy()
    whole[:, 1] += 30.0 * run.v[:, 1]
    late = CubicSpline(run.t, whole[:, 1])(run.t - 0.01)
    inside = slice(5, -5)
    size = np.sqrt(np.mean((late - whole[:, 1])[inside] ** 2))
    assert np.sqrt(np.mean((tau[:, 1] - late)[inside] ** 2)) < 0.05 * size
    assert np.array_equal(tau[:, 0], RigidBody(ROBOT, phi, run.q, run.v, run.a).load[:, 0])


def test_errors_are_those_of_the_residual(runs: list[PreparedRun]) -> None:
    phi = 1.05 * standard_parameters(ROBOT)
    found = errors_on(
        ROBOT,
        runs,
        [IdentifiedModel(phi).predicted(ROBOT, run) for run in runs],
    )
    tau = np.concatenate([run.tau for run in runs])
    model = np.concatenate(
        [run.averaged(RigidBody(ROBOT, phi, run.q, run.v, run.a).load) for run in runs]
    )
    moving = np.concatenate([run.moving for run in runs])
    for j, name in enumerate(ROBOT.joint_names):
        error = tau[:, j] - model[:, j]
        relative = np.linalg.norm(error) / np.linalg.norm(tau[:, j])
        assert found.relative[name] == pytest.approx(relative)
        assert found.rms[name] == pytest.approx(np.sqrt(np.mean(error**2)))
        slow = moving[:, j]
        assert found.relative_moving[name] == pytest.approx(
            np.linalg.norm(error[slow]) / np.linalg.norm(tau[slow, j])
        )
        assert found.rms_raw[name] > found.rms[name]  # with the noise that averages take away
    assert found.mean_relative == pytest.approx(np.mean(list(found.relative.values())))
    assert found.interval[0] <= found.mean_relative <= found.interval[1]
