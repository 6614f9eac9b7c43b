"""Play operators against one sample at a time, and what is known of them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.diagnosis.residual_predictability import histories
from excite_cli.robot.model import Array

SHARES = (0.05, 0.15, 0.4)
PATHS = st.lists(st.floats(-3.0, 3.0), min_size=2, max_size=40)
EASY = settings(max_examples=60, deadline=None, derandomize=True)


def slow(x: Array, radius: float) -> Array:
    """x less the place of a ring of this half-width, which x, a pin within it, pushes about."""
    ring, found = float(x[0]), []
    for pin in x:
        if pin > ring + radius:
            ring = float(pin) - radius
        elif pin < ring - radius:
            ring = float(pin) + radius
        found.append(float(pin) - ring)
    return np.array(found)


def of_path(path: list[float] | Array) -> tuple[Array, Array]:
    """Histories (T, 3) of a single path, and the half-widths (3,)."""
    x = np.array(path, dtype=float)
    return histories([x[:, None]])[0][:, 0], 0.5 * float(np.ptp(x)) * np.array(SHARES)


def test_histories_are_those_of_the_slow_rule_with_common_widths() -> None:
    """Three runs of different length; amplitudes are those of all runs, joint by joint."""
    rng = np.random.default_rng(0)
    signals = [np.cumsum(rng.normal(size=(t, 2)) * [1.0, 30.0], axis=0) for t in (300, 50, 120)]
    every = np.concatenate(signals)
    amplitude = 0.5 * (every.max(axis=0) - every.min(axis=0))
    found = histories(signals)
    for x, parts in zip(signals, found, strict=True):
        assert parts.shape == (*x.shape, 3)
        for joint in range(2):
            for k, share in enumerate(SHARES):
                expected = slow(x[:, joint], share * amplitude[joint])
                assert parts[:, joint, k] == pytest.approx(expected, abs=1e-12)


@EASY
@given(PATHS)
def test_the_part_within_the_play_is_bounded_and_starts_in_the_middle(path: list[float]) -> None:
    parts, radii = of_path(path)
    assert (parts[0] == 0.0).all()
    assert (np.abs(parts) <= radii + 1e-12).all()


@EASY
@given(PATHS)
def test_what_moves_on_in_one_direction_has_no_hysteresis(path: list[float]) -> None:
    """Once x has moved by r, the play is taken up and what is within it stays at ±r."""
    for direction in (1.0, -1.0):
        x = direction * np.sort(path)
        x = x if direction > 0 else x[np.argsort(-x)]
        parts, radii = of_path(x)
        for k, radius in enumerate(radii):
            taken_up = np.abs(x - x[0]) >= radius
            assert parts[taken_up, k] == pytest.approx(np.sign(x[-1] - x[0]) * radius, abs=1e-9)
            assert parts[~taken_up, k] == pytest.approx(x[~taken_up] - x[0], abs=1e-9)


@EASY
@given(PATHS)
def test_speed_does_not_matter(path: list[float]) -> None:
    """The same way sampled at twice and at three times as many instants."""
    parts, _ = of_path(path)
    for times in (2, 3):
        dense = np.interp(np.arange(times * (len(path) - 1) + 1) / times, range(len(path)), path)
        assert of_path(dense)[0][::times] == pytest.approx(parts, abs=1e-9)


@EASY
@given(PATHS, st.floats(0.1, 50.0), st.floats(-10.0, 10.0))
def test_units_and_zeros_do_not_matter(path: list[float], unit: float, zero: float) -> None:
    parts, _ = of_path(path)
    assert of_path(unit * np.array(path) + zero)[0] == pytest.approx(unit * parts, abs=1e-9)
    assert of_path(-np.array(path))[0] == pytest.approx(-parts, abs=1e-9)


def test_a_repeated_swing_encloses_a_loop_whose_area_is_known() -> None:
    """x goes to and fro between ±1: ∮ parts dx = 4 r (1 − r), the energy a play loses."""
    swing = np.concatenate([np.linspace(-1, 1, 2001), np.linspace(1, -1, 2001)[1:]])
    parts, _ = of_path(np.concatenate([swing, swing[1:]]))
    second = parts[len(swing) - 1 :]
    middle = 0.5 * (second[1:] + second[:-1])
    area = np.sum(middle * np.diff(swing)[:, None], axis=0)
    radii = np.array(SHARES)
    assert area == pytest.approx(4 * radii * (1 - radii), rel=2e-3)


def test_what_stands_has_no_history() -> None:
    (parts,) = histories([np.full((5, 2), 3.0)])
    assert np.array_equal(parts, np.zeros((5, 2, 3)))
