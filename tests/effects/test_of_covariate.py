"""Effects that follow a column of the log: formulas, reference, and how they are declared."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.config.data_spec import EffectSpec
from excite_cli.diagnosis.candidates import shapes_around
from excite_cli.effects.catalogue import declared_effects
from excite_cli.effects.covariate_friction import CovariateFriction
from excite_cli.effects.covariate_offset import CovariateOffset
from excite_cli.errors import ConfigError
from tests.effects.motions import signals_of
from tests.robot.random_robots import random_robot

AT_20 = {"reference": 20.0}
ROBOT = random_robot(5, joints=3, branches=False, prismatic=False)
MOVED = signals_of(ROBOT, 300)
CLOCK = MOVED.t / MOVED.t[-1]
# Twenty degrees at first, thirty at the end.
SIGNALS = replace(MOVED, covariates={"temp": 20.0 + 10.0 * CLOCK, "fan": MOVED.t})


def test_friction_changes_with_the_column_and_is_nothing_at_the_reference() -> None:
    effect = CovariateFriction((1,), AT_20, (), "temp")
    tau = effect.torque(SIGNALS, np.array([-0.2, 0.05]))[:, 1]
    v, warmer = SIGNALS.v[:, 1], SIGNALS.covariates["temp"] - 20.0
    fast = np.abs(v) > 0.01
    assert tau[fast] == pytest.approx((warmer * (-0.2 * np.sign(v) + 0.05 * v))[fast])
    assert tau[0] == 0.0
    # Friction that thins exponentially is of its form. f (exp(−κ (c − c₀)) − 1) sgn v = −f κ δ sgn
    # v, with δ for this κ and no other.
    thins = 4.0 * np.expm1(-0.07 * warmer)
    effect = CovariateFriction((1,), {**AT_20, "curvature": 0.07}, (), "temp")
    tau = effect.torque(SIGNALS, np.array([-4.0 * 0.07, 0.0]))[:, 1]
    assert tau[fast] == pytest.approx((thins * np.sign(v))[fast])
    nearly = replace(effect, shape={**AT_20, "curvature": 1e-8})
    straight = CovariateFriction((1,), AT_20, (), "temp")
    assert nearly.columns(SIGNALS) == pytest.approx(straight.columns(SIGNALS), rel=1e-6, abs=1e-9)
    # An offset changes with the column however the joint moves.
    tau = CovariateOffset((2,), AT_20, (), "temp").torque(SIGNALS, np.array([0.3]))
    assert tau[:, 2] == pytest.approx(0.3 * (SIGNALS.covariates["temp"] - 20.0))
    assert not tau[:, :2].any()
    still = replace(SIGNALS, covariates={"temp": np.full(len(SIGNALS.t), 21.7)})
    assert CovariateOffset.grid(ROBOT, (0,), [still, still]) == []
    assert SIGNALS.every(2).covariates["temp"] == pytest.approx(SIGNALS.covariates["temp"][::2])


def test_shapes_that_are_looked_for() -> None:
    own = [SIGNALS.with_covariate("temp")]  # ten degrees
    straight, *curves = CovariateFriction.grid(ROBOT, (0,), own)
    assert straight["curvature"] == 0.0
    assert [each["curvature"] for each in curves] == pytest.approx([0.07, 0.15, -0.07])
    effect = CovariateFriction((0,), straight, (), "temp")
    tried = {round(shape["curvature"], 6) for shape in shapes_around(effect, own)}
    assert {0.0, 0.15, -0.15, 0.005, -0.005} <= tried
    bent = CovariateFriction((0,), {**straight, "curvature": 0.35}, (), "temp")
    assert max(shape["curvature"] for shape in shapes_around(bent, own)) <= 0.4
    # The reference is the mean of what was seen.
    own = SIGNALS.with_covariate("temp")
    warm = replace(own, covariates={"temp": np.full(len(own.t), 40.0)})
    shape, *_ = CovariateFriction.grid(ROBOT, (0,), [own, warm])
    assert shape["reference"] == pytest.approx(32.5)
    assert not CovariateFriction((0,), shape).finer_steps("reference", [own])


def test_sizes_are_told_per_unit_of_the_column() -> None:
    effect = CovariateFriction((0,), AT_20, (), "temp")
    told = effect.report(np.array([-0.2, 0.05]), np.eye(2))
    assert told["coulomb_slope"].unit == "N·m per unit of temp"
    assert told["viscous_slope"].unit == "N·m·s/rad per unit of temp"
    assert (told["reference"].value, told["reference"].unit) == (20.0, "units of temp")
    bent = replace(effect, shape={**AT_20, "curvature": 0.03}).report(np.zeros(2), np.eye(2))
    assert (bent["curvature"].value, bent["curvature"].unit) == (0.03, "per unit of temp")
    places = {CovariateFriction((0,), AT_20, (), name).place for name in ("temp", "fan", "temp")}
    assert len(places) == 2


def test_a_declared_effect_names_its_column() -> None:
    spec = EffectSpec(kind="covariate_friction", joints=("joint_2",), covariate="temp")
    (effect,) = declared_effects((spec,), ROBOT)
    assert (effect.covariate, effect.shape) == (
        "temp",
        {"reference": 0.0, "curvature": 0.0},
    )
    with pytest.raises(ConfigError, match=r"effects\[0\].covariate: covariate_friction follows"):
        declared_effects((EffectSpec(kind="covariate_friction"),), ROBOT)
    with pytest.raises(ConfigError, match=r"coulomb_friction follows no column.*'temp'"):
        declared_effects((EffectSpec(kind="coulomb_friction", covariate="temp"),), ROBOT)
