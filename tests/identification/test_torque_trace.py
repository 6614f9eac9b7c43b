"""Torque over time as it is kept: filtered, thinned, and marked where it must not be used."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.config.data_spec import FilterSpec
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.identification.prepare import PreparedRun, prepare
from excite_cli.identification.processing import choose_processing
from excite_cli.identification.torque_trace import MOST_SAMPLES, thinned, torque_trace
from excite_cli.measurement.run_identity import Part
from tests.identification.synthetic import measured
from tests.robot.random_robots import random_robot


@pytest.fixture(scope="module")
def prepared() -> tuple[PreparedRun, np.ndarray]:
    robot = random_robot(4, joints=3, branches=False, prismatic=False)
    phi = standard_parameters(robot)
    data = measured(robot, phi, noise=0.5, seconds=5.0)
    run = replace(data.runs[0], name="A 0-5 s", part=Part(2, 1, 0.0, 5.0))
    valid = np.ones(run.tau.shape, bool)
    middle = len(run.t) // 2
    valid[middle : middle + len(run.t) // 20, 1] = False
    run = replace(run, valid=valid)
    found = prepare(run, choose_processing(data.runs, FilterSpec()))
    return found, RigidBody(robot, phi, found.q, found.v, found.a).load


def test_it_is_what_errors_are_counted_from(prepared: tuple[PreparedRun, np.ndarray]) -> None:
    run, load = prepared
    trace = torque_trace(run, load, 2.0 * load, before=load, held_out=True)
    assert (trace.run, trace.held_out) == ("A 0-5 s/2", True)
    assert trace.predicted == pytest.approx(run.averaged_torque(2.0 * load), rel=1e-6, abs=1e-4)
    assert trace.before == pytest.approx(run.averaged_torque(load), rel=1e-6, abs=1e-4)
    assert trace.load == pytest.approx(trace.before)
    assert trace.q == pytest.approx(run.averaged(run.q), abs=1e-6)
    assert trace.t == pytest.approx(run.averaged(run.t[:, None])[:, 0], abs=1e-6)
    assert np.array_equal(np.isfinite(trace.measured), run.valid)
    assert not np.isfinite(trace.measured[:, 1]).all()
    assert trace.measured[run.valid] == pytest.approx(run.tau[run.valid], rel=1e-6)
    assert not trace.counted[~run.valid].any()
    assert np.array_equal(trace.counted, run.usable & run.valid)


def test_long_runs_are_thinned_evenly(prepared: tuple[PreparedRun, np.ndarray]) -> None:
    trace = torque_trace(prepared[0], prepared[1], prepared[1])
    many = -(-2 * MOST_SAMPLES // len(trace.t)) + 1

    def longer(x: np.ndarray) -> np.ndarray:
        return np.concatenate([x] * many)

    names = ("q", "v", "a", "load", "measured", "predicted", "counted")
    long = replace(trace, t=np.arange(many * len(trace.t)) * 0.01,
                   **{name: longer(getattr(trace, name)) for name in names})  # fmt: skip
    short = thinned(long)
    assert len(long.t) / 4 < len(short.t) <= MOST_SAMPLES
    steps = np.diff(short.t)
    assert steps == pytest.approx(steps[0], rel=1e-3)
    k = round(steps[0] / 0.01)
    assert np.array_equal(short.counted, long.counted[::k])
    assert np.array_equal(short.q, long.q[::k])
