"""The regression, against torque computed by Pinocchio's own recursion."""

import numpy as np
import pinocchio as pin
import pytest

from excite_cli.config.data_spec import FilterSpec
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.base import Effect
from excite_cli.effects.coulomb_friction import CoulombFriction
from excite_cli.effects.payload import Payload
from excite_cli.effects.viscous_friction import ViscousFriction
from excite_cli.identification.prepare import prepare
from excite_cli.identification.processing import choose_processing
from excite_cli.identification.regression import (
    build_regression,
    effect_columns,
    signals_of,
)
from excite_cli.robot.model import Robot
from tests.identification.synthetic import measured
from tests.robot.random_robots import random_robot


@pytest.fixture(scope="module")
def robot() -> Robot:
    return random_robot(2, joints=3, branches=False, prismatic=False)


def effects(robot: Robot) -> list[Effect]:
    return [ViscousFriction((0,)), CoulombFriction((2,)), Payload((0, 1, 2), {}, ("r2",))]


def test_columns_times_parameters_are_the_torque(robot: Robot) -> None:
    """Y φ + friction against rnea, sample by sample, then averaged."""
    data = measured(robot, standard_parameters(robot), seconds=4.0)
    processing = choose_processing(data.runs, FilterSpec())
    runs = [prepare(run, processing) for run in data.runs]
    kinds = effects(robot)[:2]
    found = build_regression(robot, find_base_parameters(robot), kinds, runs)
    phi, values = standard_parameters(robot), np.array([1.5, 0.8])
    state = robot.model.createData()
    for run, columns in zip(runs, found.runs, strict=True):
        tau = np.array(
            [
                pin.rnea(robot.model, state, q, v, a)
                for q, v, a in zip(run.q, run.v, run.a, strict=True)
            ]
        )
        tau[:, 0] += 1.5 * run.v[:, 0]
        tau[:, 2] += 0.8 * np.tanh(run.v[:, 2] / 1e-3)
        modelled = columns.inertial @ (found.base.mapping @ phi) + columns.effects @ values
        assert modelled == pytest.approx(run.averaged_for_fit(tau), rel=1e-6, abs=1e-6)
        parameters = np.append(found.base.mapping @ phi, values)
        assert columns.columns @ parameters == pytest.approx(modelled, rel=1e-12, abs=1e-12)
        assert columns.tau is run.tau_fit
        assert columns.prepared is run


def test_effects_stand_in_their_own_rows_and_runs(robot: Robot) -> None:
    data = measured(robot, standard_parameters(robot), seconds=3.0)
    processing = choose_processing(data.runs, FilterSpec())
    runs = [prepare(run, processing) for run in data.runs]
    all_effects = effects(robot)
    widths = [len(effect.parameters) for effect in all_effects]
    for run in runs:
        columns = effect_columns(all_effects, signals_of(run, robot))
        assert columns.shape == (len(run.t), robot.n, sum(widths))
        assert np.array_equal(columns[:, 0, 0], run.v[:, 0])
        assert not columns[:, 1:, 0].any()
        assert not columns[:, :2, 1].any()
        assert columns[:, :, 2:].any() == (run.run.name == "r2")


def test_no_effects_give_no_columns(robot: Robot) -> None:
    data = measured(robot, standard_parameters(robot), seconds=3.0)
    run = prepare(data.runs[0], choose_processing(data.runs, FilterSpec()))
    assert effect_columns([], signals_of(run, robot)).shape == (len(run.t), robot.n, 0)
