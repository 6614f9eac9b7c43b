"""Factors of normal matrices against the general solver."""

import numpy as np
import pytest

from excite_cli.diagnosis.schur import Cholesky


@pytest.mark.parametrize("size", [1, 2, 30])
def test_one_and_many_right_sides(size: int) -> None:
    rng = np.random.default_rng(size)
    rows = rng.normal(size=(2 * size, size))
    matrix, rhs = rows.T @ rows, rng.normal(size=(size, 3))
    kept = matrix.copy(), rhs.copy()
    factor = Cholesky(matrix)
    assert factor.solve(rhs) == pytest.approx(np.linalg.solve(matrix, rhs), rel=1e-8)
    assert factor.solve(rhs[:, 0]) == pytest.approx(np.linalg.solve(matrix, rhs[:, 0]), rel=1e-8)
    assert np.array_equal(matrix, kept[0])
    assert np.array_equal(rhs, kept[1])


def test_what_is_not_positive_definite_has_no_factor() -> None:
    with pytest.raises(np.linalg.LinAlgError, match="column 2 of 3"):
        Cholesky(np.diag([1.0, -1.0, 1.0]))
