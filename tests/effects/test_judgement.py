"""The nearest sizes of possible signs, against a fine search and a closed form."""

import numpy as np
import pytest

from excite_cli.effects.catalogue import kind_named
from excite_cli.effects.judgement import nearest_of_sign


@pytest.mark.parametrize("seed", range(4))
def test_no_point_of_possible_signs_is_nearer(seed: int) -> None:
    rng = np.random.default_rng(seed)
    half = rng.normal(size=(2, 2))
    covariance, values = half @ half.T, np.array([rng.normal(), -abs(rng.normal())])
    found = nearest_of_sign(values, covariance, np.array([False, True]))
    precise = np.linalg.inv(covariance)
    # On the edge x_1 = 0 the minimum over x_0 is where the derivative is zero.
    free = values[0] + precise[0, 1] / precise[0, 0] * values[1]
    assert found == pytest.approx([free, 0.0], abs=1e-9)


def test_several_signs_at_once() -> None:
    signed = np.array([True, True, False])
    found = nearest_of_sign(np.array([-1.0, 2.0, -3.0]), np.eye(3), signed)
    assert found.tolist() == [0.0, 2.0, -3.0]


def test_one_part_of_a_shaft_may_be_missing() -> None:
    """Its dry part came out below zero by the error of the fit."""
    shaft = kind_named("coupled_friction")((0, 1), {"direction": 1.0})
    covariance = np.diag([0.01, 0.04])
    assert not shaft.possible(np.array([3.0, -0.1]))
    assert shaft.why_impossible(np.array([3.0, -0.1]), covariance) == ""
    assert shaft.nearest(np.array([3.0, -0.1]), covariance) == pytest.approx([3.0, 0.0])
    assert "cannot be negative" in shaft.why_impossible(np.array([3.0, -2.0]), covariance)
    # A shaft with little dry friction has one direction.
    assert shaft.possible(np.array([-0.5, 1.0]))  # of two shafts, as in a differential
    assert not shaft.possible(np.array([-0.5, 0.1]))
