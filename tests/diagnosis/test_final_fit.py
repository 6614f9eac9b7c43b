"""The fit that is told: nothing insignificant, nothing impossible, errors of inexact columns."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.diagnosis.final_fit import final_fit
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import catalogue
from tests.diagnosis.test_doubt import planted, traced


def one(kind: str, *joints: int) -> Effect:
    effect = catalogue()[kind]
    return effect(joints or (0,), {p.name: p.low for p in effect.shapes})


def test_what_is_no_more_than_its_error_goes_and_the_rest_stays() -> None:
    """The second is beyond its noise of 0.05, the third is not."""
    effects = [one("viscous_friction"), one("armature"), one("torque_offset")]
    torque = np.array([[3.0, 0.0], [1.0, 0.0], [0.01, 0.0]])
    data, candidates = planted(effects, torque)
    found = final_fit(traced(data, candidates, (0, 1, 2)))
    assert set(found.traced.chosen) == {0, 1}
    assert found.parameters[-2:] == pytest.approx([3.0, 1.0], abs=0.1)
    assert found.covariance.shape == (len(found.parameters),) * 2


def test_deviations_hold_what_the_columns_of_an_effect_miss() -> None:
    data, candidates = planted([one("elasticity")], np.array([[2.0, 0.0]]))
    given = traced(data, candidates, (0,))
    effect = candidates[0].effect
    found = final_fit(given)
    missed = effect.model_error(found.parameters[-1:])[0]
    assert missed > 0.1
    exact = replace(given, candidates=(replace(candidates[0], effect=one("armature")),))
    noise = final_fit(exact).covariance[-1, -1]
    assert found.covariance[-1, -1] == pytest.approx(noise + missed**2)


def test_a_negative_size_is_moved_with_all_that_depends_on_it() -> None:
    """Two columns that are nearly one: of one in excess and a negative other, the sum remains."""
    effects = [one("armature"), one("coupled_friction", 0, 1)]
    mix = np.array([[1.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.3]])
    torque = np.array([[2.0, 0.0], [4.0, 4.0], [-0.01, 0.0]])
    data, candidates = planted(effects, torque, mix)
    found = final_fit(traced(data, candidates, (0, 1)))
    values = found.parameters[-3:]
    assert values.min() >= 0.0
    assert values[0] + values[2] == pytest.approx(2.0, abs=0.1)
