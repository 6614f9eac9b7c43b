"""The regression, against torque computed by Pinocchio's own recursion."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from excite_cli.base_link.wrench_rows import with_base
from excite_cli.config.data_spec import FilterSpec, MeasurementSpec
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
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
from excite_cli.measurement.dataset import Dataset
from tests.base_link.stander import FEET, stander, swayed
from tests.identification.synthetic import measured
from tests.robot.random_robots import random_robot

ROBOT = random_robot(2, joints=3, branches=False, prismatic=False)


def effects() -> list[Effect]:
    return [ViscousFriction((0,)), CoulombFriction((2,)), Payload((0, 1, 2), {}, ("r2",))]


def test_columns_times_parameters_are_the_torque() -> None:
    """Y φ + friction against rnea, sample by sample, then averaged."""
    data = measured(ROBOT, standard_parameters(ROBOT), seconds=4.0)
    processing = choose_processing(data.runs, FilterSpec())
    runs = [prepare(run, processing) for run in data.runs]
    kinds = effects()[:2]
    found = build_regression(ROBOT, find_base_parameters(ROBOT), kinds, runs)
    phi, values = standard_parameters(ROBOT), np.array([1.5, 0.8])
    state = ROBOT.model.createData()
    for run, columns in zip(runs, found.runs, strict=True):
        tau = np.array(
            [
                pin.rnea(ROBOT.model, state, q, v, a)
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


def test_effects_stand_in_their_own_rows_and_runs() -> None:
    data = measured(ROBOT, standard_parameters(ROBOT), seconds=3.0)
    processing = choose_processing(data.runs, FilterSpec())
    runs = [prepare(run, processing) for run in data.runs]
    all_effects = effects()
    widths = [len(effect.parameters) for effect in all_effects]
    for run in runs:
        columns = effect_columns(all_effects, signals_of(run, ROBOT))
        assert columns.shape == (len(run.t), ROBOT.n, sum(widths))
        assert np.array_equal(columns[:, 0, 0], run.v[:, 0])
        assert not columns[:, 1:, 0].any()
        assert not columns[:, :2, 1].any()
        assert columns[:, :, 2:].any() == (run.run.name == "r2")
    # No effects give no columns.
    run = prepare(data.runs[0], choose_processing(data.runs, FilterSpec()))
    assert effect_columns([], signals_of(run, ROBOT)).shape == (len(run.t), ROBOT.n, 0)


def test_columns_and_what_is_taken_off_are_the_whole_torque(tmp_path: Path) -> None:
    robot = stander(tmp_path)
    wrench = [{"channel": foot, "link": foot} for foot in FEET]
    spec = MeasurementSpec.model_validate({"base": {"pose": "pose"}, "wrench": wrench})
    log = Dataset(robot.joint_names[6:], (swayed(samples=400).run,))
    (run,) = with_base(robot, log, spec, True)[0].runs
    prepared = prepare(run, choose_processing([run], FilterSpec()))
    base, phi = find_base_parameters(robot), standard_parameters(robot)
    (columns,) = build_regression(robot, base, (), [prepared]).runs
    whole = prepared.averaged_for_fit(
        RigidBody(robot, phi, prepared.q, prepared.v, prepared.a).load
    )
    taken_off = prepared.tau_fit - columns.tau
    shown = columns.inertial @ (base.mapping @ phi)
    assert shown + taken_off == pytest.approx(whole, abs=1e-9 * np.abs(whole).max())
    # The trunk turns: its own moments of inertia are what those columns lack.
    assert np.abs(taken_off[:, 3:6]).max() > 0.5
    rest = np.abs(columns.tau - shown)[columns.prepared.usable].max()
    assert rest < 0.1 * np.abs(taken_off).max()
