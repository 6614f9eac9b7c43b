"""The robust fit with what is known beside the data."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.diagnosis.robust_fit import robust_solve
from tests.diagnosis.explicit_data import FIXED, WEIGHED, random_candidates, random_data

LEVELS = np.array([0.9, 2.0])


def test_what_was_weighed_exactly_holds_and_the_rest_fits_beside_it() -> None:
    """Sums that are known to be what the free fit says are no news."""
    data, candidates = random_data(7), random_candidates(7)
    free = robust_solve(data, candidates, (1, 2), LEVELS)
    rows, target = WEIGHED[:, :-1], WEIGHED[:, -1]
    exact = 1e3 * WEIGHED
    found = robust_solve(replace(data, prior=exact.T @ exact), candidates, (1, 2), LEVELS)
    assert rows @ found[:FIXED] == pytest.approx(target, rel=1e-4)
    assert np.abs(rows @ free[:FIXED] - target).min() > 0.5  # no matter of course
    told = WEIGHED.copy()
    told[:, -1] = rows @ free[:FIXED]
    told *= 1e3
    same = robust_solve(replace(data, prior=told.T @ told), candidates, (1, 2), LEVELS)
    assert same == pytest.approx(free, rel=1e-3, abs=1e-3)


def test_what_is_hardly_known_changes_nothing() -> None:
    data, candidates = random_data(7), random_candidates(7)
    vague = 1e-6 * WEIGHED
    found = robust_solve(replace(data, prior=vague.T @ vague), candidates, (0,), LEVELS)
    assert found == pytest.approx(robust_solve(data, candidates, (0,), LEVELS), rel=1e-6)
