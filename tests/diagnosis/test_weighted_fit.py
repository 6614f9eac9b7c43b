"""Weighted least squares from Gram matrices, beside the fit that `identify` makes of the rows."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from excite_cli.diagnosis.training import TrainingData
from excite_cli.diagnosis.weighted_fit import WeightedFit
from excite_cli.identification.least_squares import fit_rows
from excite_cli.robot.model import Array
from tests.diagnosis.explicit_data import FIXED, PRIOR, random_candidates, random_data

MODELS = ((), (0,), (1, 2), (0, 1, 3, 4))


@pytest.mark.parametrize("chosen", MODELS)
@pytest.mark.parametrize("seed", [1, 2])
def test_it_is_the_fit_of_identify(chosen: tuple[int, ...], seed: int) -> None:
    data, candidates = random_data(seed), random_candidates(seed)
    data = _with(data, tuple(tau * [1.0, 7.0] for tau in data.tau))  # joints of unequal noise
    found = WeightedFit(data, candidates)(chosen)[0]
    rows = data.rows(candidates, chosen)
    assert found == pytest.approx(fit_rows(rows, "wls").x, rel=1e-9, abs=1e-12)


def test_a_prior_holds_what_it_knows() -> None:
    data, candidates = random_data(3, 1e4 * PRIOR), random_candidates(3)
    found = WeightedFit(data, candidates)([0])[0]
    known = PRIOR[:, :FIXED].any(axis=0)
    assert found[:FIXED][known] == pytest.approx(np.zeros(known.sum()), abs=1e-3)
    assert np.abs(found[:FIXED][~known]).min() > 1e-3


def test_what_is_held_is_left_out() -> None:
    """The others are those of a model of the torque that is left, without their columns."""
    data, candidates = random_data(4), random_candidates(4)
    held = np.array([0.3, 2.0, -1.0, 0.5])
    found = WeightedFit(data, candidates)([1, 2], held)[0]
    bare = random_data(4)
    left = tuple(tau - own @ held for tau, own in zip(bare.tau, bare.declared, strict=True))
    bare = _with(bare, left, tuple(each[:, :, :0] for each in bare.declared))
    assert found[:FIXED] == pytest.approx(held)
    assert found[FIXED:] == pytest.approx(WeightedFit(bare, candidates)([1, 2])[0], rel=1e-9)


def _with(
    data: TrainingData, tau: tuple[Array, ...], declared: tuple[Array, ...] | None = None
) -> TrainingData:
    prior: dict[str, Any] = {} if declared is None else {"prior": None, "weighed": None}
    return replace(data, tau=tau, declared=declared or data.declared, **prior)
