"""Structure without a name: the quantity behind it is named, and noise names nothing."""

import numpy as np
import pytest
from scipy.signal import lfilter

from excite_cli.diagnosis.covariate import Covariate
from excite_cli.diagnosis.noise_model import NoiseModel, fit_noise
from excite_cli.diagnosis.records import Unexplained
from excite_cli.diagnosis.training import TrainingData
from excite_cli.diagnosis.unexplained import unexplained_structure
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.base import Signals
from excite_cli.identification.regression import Regression, signals_of
from excite_cli.robot.model import Array, Robot
from tests.identification.synthetic import measured, regression_of
from tests.robot.random_robots import random_robot

RULES = (0.01, 0.01, 1.0)
NOISE = 0.2


@pytest.fixture(scope="module")
def robot() -> Robot:
    return random_robot(2, joints=2, branches=False, prismatic=False)


@pytest.fixture(scope="module")
def regression(robot: Robot) -> Regression:
    """Without noise: the model explains all of it."""
    data = measured(robot, standard_parameters(robot), seconds=20.0, seeds=(1, 2, 3))
    return regression_of(robot, data)


@pytest.fixture(scope="module")
def signals(robot: Robot, regression: Regression) -> list[Signals]:
    return [signals_of(run.prepared, robot) for run in regression.runs]


def found(
    regression: Regression, signals: list[Signals], extra: list[Array], levels: Array | None = None
) -> list[Unexplained]:
    """`extra` (M, n) is added to the torque of every run; `levels` (n,) of its noise."""
    base, robot = regression.base, regression.robot
    prepared = [run.prepared for run in regression.runs]
    declared = tuple(
        run.averaged_for_fit(s.body.regressor)[:, :, base.selection]
        for run, s in zip(prepared, signals, strict=True)
    )
    phi = standard_parameters(robot)
    tau = tuple(d @ (base.mapping @ phi) + more for d, more in zip(declared, extra, strict=True))
    data = TrainingData(tuple(prepared), (0, 1, 2), declared, tau)
    plain = data.evidence([], NoiseModel.white(np.ones(robot.n) if levels is None else levels))
    left = data.residuals([], (), plain.solve(()))
    noise = fit_noise(left, [run.usable for run in prepared])
    return unexplained_structure(data, [], [], signals, noise, RULES, robot.joint_names)[0]


def white(regression: Regression, seed: int, size: Array | float = NOISE) -> list[Array]:
    rng = np.random.default_rng([seed, 5])
    return [rng.normal(size=run.prepared.tau.shape) * size for run in regression.runs]


@pytest.mark.parametrize("joint", [0, 1])
@pytest.mark.parametrize("other", [0, 1])
def test_the_position_behind_a_residual_is_named(
    regression: Regression, signals: list[Signals], joint: int, other: int
) -> None:
    """Torque of one joint depends on the position of one joint, in a way no effect has."""
    extra = white(regression, 1)
    for run, s, more in zip(regression.runs, signals, extra, strict=True):
        bump = np.exp(-(((s.q[:, other] - s.q[:, other].mean()) / 0.25) ** 2))
        column = np.zeros((len(s.t), 2))
        column[:, joint] = 3.0 * bump
        more += run.prepared.averaged_for_fit(column)
    names = regression.robot.joint_names
    (record,) = found(regression, signals, extra)
    assert record.joint == names[joint]
    assert record.depends_on[0] == Covariate("position", names[other])
    assert 0.1 < record.share_of_residual < 1.0


def test_time_is_named_too(regression: Regression, signals: list[Signals]) -> None:
    extra = white(regression, 2)
    for run, s, more in zip(regression.runs, signals, extra, strict=True):
        more[:, 1] += run.prepared.averaged(0.08 * s.t)
    (record,) = found(regression, signals, extra)
    assert (record.joint, record.depends_on[0]) == (
        regression.robot.joint_names[1],
        Covariate("time"),
    )


def test_the_noise_of_another_joint_does_not_hide_it(
    regression: Regression, signals: list[Signals]
) -> None:
    levels = np.array([50.0, 0.05])
    extra = white(regression, 3, levels)
    for run, s, more in zip(regression.runs, signals, extra, strict=True):
        bump = 0.5 * np.exp(-(((s.q[:, 1] - s.q[:, 1].mean()) / 0.25) ** 2))
        wave = np.stack([0 * s.t, bump], axis=1)
        more += run.prepared.averaged_for_fit(wave)
    records = found(regression, signals, extra, levels)
    assert [record.joint for record in records] == [regression.robot.joint_names[1]]


@pytest.mark.parametrize(("times", "told"), [(3.0, True), (0.3, False)])
def test_structure_of_a_thousandth_of_the_torque_is_not_told(
    regression: Regression, signals: list[Signals], times: float, told: bool
) -> None:
    torque = np.concatenate([run.prepared.tau_fit[:, 0] for run in regression.runs])
    size = times * 1e-3 * np.sqrt(np.mean(torque**2))
    extra = white(regression, 4, 0.3 * size)
    for run, s, more in zip(regression.runs, signals, extra, strict=True):
        wave = np.stack([np.sqrt(2.0) * size * np.sin(7.0 * s.q[:, 0]), 0 * s.t], axis=1)
        more += run.prepared.averaged_for_fit(wave)
    assert bool(found(regression, signals, extra, np.full(2, 0.3 * size))) == told


def test_a_joint_that_is_not_told_of_does_not_keep_another_silent(
    regression: Regression, signals: list[Signals]
) -> None:
    """Of joint 0 a structure is sure, but small beside its torque."""
    torque = np.concatenate([run.prepared.tau_fit[:, 0] for run in regression.runs])
    size = np.array([3e-4 * np.sqrt(np.mean(torque**2)), 1.0])
    levels = np.array([0.05, 1.0]) * size
    extra = white(regression, 6, levels)
    for run, s, more in zip(regression.runs, signals, extra, strict=True):
        waves = np.sqrt(2.0) * size * np.sin(7.0 * s.q)
        more += run.prepared.averaged_for_fit(waves)
    records = found(regression, signals, extra, levels)
    assert [record.joint for record in records] == [regression.robot.joint_names[1]]


def test_white_noise_has_no_names(regression: Regression, signals: list[Signals]) -> None:
    alarms = [seed for seed in range(40) if found(regression, signals, white(regression, seed))]
    assert len(alarms) <= 2  # 5 %


def test_noise_with_memory_has_no_names(regression: Regression, signals: list[Signals]) -> None:
    alarms = 0
    for seed in range(20):
        extra = [lfilter([1.0], [1.0, -0.8], e, axis=0) for e in white(regression, 100 + seed)]
        alarms += bool(found(regression, signals, extra))
    assert alarms <= 2
