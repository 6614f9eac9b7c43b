"""Shapes from pass to pass: when they have settled, and in which of them noise is measured."""

from dataclasses import replace

import numpy as np

from excite_cli.diagnosis.noise_model import NoiseModel
from excite_cli.diagnosis.search_loop import Fit, _of_best_shapes
from excite_cli.effects.base import Effect
from tests.diagnosis.explicit_data import effect
from tests.diagnosis.test_judgement import on_joint_0, planted


def fit_of(*effects: Effect) -> Fit:
    return Fit(np.zeros(10), effects, np.zeros(len(effects)), np.ones(2), 100.0)


def test_a_fit_is_settled_once_its_shapes_are() -> None:
    """Energies are in units of the noise that is left: they say nothing of a shape that moved."""
    one = fit_of(effect("ripple", periods=20.0), effect("spring"))
    for periods, settled in ((20.4, True), (21.2, False), (30.0, False)):
        assert one.close_to(fit_of(effect("ripple", periods=periods), effect("spring"))) == settled
    assert not one.close_to(replace(one, energy=101.0))
    assert not one.close_to(replace(one, levels=np.array([1.0, 1.1])))


def test_noise_is_measured_in_the_shape_that_leaves_least() -> None:
    """The second of three shapes of the excess is the true one; the first was found before."""
    effects = [
        effect("viscous_friction"),
        effect("stribeck_friction", stribeck_speed=0.1),
        effect("stribeck_friction", stribeck_speed=0.13),
        effect("stribeck_friction", stribeck_speed=0.2),
    ]
    mix = np.eye(4)
    mix[2, [1, 3]] = 2.0  # both have some of the true one
    data, candidates = planted(effects, mix, on_joint_0([1.0, 0.0, 3.0, 0.0]))
    plain = data.evidence(candidates, NoiseModel.white(np.ones(2)))
    assert _of_best_shapes(plain, candidates, [0, 1]) == [0, 2]
    assert _of_best_shapes(plain, candidates, [0]) == [0]
