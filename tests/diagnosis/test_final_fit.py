"""The fit that is told: nothing impossible, errors of inexact columns."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.diagnosis.final_fit import FinalFit, final_fit, signal_to_error
from excite_cli.diagnosis.search_loop import SearchResult
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import catalogue
from excite_cli.identification.least_squares import fit_rows
from tests.diagnosis.explicit_data import effect, planted, traced


def told(given: SearchResult) -> FinalFit:
    return final_fit(given, fit_rows(given.data.rows(given.candidates, given.chosen)))


def test_sizes_are_told_beside_two_standard_deviations() -> None:
    """The second is beyond its noise of 0.05, the third is not."""
    effects = [effect("viscous_friction"), effect("armature"), effect("torque_offset")]
    torque = np.array([[3.0, 0.0], [1.0, 0.0], [0.01, 0.0]])
    data, candidates = planted(effects, torque)
    given = traced(data, candidates, (0, 1, 2))
    found = told(given)
    sizes = signal_to_error(given, found)
    assert {i for i, size in sizes.items() if size > 1.0} == {0, 1}
    assert found.parameters[-3:-1] == pytest.approx([3.0, 1.0], abs=0.1)
    assert found.covariance.shape == (len(found.parameters),) * 2


def test_deviations_hold_what_the_columns_of_an_effect_miss() -> None:
    data, candidates = planted([effect("elasticity")], np.array([[2.0, 0.0]]))
    given = traced(data, candidates, (0,))
    found = told(given)
    missed = candidates[0].effect.model_error(found.parameters[-1:])[0]
    assert missed > 0.1
    exact = replace(given, candidates=(replace(candidates[0], effect=effect("armature")),))
    noise = told(exact).covariance[-1, -1]
    assert found.covariance[-1, -1] == pytest.approx(noise + missed**2)


def test_a_payload_is_moved_to_a_body_and_all_that_depends_on_it_too() -> None:
    """Its Ixx is negative by the noise; the friction shares a column with it."""
    width = 11
    mix = np.eye(width)
    mix[0, 5] = 1.0
    _, body = catalogue()["payload"].planted(40.0, {"radius": 1.0, "cz": 0.0})
    body[4] = -0.01  # as fitted, with an error of 0.05
    torque = mix @ np.array([2.0, *body])
    data, candidates = planted(
        [effect("viscous_friction"), effect("payload")], np.outer(torque, [1.0, 0.0]), mix
    )
    given = traced(data, candidates, (0, 1))
    fitted = given.judge.plain.solve((0, 1))[-width:]
    found = told(given).parameters[-width:]
    assert fitted[5] < 0.0
    assert candidates[1].effect.possible(found[1:])
    # What the body has gained of the shared column, the friction has lost.
    assert found[0] + found[5] == pytest.approx(fitted[0] + fitted[5], abs=0.05)
    assert found[0] < fitted[0] - 0.01


def test_deviations_hold_shapes_that_fit_as_well() -> None:
    """In the second shape columns are twice as large: the size is 3 or 1.5, nobody knows which."""
    kind = catalogue()["stribeck_friction"]
    shapes = [kind((0,), {"stribeck_speed": speed}) for speed in (0.1, 0.11)]
    torque = np.array([[3.0, 0.0], [0.0, 0.0]])
    data, candidates = planted(shapes, torque, np.array([[1.0, 2.0], [0.0, 1e-6]]))
    found = told(traced(data, candidates, (0,)))
    assert np.sqrt(found.covariance[-1, -1]) == pytest.approx(1.5 / np.sqrt(2.0), rel=0.05)
    alone = told(traced(data, candidates[:1], (0,)))
    assert np.sqrt(alone.covariance[-1, -1]) < 0.1


def test_a_shape_that_physics_refuses_makes_no_size_uncertain() -> None:
    """Of a shaft without dry friction, one direction fits as the other does, but for the sign."""
    shaft = catalogue()["coupled_friction"]
    effects: list[Effect] = [shaft((0, 1), {"direction": s}) for s in (1.0, -1.0)]
    mix = np.array([[1.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 0.3]])
    data, candidates = planted(effects, np.array([[2.0, 2.0], [0.0, 0.0]]), mix)
    found = told(traced(data, candidates, (0,), lambda x, chosen, added: 1 not in added))
    both = traced(data, candidates, (0,))
    assert signal_to_error(both, told(both))[0] < 1.0
    assert found.parameters[-2] == pytest.approx(2.0, abs=0.1)
    assert np.sqrt(found.covariance[-2, -2]) < 0.1
