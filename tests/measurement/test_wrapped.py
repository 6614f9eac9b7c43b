"""Angles of one turn are made continuous; other jumps are left alone."""

import numpy as np
import pytest

from excite_cli.measurement.dataset import Array, Run
from excite_cli.measurement.limits import Limits
from excite_cli.measurement.quality import unwrapped

T = np.arange(1000) * 0.01
TRUE = 2.5 + 1.5 * np.sin(2 * T)


def run(q: Array) -> Run:
    return Run("a", T, q[:, None], np.zeros((len(T), 1)))


def limits(lower: float, upper: float) -> Limits:
    ends = np.array([lower]), np.array([upper])
    return Limits(*ends, np.full(1, 9.0), np.full(1, 9.0), np.ones(1, bool))


@pytest.mark.parametrize("low", [-np.pi, 0.0])
def test_a_wrapped_angle(low: float) -> None:
    wrapped = (TRUE - low + (0.0 if low else np.pi)) % (2 * np.pi) + low
    wrapped = np.where(wrapped > np.inf, 0.0, wrapped)
    (found,), told = unwrapped([run(wrapped)], ("j",), limits(-9.0, 9.0))
    off = found.q[:, 0] - TRUE
    np.testing.assert_allclose(off, off[0], atol=1e-9)
    assert [each.kind for each in told] == ["wrapped"]
    assert told[0].joints == ("j",)


def test_it_lies_within_the_limits() -> None:
    wrapped = (TRUE + np.pi) % (2 * np.pi) - np.pi
    (found,), _ = unwrapped([run(wrapped)], ("j",), limits(0.0, 6.0))
    np.testing.assert_allclose(found.q[:, 0], TRUE, atol=1e-9)


def test_other_jumps_are_left_alone() -> None:
    jumps = TRUE + 4.0 * (T > 5.0)
    (found,), told = unwrapped([run(jumps)], ("j",), limits(-9.0, 9.0))
    np.testing.assert_array_equal(found.q[:, 0], jumps)
    assert told == []
    counts = 600.0 * TRUE  # an encoder's
    (found,), told = unwrapped([run(counts)], ("j",), limits(-9.0, 9.0))
    assert told == []
