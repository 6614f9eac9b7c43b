"""Plant and recover, through the program's own filters and columns."""

from dataclasses import replace

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
from excite_cli.measurement.dataset import Dataset
from excite_cli.robot.model import Array, Robot
from excite_cli.simulation.build import true_inertias
from tests.identification.synthetic import measured, regression_of
from tests.robot.random_robots import random_robot

FRICTION = (EffectSpec(kind="viscous_friction"), EffectSpec(kind="coulomb_friction"))
FREE = IdentificationSpec(consistent=False)
KEPT = IdentificationSpec(consistent=False, inertias="cad", uncertainty=0.1)
ROBOT = random_robot(7, joints=4, branches=False, prismatic=False)
TRUTH = true_inertias(ROBOT, 0.2, seed=5)
RUBBING = declared_effects(FRICTION, ROBOT)


def sized(effects: tuple[Effect, ...], seed: int = 0) -> Array:
    rng = np.random.default_rng(seed)
    return rng.uniform(0.5, 3.0, sum(len(effect.parameters) for effect in effects))


@pytest.fixture(scope="module")
def noisy() -> Fit:
    data = measured(ROBOT, TRUTH, RUBBING, sized(RUBBING), noise=0.3, memory=0.8)
    return fit(regression_of(ROBOT, data, RUBBING), IdentificationSpec())


def test_parameters_are_found_within_their_intervals(noisy: Fit) -> None:
    base = regression_of(ROBOT, measured(ROBOT, TRUTH, seconds=4.0)).base
    expected = np.concatenate([base.mapping @ TRUTH, sized(RUBBING)])
    z = (noisy.values - expected) / noisy.std
    assert np.abs(z).max() < 4.5
    assert 0.6 < np.sqrt(np.mean(z**2)) < 1.5
    assert noisy.identifiable[noisy.rank :].all()
    assert base.mapping @ noisy.phi == pytest.approx(noisy.base_values, abs=1e-9)
    assert noisy.consistent is not None
    assert noisy.consistent.solved
    assert noisy.consistent.eigenvalues.min() > 0
    assert noisy.consistent_effect_values(0) == pytest.approx(noisy.effect_values(0), rel=0.2)
    assert len(set(noisy.names)) == len(noisy.names) == len(noisy.units)
    assert noisy.names[noisy.rank] == f"viscous_friction.viscous[{ROBOT.joint_names[0]}]"
    report = noisy.effect_report(0)["viscous"]
    assert report.value == noisy.values[noisy.rank]
    assert report.std == pytest.approx(noisy.std[noisy.rank])
    assert 0 < noisy.essential.sum() <= len(noisy.values)
    assert not noisy.essential[noisy.relative_std > 1.0].any()


def test_friction_that_follows_the_load_is_settled() -> None:
    """Its columns are made of torque of the URDF first, of what was found at last."""
    load = EffectSpec(kind="load_dependent_friction", joints=(ROBOT.joint_names[1],))
    effects = declared_effects((*FRICTION, load), ROBOT)
    values = np.append(sized(effects)[:-1], 0.1)
    data = measured(ROBOT, TRUTH, effects, values)
    regression = regression_of(ROBOT, data, effects)
    assert follows_model(regression)
    assert not follows_model(regression_of(ROBOT, data, RUBBING))
    found = fit(regression, FREE)
    assert found.values[-1] == pytest.approx(0.1, rel=0.02)
    first = fit(rebuilt(regression, standard_parameters(ROBOT), np.zeros(0)), FREE)
    assert first.values[-1] == pytest.approx(found.values[-1], rel=1e-3)


def test_a_gain_is_that_of_the_whole_torque_and_friction_that_of_the_robot() -> None:
    effects = declared_effects(
        (*FRICTION, EffectSpec(kind="torque_gain", joints=("joint_2",))), ROBOT
    )
    values = np.append(sized(effects[:-1]), 0.12)
    data = measured(ROBOT, TRUTH, effects[:-1], values[:-1], noise=0.02)
    amplified = np.ones(ROBOT.n)
    amplified[1] += values[-1]
    data = replace(data, runs=tuple(replace(run, tau=run.tau * amplified) for run in data.runs))
    found = fit(regression_of(ROBOT, data, effects), FREE)
    z = (found.values[found.rank :] - values) / found.std[found.rank :]
    assert np.abs(z).max() < 4.5


def test_kept_inertias_stay_near_the_urdf_and_leave_friction_free() -> None:
    """A second of data, much noise: the free fit goes astray, the kept one does not."""
    cad = standard_parameters(ROBOT)
    data = measured(ROBOT, cad, RUBBING, sized(RUBBING), noise=2.0, seconds=4.0, seeds=(1,))
    regression = regression_of(ROBOT, data, RUBBING)
    base = regression.base
    kept, free = fit(regression, KEPT), fit(regression, FREE)
    target = base.mapping @ cad
    assert np.linalg.norm(kept.base_values - target) < 0.5 * np.linalg.norm(
        free.base_values - target
    )
    wrong = (kept.values[kept.rank :] - sized(RUBBING)) / kept.std[kept.rank :]
    assert np.abs(wrong).max() < 4
    assert (kept.std[: kept.rank] < free.std[: kept.rank] * 1.05).all()


def test_a_joint_that_stood_still_is_not_identifiable() -> None:
    data = measured(ROBOT, TRUTH, RUBBING, sized(RUBBING), noise=0.1, still=3)
    found = fit(regression_of(ROBOT, data, RUBBING), FREE)
    of_friction = np.arange(found.rank, len(found.names))
    standing = [i for i in of_friction if f"[{ROBOT.joint_names[3]}]" in found.names[i]]
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


def test_errors_on_other_runs_reach_the_noise(noisy: Fit) -> None:
    other = measured(ROBOT, TRUTH, RUBBING, sized(RUBBING), noise=0.3, memory=0.8, seeds=(8,))
    regression = regression_of(ROBOT, other, RUBBING)
    error, _ = judged(ROBOT, noisy, [run.prepared for run in regression.runs], held_out=True)
    assert np.array(list(error.rms.values())) == pytest.approx(noisy.noise, rel=0.3)
    assert np.array(list(error.rms_raw.values())) == pytest.approx(0.3, rel=0.3)


def test_the_kuka_with_its_inertias_kept(kr300: tuple[Robot, Dataset]) -> None:
    """Spring and armatures of the data sheets come out of the log (see its README)."""
    robot, data = kr300
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
