"""Plant and recover, through the program's own filters and columns."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.data_spec import EffectSpec, IdentificationSpec
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import declared_effects
from excite_cli.identification.factors import solve
from excite_cli.identification.fit import Fit, essential, fit
from excite_cli.identification.identify import judged
from excite_cli.identification.regression import follows_model, rebuilt
from excite_cli.robot.model import Array, Robot
from excite_cli.simulation.build import true_inertias
from tests.identification.synthetic import measured, regression_of
from tests.robot.random_robots import random_robot

FRICTION = (EffectSpec(kind="viscous_friction"), EffectSpec(kind="coulomb_friction"))
FREE = IdentificationSpec(consistent=False)
KEPT = IdentificationSpec(consistent=False, inertias="cad", uncertainty=0.1)


@pytest.fixture(scope="module")
def robot() -> Robot:
    return random_robot(7, joints=4, branches=False, prismatic=False)


@pytest.fixture(scope="module")
def truth(robot: Robot) -> Array:
    return true_inertias(robot, 0.2, seed=5)


@pytest.fixture(scope="module")
def friction(robot: Robot) -> tuple[Effect, ...]:
    return declared_effects(FRICTION, robot)


def sized(effects: tuple[Effect, ...], seed: int = 0) -> Array:
    rng = np.random.default_rng(seed)
    return rng.uniform(0.5, 3.0, sum(len(effect.parameters) for effect in effects))


@pytest.fixture(scope="module")
def noisy(robot: Robot, truth: Array, friction: tuple[Effect, ...]) -> Fit:
    data = measured(robot, truth, friction, sized(friction), noise=0.3, memory=0.8)
    return fit(regression_of(robot, data, friction), IdentificationSpec())


def test_parameters_are_found_within_their_intervals(
    robot: Robot, truth: Array, friction: tuple[Effect, ...], noisy: Fit
) -> None:
    base = regression_of(robot, measured(robot, truth, seconds=4.0)).base
    expected = np.concatenate([base.mapping @ truth, sized(friction)])
    z = (noisy.values - expected) / noisy.std
    assert np.abs(z).max() < 4.5
    assert 0.6 < np.sqrt(np.mean(z**2)) < 1.5
    assert noisy.identifiable[noisy.rank :].all()
    assert base.mapping @ noisy.phi == pytest.approx(noisy.base_values, abs=1e-9)


def test_a_consistent_set_comes_along(noisy: Fit) -> None:
    assert noisy.consistent is not None
    assert noisy.consistent.solved
    assert noisy.consistent.eigenvalues.min() > 0
    assert noisy.consistent_effect_values(0) == pytest.approx(noisy.effect_values(0), rel=0.2)


def test_names_units_and_reports(robot: Robot, noisy: Fit) -> None:
    assert len(set(noisy.names)) == len(noisy.names) == len(noisy.units)
    assert noisy.names[noisy.rank] == f"viscous_friction.viscous[{robot.joint_names[0]}]"
    report = noisy.effect_report(0)
    assert report["viscous"].value == noisy.values[noisy.rank]
    assert report["viscous"].std == pytest.approx(noisy.std[noisy.rank])


def test_friction_that_follows_the_load_is_settled(robot: Robot, truth: Array) -> None:
    """Its columns are made of torque of the URDF first, of what was found at last."""
    load = EffectSpec(kind="load_dependent_friction", joints=(robot.joint_names[1],))
    effects = declared_effects((*FRICTION, load), robot)
    values = np.append(sized(effects)[:-1], 0.1)
    data = measured(robot, truth, effects, values)
    regression = regression_of(robot, data, effects)
    assert follows_model(regression)
    found = fit(regression, FREE)
    assert found.values[-1] == pytest.approx(0.1, rel=0.02)
    first = fit(rebuilt(regression, standard_parameters(robot), np.zeros(0)), FREE)
    assert first.values[-1] == pytest.approx(found.values[-1], rel=1e-3)


def test_a_gain_is_that_of_the_whole_torque_and_friction_that_of_the_robot(
    robot: Robot, truth: Array
) -> None:
    effects = declared_effects(
        (*FRICTION, EffectSpec(kind="torque_gain", joints=("joint_2",))), robot
    )
    values = np.append(sized(effects[:-1]), 0.12)
    data = measured(robot, truth, effects[:-1], values[:-1], noise=0.02)
    amplified = np.ones(robot.n)
    amplified[1] += values[-1]
    data = replace(data, runs=tuple(replace(run, tau=run.tau * amplified) for run in data.runs))
    found = fit(regression_of(robot, data, effects), FREE)
    z = (found.values[found.rank :] - values) / found.std[found.rank :]
    assert np.abs(z).max() < 4.5


def test_friction_alone_does_not_follow_the_load(
    robot: Robot, truth: Array, friction: tuple[Effect, ...]
) -> None:
    regression = regression_of(robot, measured(robot, truth, seconds=4.0), friction)
    assert not follows_model(regression)


def test_kept_inertias_stay_near_the_urdf_and_leave_friction_free(
    robot: Robot, friction: tuple[Effect, ...]
) -> None:
    """A second of data, much noise: the free fit goes astray, the kept one does not."""
    cad = standard_parameters(robot)
    data = measured(robot, cad, friction, sized(friction), noise=2.0, seconds=4.0, seeds=(1,))
    regression = regression_of(robot, data, friction)
    base = regression.base
    kept, free = fit(regression, KEPT), fit(regression, FREE)
    target = base.mapping @ cad
    assert np.linalg.norm(kept.base_values - target) < 0.5 * np.linalg.norm(
        free.base_values - target
    )
    wrong = (kept.values[kept.rank :] - sized(friction)) / kept.std[kept.rank :]
    assert np.abs(wrong).max() < 4
    assert (kept.std[: kept.rank] < free.std[: kept.rank] * 1.05).all()


def test_a_joint_that_stood_still_is_not_identifiable(
    robot: Robot, truth: Array, friction: tuple[Effect, ...]
) -> None:
    data = measured(robot, truth, friction, sized(friction), noise=0.1, still=3)
    found = fit(regression_of(robot, data, friction), FREE)
    of_friction = np.arange(found.rank, len(found.names))
    standing = [i for i in of_friction if f"[{robot.joint_names[3]}]" in found.names[i]]
    assert len(standing) == 2
    assert not found.identifiable[standing].any()
    assert np.abs(found.values[standing]).max() < 1e-9  # and not a wild value that rounding gives
    assert found.identifiable[np.setdiff1d(of_friction, standing)].all()


def test_parameters_that_are_noise_are_dropped() -> None:
    rng = np.random.default_rng(0)
    c = rng.normal(size=(400, 6))
    c[:, 5] = c[:, 0] + 1e-3 * rng.normal(size=400)  # hardly told from the first
    tau = c @ [5.0, 2.0, -1.0, 0.0, 0.0, 0.0] + 0.5 * rng.normal(size=400)
    factor = np.linalg.qr(np.column_stack([c, tau]) / 0.5, mode="r")
    kept = essential(factor, np.sqrt(np.diag(solve(factor).inverse)))
    assert list(kept) in ([True, True, True, False, False, False],
                          [False, True, True, False, False, True])  # fmt: skip


def test_essential_parameters_predict_as_well(noisy: Fit, robot: Robot, truth: Array) -> None:
    assert 0 < noisy.essential.sum() <= len(noisy.values)
    loose = noisy.relative_std > 1.0
    assert not noisy.essential[loose].any()


def test_errors_on_other_runs_reach_the_noise(
    robot: Robot, truth: Array, friction: tuple[Effect, ...], noisy: Fit
) -> None:
    other = measured(robot, truth, friction, sized(friction), noise=0.3, memory=0.8, seeds=(8,))
    regression = regression_of(robot, other, friction)
    error, _ = judged(robot, noisy, [run.prepared for run in regression.runs], held_out=True)
    assert np.array(list(error.rms.values())) == pytest.approx(noisy.noise, rel=0.3)
    assert np.array(list(error.rms_raw.values())) == pytest.approx(0.3, rel=0.3)


def test_the_kuka_with_its_inertias_kept(kr300: Path) -> None:
    """Spring and armatures of the data sheets come out of the log (see its README)."""
    from excite_cli.config.robot_spec import RobotSpec
    from excite_cli.measurement.dataset import Dataset, Run
    from excite_cli.robot.model import build_robot

    h5py = pytest.importorskip("h5py")
    robot = build_robot(RobotSpec(urdf=str(kr300 / "kr300.urdf")))
    with h5py.File(kr300 / "kr300.h5") as file:
        runs = tuple(
            Run(name, group["t"][()], group["q"][()], group["tau"][()])
            for name, group in file["runs"].items()
        )
    data = Dataset(robot.joint_names, runs)
    spring = EffectSpec(kind="spring", joints=("axis_2",))
    effects = declared_effects((*FRICTION, EffectSpec(kind="armature"), spring), robot)
    found = fit(regression_of(robot, data, effects), IdentificationSpec(inertias="cad"))
    known = dict(zip(found.names, zip(found.values, found.std, strict=True), strict=True))
    stiffness, std = known["spring.stiffness[axis_2]"]
    assert abs(stiffness - 7000) < max(3 * std, 500)
    for axis, armature in (("axis_2", 844.0), ("axis_3", 751.0)):
        value, std = known[f"armature.inertia[{axis}]"]
        assert abs(value - armature) < 3 * std
    assert found.consistent is not None
    assert found.consistent.eigenvalues.min() > 0
