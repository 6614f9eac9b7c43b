"""The least over uncertain inertias, enclosed over intervals, against the same at instants."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.dynamics.uncertain_inertias import InertiaUncertainty, Piece
from excite_cli.proof.enclosed_rows import combined, least_of
from excite_cli.proof.taylor import Taylor


def uncertainty(rng: np.random.Generator, size: int) -> InertiaUncertainty:
    center = rng.normal(size=size)
    box = Piece(center, rng.uniform(0, 0.3, size), np.zeros((0, size)))
    both = Piece(center, 0.1 * rng.normal(size=(size, size)), 0.2 * rng.normal(size=(3, size)))
    return InertiaUncertainty((box, both))


def functional(rng: np.random.Generator, spread: float) -> Taylor:
    scale = np.array([1.0, spread, spread**2]).reshape(3, 1, 1, 1)
    return Taylor(rng.normal(size=(3, 4, 2, 6)) * scale, spread**3 * rng.uniform(0, 1, (4, 2, 6)))


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([0.01, 0.2, 1.5]))
def test_bound_holds_at_every_instant(seed: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    y, known = functional(rng, spread), uncertainty(rng, 6)
    bound = least_of(y, known)
    error = rng.uniform(-1, 1, y.shape)
    for s in np.linspace(-1, 1, 21):
        assert np.all(known.least(y.at(s) + error * y.radius) >= bound - 1e-9)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6))
def test_bound_is_tight_for_short_intervals(seed: int) -> None:
    """Off by no more than the crossing of signs and the radius explain: both go with the spread."""
    rng = np.random.default_rng(seed)
    known = uncertainty(rng, 6)
    for spread in (0.02, 0.002):
        y = functional(np.random.default_rng(seed), spread)
        at = np.min([known.least(y.at(s)) for s in np.linspace(-1, 1, 41)], axis=0)
        assert float(np.max(at - least_of(y, known))) < 2.5 * spread


def test_combinations_of_rows() -> None:
    rng = np.random.default_rng(3)
    rows, a = functional(rng, 0.3), rng.normal(size=(5, 2))
    found = combined(a, rows)
    error = rng.uniform(-1, 1, rows.shape)
    for s in (-1.0, 0.3, 1.0):
        value = a @ (rows.at(s) + error * rows.radius)
        assert np.all(np.abs(value - found.at(s)) <= found.radius + 1e-12)
