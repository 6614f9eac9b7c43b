"""Triangular factors: what is put together says the same of the rows."""

import numpy as np

from excite_cli.identification.factors import run_factors, solve, stacked, together


def test_factors_of_many_runs_together_solve_as_all_rows_do() -> None:
    rng = np.random.default_rng(5)
    runs, n, p = 300, 2, 6
    columns, truth = rng.normal(size=(runs, 9, n, p)), rng.normal(size=p)
    tau = columns @ truth + 0.1 * rng.normal(size=(runs, 9, n))
    usable = rng.random((runs, 9, n)) > 0.2
    factors = together(map(run_factors, columns, tau, usable))
    assert len(factors) < 130
    sigma = np.array([0.5, 2.0])
    weight = usable / sigma
    rows = (columns * weight[..., None]).reshape(-1, p)
    expected = np.linalg.lstsq(rows, (tau * weight).ravel(), rcond=None)[0]
    assert np.allclose(solve(stacked(factors, sigma)).x, expected, rtol=1e-10)


def test_columns_that_one_rounding_holds_apart_are_not_told_apart() -> None:
    """Coulomb friction and offset of a joint that only ever went one way, but for a smooth sign."""
    ones = np.ones(300)
    sign = ones.copy()
    sign[7] -= 1e-7
    rows = np.column_stack([sign, ones, 3.0 + np.linspace(0.0, 1e-3, 300)])
    solution = solve(np.linalg.qr(rows, mode="r"))
    assert not solution.seen.any()
    assert np.allclose(solution.x, 1.5, rtol=1e-2)
