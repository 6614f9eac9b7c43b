"""Numbers with one standard deviation, rounded to it."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from excite_cli.identification.fit_words import with_deviation


@pytest.mark.parametrize(
    ("value", "std", "told"),
    [
        (3.00012, 0.0121, "3.000 ± 0.012"),
        (0.149972, 0.00061, "0.14997 ± 0.00061"),
        (7012.3, 151.2, "7010 ± 150"),
        (6912.0, 1234.0, "6900 ± 1200"),
        (-12.3456, 4.2, "-12.3 ± 4.2"),
        (1.23, 0.0999, "1.23 ± 0.10"),
        (0.5, 12.0, "0 ± 12"),
        (1e-5, 2e-7, "1.000e-05 ± 2.0e-07"),
        (2.5e8, 1e6, "2.500e+08 ± 1.0e+06"),
        (3.0, 0.0, "3"),
        (0.0625, math.nan, "0.0625"),
        (9e-15, math.inf, "9e-15"),
    ],
)
def test_a_value_is_rounded_to_two_digits_of_its_deviation(
    value: float, std: float, told: str
) -> None:
    assert with_deviation(value, std) == told


@given(st.floats(-1e12, 1e12), st.floats(1e-12, 1e12))
def test_nothing_that_matters_is_lost(value: float, std: float) -> None:
    first, second = with_deviation(value, std).split(" ± ")
    assert float(second) == pytest.approx(std, rel=0.051)
    assert float(first) == pytest.approx(value, abs=0.051 * std, rel=1e-9)
