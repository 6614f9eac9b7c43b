"""Enclosures hold at every instant, and are as narrow as third order makes them."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.proof.taylor import (
    Taylor,
    applied,
    cross,
    dot,
    joined,
    matmul,
    sine_and_cosine,
    stacked,
    transposed,
)

INSIDE = np.linspace(-1.0, 1.0, 41)
ROUNDING = 1e-12


def random_model(rng: np.random.Generator, *shape: int, spread: float = 1.0) -> Taylor:
    sizes = np.array([1.0, spread, spread**2]).reshape(3, *([1] * len(shape)))
    terms = rng.normal(size=(3, *shape)) * sizes
    return Taylor(terms, spread**3 * rng.uniform(0, 1, shape))


def member(model: Taylor, rng: np.random.Generator) -> Callable[[float], np.ndarray]:
    """A function that the model encloses: its error moves about within the radius."""
    error, rate = rng.uniform(-1, 1, model.shape), rng.uniform(1, 9)
    return lambda s: model.at(s) + model.radius * error * np.cos(rate * s)


def assert_encloses(model: Taylor, values: Callable[[float], np.ndarray]) -> None:
    for s in INSIDE:
        off = np.abs(values(s) - model.at(s)) - model.radius
        assert off.max() <= ROUNDING
        assert np.all(values(s) >= model.lower() - ROUNDING)
        assert np.all(values(s) <= model.upper() + ROUNDING)
        assert np.all(np.abs(values(s)) <= model.size + ROUNDING)
        assert np.all(np.abs(values(s) - model.center) <= model.reach + ROUNDING)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([0.01, 0.3, 2.0]))
def test_arithmetic_encloses(seed: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    a, b = (random_model(rng, 4, 3, 3, spread=spread) for _ in range(2))
    x, y = (random_model(rng, 4, 3, spread=spread) for _ in range(2))
    known = rng.normal(size=(5, 3))
    fa, fb, fx, fy = (member(model, rng) for model in (a, b, x, y))
    cases = [
        (a + b, lambda s: fa(s) + fb(s)),
        (a - b, lambda s: fa(s) - fb(s)),
        (-a, lambda s: -fa(s)),
        (a + 2.5, lambda s: fa(s) + 2.5),
        (a - known[0], lambda s: fa(s) - known[0]),
        (a.times(b), lambda s: fa(s) * fb(s)),
        (a.scaled(-3.0), lambda s: -3.0 * fa(s)),
        (matmul(a, b), lambda s: fa(s) @ fb(s)),
        (applied(a, x), lambda s: (fa(s) @ fx(s)[..., None])[..., 0]),
        (cross(x, y), lambda s: np.cross(fx(s), fy(s))),
        (dot(x, y), lambda s: (fx(s) * fy(s)).sum(-1)),
        (x.through(known), lambda s: fx(s) @ known.T),
        (x.summed(-1), lambda s: fx(s).sum(-1)),
        (transposed(a), lambda s: fa(s).swapaxes(-1, -2)),
        (a[:, 1], lambda s: fa(s)[:, 1]),
        (stacked([x, y]), lambda s: np.stack([fx(s), fy(s)], axis=-1)),
        (joined([x, y]), lambda s: np.concatenate([fx(s), fy(s)], axis=-1)),
    ]
    for model, values in cases:
        assert_encloses(model, values)
    for model, values in zip(sine_and_cosine(x), (np.sin, np.cos), strict=True):
        assert_encloses(model, lambda s, values=values: values(fx(s)))


def test_bounds_of_a_parabola_are_exact() -> None:
    inside = Taylor(np.array([1.0, 0.5, 1.0]).reshape(3, 1), np.zeros(1))
    assert inside.lower() == pytest.approx(1.0 - 0.0625)
    assert inside.upper() == pytest.approx(2.5)
    outside = Taylor(np.array([1.0, -3.0, 1.0]).reshape(3, 1), np.array([0.25]))
    assert outside.lower() == pytest.approx(1.0 + 1.0 - 3.0 - 0.25)
    assert outside.upper() == pytest.approx(5.0 + 0.25)


def test_radius_falls_with_the_third_power() -> None:
    """A product of sines over shorter and shorter intervals."""
    widths = []
    for h in (0.2, 0.1, 0.05):
        x = Taylor(np.array([0.7, h, 0.0]).reshape(3, 1), np.zeros(1))
        sine, cosine = sine_and_cosine(x)
        widths.append(float(sine.times(cosine).radius[0]))
    assert widths[0] / widths[1] == pytest.approx(8.0, rel=0.25)
    assert widths[1] / widths[2] == pytest.approx(8.0, rel=0.15)
