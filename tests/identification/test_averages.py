"""Standard deviations contain the rounding of torques that come in steps."""

import numpy as np
import pytest

from excite_cli.identification.averages import average_rows, rounding_of

T = np.arange(2000) / 250.0
AVERAGES = average_rows(len(T), np.arange(40, 1960, 8), 1 / 250.0, 6.0)


def test_the_error_of_a_slow_torque_is_what_rounding_makes_it() -> None:
    """A friction level and a slope, fitted to rounded torques of many sizes and phases."""
    rng = np.random.default_rng(5)
    columns = np.column_stack([np.sign(np.sin(0.8 * T)), np.sin(0.8 * T)])
    x = AVERAGES @ columns
    solve = np.linalg.pinv(x)
    z = []
    for _ in range(100):
        truth = rng.uniform(1.0, 8.0, 2)
        rounded = 5.0 * np.round(columns @ truth / 5.0)
        if not rounded.any():
            continue
        rounding = rounding_of(AVERAGES, rounded, 5.0)
        assert rounding is not None
        spread = (rounding.T @ solve.T).T
        deviation = np.sqrt(np.square(spread).sum(axis=1))
        z.append((solve @ (AVERAGES @ rounded) - truth) / deviation)
    assert 0.3 < np.sqrt(np.mean(np.square(z))) < 1.4
    assert np.mean(np.abs(z) < 2.0) > 0.85


def test_fine_steps_do_not_count() -> None:
    tau = 30 * np.sin(3 * T)
    assert rounding_of(AVERAGES, np.round(tau / 0.1) * 0.1, 0.1) is None
    assert rounding_of(AVERAGES, np.round(tau / 5.0) * 5.0, 5.0) is not None


@pytest.mark.parametrize("step", [0.5, 2.0])
def test_the_variance_of_a_single_sample_is_twice_that_of_uniform_errors(step: float) -> None:
    tau = step * np.round(np.sin(2 * T) / step)
    rounding = rounding_of(average_rows(len(T), np.arange(0, 2000, 50), 1.0, None), tau, step)
    if rounding is None:
        assert not tau.any()
        return
    assert np.asarray(rounding.multiply(rounding).sum(axis=1)) == pytest.approx(2 * step**2 / 12)
