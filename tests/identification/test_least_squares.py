import numpy as np
import pytest

from excite_cli.identification.covariance import RunRows
from excite_cli.identification.factors import (
    run_factors,
    solve,
    stacked,
    together,
    triangle_of,
    undecided,
)
from excite_cli.identification.least_squares import fit_rows
from excite_cli.robot.model import Array

X = np.array([2.0, -1.0, 0.5, 3.0])


def random_rows(seed: int, noise: Array, samples: int = 300, dropped: float = 0.1) -> RunRows:
    rng = np.random.default_rng(seed)
    columns = rng.normal(size=(samples, len(noise), len(X))) * [1.0, 100.0, 0.01, 1.0]
    tau = columns @ X + rng.normal(size=(samples, len(noise))) * noise
    usable = rng.random(tau.shape) > dropped
    return RunRows(columns, np.where(usable, tau, np.nan), usable)


def test_weighting_by_noise_beats_equal_weights() -> None:
    noise = np.array([0.1, 10.0])
    wrong = {}
    for method in ("ols", "wls"):
        fits = [fit_rows([random_rows(seed, noise)], method) for seed in range(20)]
        wrong[method] = np.mean([np.square((fit.x - X) * [1, 100, 0.01, 1]).sum() for fit in fits])
    assert wrong["wls"] < wrong["ols"] / 100
    assert fits[0].noise == pytest.approx(noise, rel=0.15)


def test_without_weights_all_joints_count_alike() -> None:
    """Also where the torque of one is a hundred times that of the other."""
    rows = random_rows(0, np.array([1.0, 1.0]), 50, dropped=0.0)
    scale = np.array([1.0, 100.0])
    rows = RunRows(rows.columns * scale[:, None], rows.tau * scale, rows.usable)
    plain = np.linalg.lstsq(rows.columns.reshape(-1, 4), rows.tau.ravel(), rcond=None)[0]
    assert fit_rows([rows], "ols").x == pytest.approx(plain, rel=1e-9)
    assert fit_rows([rows], "wls").x != pytest.approx(plain, rel=1e-3)


def test_outliers_hardly_move_the_robust_fit() -> None:
    rows = random_rows(3, np.array([1.0, 1.0]), 600)
    bad = np.random.default_rng(0).random(rows.tau.shape) < 0.05
    spoiled = RunRows(rows.columns, rows.tau + np.where(bad, 200.0, 0.0), rows.usable)
    scale = np.array([1, 100, 0.01, 1])
    plain = np.linalg.norm((fit_rows([spoiled], "wls").x - X) * scale)
    robust = np.linalg.norm((fit_rows([spoiled], "irls").x - X) * scale)
    clean = np.linalg.norm((fit_rows([rows], "wls").x - X) * scale)
    assert robust < 2.5 * clean
    assert robust < plain / 5


def test_what_no_sample_shows_is_said_and_does_no_harm() -> None:
    rows = random_rows(1, np.array([0.001, 0.001]))
    twin = rows.columns[:, :, :1]
    columns = np.concatenate([rows.columns, -3 * twin, np.zeros_like(twin)], axis=2)
    fit = fit_rows([RunRows(columns, rows.tau, rows.usable)])
    assert list(fit.seen) == [False, True, True, True, False, False]
    assert np.isinf(np.diag(fit.covariance)[~fit.seen]).all()
    assert fit.x[1:4] == pytest.approx(X[1:], rel=0.02)
    assert fit.x[0] - 3 * fit.x[4] == pytest.approx(X[0], rel=0.02)  # the torque is predicted
    assert np.isfinite(np.diag(fit.covariance)[fit.seen]).all()


def test_what_is_not_decided_between_columns_may_be_all_in_either() -> None:
    """Pairs of equal columns, of other scales, in one stack: each pair for itself."""
    rng = np.random.default_rng(0)
    one, other, alone = rng.normal(size=(3, 50))
    columns = np.stack([one, -one, alone, 9 * other, other], axis=1)
    x = np.array([2.0, -2.0, 1.0, 3.0, 27.0])
    factor = triangle_of(np.column_stack([columns, columns @ x]))
    assert solve(factor).x == pytest.approx(x)
    expected = np.zeros((5, 5))
    expected[:2, :2] = 4.0
    expected[3:, 3:] = [[9.0, -81.0], [-81.0, 729.0]]
    assert undecided(factor, x) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("method", ["wls", "irls"])
def test_a_prior_that_data_contradict_is_not_noise(method: str) -> None:
    """A parameter twenty deviations from its prior, in a residual of less than the noise at first.

    Taken for noise, what the prior forbids would hide the data that contradict it.
    """
    rng, x = np.random.default_rng(0), np.array([2.0, -1.0])
    columns = 0.01 * rng.normal(size=(20, 2, 2))
    tau = columns @ x + 1e-5 * rng.normal(size=(20, 2))
    prior = np.eye(2) / 0.1, np.zeros(2)
    found = fit_rows([RunRows(columns, tau, np.ones(tau.shape, bool))], method, prior)
    assert found.x == pytest.approx(x, rel=0.01)


def test_a_prior_decides_where_data_are_silent_and_nowhere_else() -> None:
    rows = random_rows(1, np.array([0.1, 0.1]))
    columns = np.concatenate([rows.columns, np.zeros((*rows.tau.shape, 1))], axis=2)
    prior = np.eye(5) / 2.0, np.array([0.0, 0.0, 0.0, 0.0, 7.0]) / 2.0
    for method in ("ols", "wls", "irls"):
        fit = fit_rows([RunRows(columns, rows.tau, rows.usable)], method, prior)
        assert fit.x[4] == pytest.approx(7.0)
        assert np.sqrt(fit.covariance[4, 4]) == pytest.approx(2.0)
        assert fit.x[:2] == pytest.approx(X[:2], abs=0.05)


def test_exact_data_do_not_divide_by_zero() -> None:
    rows = random_rows(1, np.zeros(2))
    for method in ("ols", "wls", "irls"):
        fit = fit_rows([rows], method)
        assert fit.x == pytest.approx(X, rel=1e-7)
        assert np.isfinite(fit.covariance).all()


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
    solution = solve(stacked(factors, sigma))
    assert np.allclose(solution.x, expected, rtol=1e-10)
    assert solution.inverse == pytest.approx(np.linalg.inv(rows.T @ rows), rel=1e-8)


def test_columns_that_one_rounding_holds_apart_are_not_told_apart() -> None:
    """Coulomb friction and offset of a joint that only ever went one way, but for a smooth sign."""
    ones = np.ones(300)
    sign = ones.copy()
    sign[7] -= 1e-7
    rows = np.column_stack([sign, ones, 3.0 + np.linspace(0.0, 1e-3, 300)])
    solution = solve(np.linalg.qr(rows, mode="r"))
    assert not solution.seen.any()
    assert np.allclose(solution.x, 1.5, rtol=1e-2)
