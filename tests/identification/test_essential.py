import numpy as np
import pytest

from excite_cli.identification.essential import essential_parameters


def test_parameters_that_are_noise_are_dropped_and_the_rest_refitted() -> None:
    rng = np.random.default_rng(0)
    c = rng.normal(size=(400, 6))
    c[:, 5] = c[:, 0] + 1e-3 * rng.normal(size=400)  # hardly told from the first
    truth = np.array([5.0, 2.0, -1.0, 0.0, 0.0, 0.0])
    tau = c @ truth + 0.5 * rng.normal(size=400)
    factor = np.linalg.qr(np.column_stack([c, tau]) / 0.5, mode="r")
    kept, x = essential_parameters(factor, np.ones(6), np.ones(6, bool))
    assert list(kept) in ([True, True, True, False, False, False],
                          [False, True, True, False, False, True])  # fmt: skip
    expected = np.linalg.lstsq(c[:, kept], tau, rcond=None)[0]
    assert x[kept] == pytest.approx(expected)
    assert (x[~kept] == 0).all()


def test_what_may_not_be_dropped_stays() -> None:
    rng = np.random.default_rng(0)
    c = rng.normal(size=(100, 3))
    tau = c @ [1.0, 0.0, 2.0] + 0.1 * rng.normal(size=100)
    factor = np.linalg.qr(np.column_stack([c, tau]) / 0.1, mode="r")
    kept, _ = essential_parameters(factor, np.ones(3), np.array([True, False, True]))
    assert kept[1]
