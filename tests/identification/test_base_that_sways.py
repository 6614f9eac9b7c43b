"""What the columns of a base held still leave out, where it sways, is taken off the wrench."""

from pathlib import Path

import numpy as np
import pytest

from excite_cli.base_link.rows import with_base
from excite_cli.config.data_spec import FilterSpec, MeasurementSpec
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.identification.prepare import prepare
from excite_cli.identification.processing import choose_processing
from excite_cli.identification.regression import build_regression
from excite_cli.measurement.dataset import Dataset
from tests.base_link.stander import FEET, stander, swayed


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
