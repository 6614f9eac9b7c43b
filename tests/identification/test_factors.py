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
